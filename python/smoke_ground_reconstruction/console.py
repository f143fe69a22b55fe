"""What the command line says beside its results: notes, progress and clean errors, on stderr."""

import sys
from typing import Iterable, Iterator, Optional, TypeVar

T = TypeVar("T")


class CommandError(ValueError):
    """The command cannot go on; the text is the one line that the user reads."""


def note(text: str) -> None:
    """Says something the user should know, on stderr."""
    print(f"smoke_ground: {text}", file=sys.stderr)


def progress(items: Iterable[T], total: Optional[int], unit: str) -> Iterator[T]:
    """Passes `items` on, with a progress bar on stderr where that is a terminal."""
    from tqdm import tqdm

    return iter(tqdm(items, total=total, unit=unit, disable=None, file=sys.stderr))
