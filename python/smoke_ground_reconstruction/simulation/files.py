"""Where the scene and sensor files lie, and what they are called."""

from pathlib import Path

from ..config_files import config_directory
from .errors import SceneError


def resolve(name, folder, what):
    """Path of a file given by its path or by its name in `config/<folder>`."""
    directory = config_directory() / folder
    if str(name).endswith((".yaml", ".yml")):
        return Path(name)
    path = directory / f"{name}.yaml"
    if not path.is_file():
        known = ", ".join(names(folder)) or "none"
        raise SceneError(f"{name}: no such {what} (known: {known}; or give a path ending in .yaml)")
    return path


def names(folder):
    """Names of the YAML files in `config/<folder>`, sorted."""
    return sorted(path.stem for path in (config_directory() / folder).glob("*.yaml"))
