"""Results kept on disk under the hash of everything that decides them.

The folder is `$SMOKE_GROUND_CACHE`, else `$XDG_CACHE_HOME/smoke_ground_reconstruction`, else
`~/.cache/smoke_ground_reconstruction`. `SMOKE_GROUND_CACHE=off` keeps nothing. Old results leave
when the folder passes LIMIT_BYTES.
"""

import hashlib
import json
import os
import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np

from .._core import simulation as _simulation

LIMIT_BYTES = 2_000_000_000


def directory():
    """The cache's folder, or None where it is switched off."""
    chosen = os.environ.get("SMOKE_GROUND_CACHE")
    if chosen == "off":
        return None
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "smoke_ground_reconstruction"


@lru_cache(maxsize=1)
def _code_digest():
    """Hash of the simulator itself: its sources here and those of its compiled part."""
    digest = hashlib.sha256(_simulation.digest.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def arrays(kind, key, compute):
    """The arrays that `compute()` returns, from disk if they were computed before.

    Parameters
    ----------
    kind : str
        Folder within the cache.
    key : dict
        JSON-able; together with the simulator's own code it decides the result.
    compute : callable
        Returns a dict of arrays.
    """
    folder = directory()
    if folder is None:
        return compute()
    text = json.dumps(key, sort_keys=True, default=_plain) + _code_digest()
    path = folder / kind / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
    found = _read(path)
    if found is None:
        found = compute()
        _write(path, found)
    return found


def _plain(value):
    return value.tolist() if hasattr(value, "tolist") else vars(value)


def _read(path):
    try:
        with np.load(path) as stored:
            found = {name: stored[name] for name in stored.files}
        os.utime(path)  # lately used: leaves last
        return found
    except (OSError, ValueError, EOFError, KeyError):
        return None


def _write(path, found):
    """Atomically; a full disk or a read-only home costs time, not the result."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
            np.savez(file, **found)
        os.replace(file.name, path)
        _prune(path.parent.parent)
    except OSError:
        return


@lru_cache(maxsize=8)
def _written(folder):
    return [0]


def _prune(folder):
    """Every 100 results: the oldest go until 3/4 of the limit is left."""
    count = _written(folder)
    count[0] += 1
    if count[0] % 100 != 1:
        return
    files = sorted(
        (path.stat().st_mtime, path.stat().st_size, path) for path in folder.glob("*/*.npz")
    )
    total = sum(size for _, size, _ in files)
    for _, size, path in files if total > LIMIT_BYTES else []:
        path.unlink(missing_ok=True)
        total -= size
        if total < 0.75 * LIMIT_BYTES:
            return
