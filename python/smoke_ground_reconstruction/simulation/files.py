"""Where the scene and sensor files lie, and what they are called."""

from pathlib import Path

from .errors import SceneError

_PACKAGE = "smoke_ground_reconstruction"


def config_directory():
    """The package's `config` folder, in a checkout or in the install space."""
    for parent in Path(__file__).resolve().parents:
        for candidate in (parent / "config", parent / "share" / _PACKAGE / "config"):
            if (candidate / "scenes").is_dir():
                return candidate
    raise SceneError(f"{_PACKAGE}: no config/scenes folder beside or above {__file__}")


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
