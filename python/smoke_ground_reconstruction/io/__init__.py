"""Scans and floors in files: `.bag`, `.pcd` and `.npz`, told apart by the ending."""

import contextlib
import os
from pathlib import Path
from typing import Iterator

FORMATS = (".bag", ".npz", ".pcd")


class DataError(ValueError):
    """A file does not hold what it should; the text names the file and what is wrong."""


def format_of(path: str) -> str:
    """Ending of a file the package reads and writes: `.bag`, `.npz` or `.pcd`.

    Raises
    ------
    DataError : any other ending.
    """
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise DataError(f"{path}: the ending must be one of {', '.join(FORMATS)}")
    return ending


@contextlib.contextmanager
def replacing(path: str) -> Iterator[str]:
    """Name to write to in the place of `path`, which it takes once all has gone well.

    A run that fails or is interrupted leaves an older file as it was.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise DataError(f"{path}: there is no directory {target.parent}")
    part = target.with_name(f".{target.stem}.{os.getpid()}{target.suffix}")
    try:
        yield str(part)
        os.replace(part, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            part.unlink()
