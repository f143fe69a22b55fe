"""Where the package's `config` folder lies, in a checkout or in the install space."""

from pathlib import Path

_PACKAGE = "smoke_ground_reconstruction"


def config_directory():
    """Path of the folder.

    Raises
    ------
    FileNotFoundError
        One line: there is none beside or above the package.
    """
    for parent in Path(__file__).resolve().parents:
        for candidate in (parent / "config", parent / "share" / _PACKAGE / "config"):
            if (candidate / "scenes").is_dir():
                return candidate
    raise FileNotFoundError(f"{_PACKAGE}: no config/scenes folder beside or above {__file__}")
