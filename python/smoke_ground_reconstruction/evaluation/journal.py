"""Finished records of a run, kept on disk until the run is complete.

An evaluation of all scenes takes many minutes. What was scored before it was interrupted counts, as
long as nothing has changed that it hangs on: each record is kept under a key of all that.
"""

import hashlib
import json
from functools import lru_cache
from pathlib import Path

from smoke_ground_reconstruction.evaluation import world

_PACKAGE = Path(__file__).resolve().parents[1]


class Journal:
    """Records by key in a file, one JSON object a line.

    Args:
        path: of the file; it and its folder are made when the first record comes.
    """

    def __init__(self, path):
        self.path = Path(path)

    def read(self):
        """Records by key; a line that was cut off is left out."""
        if not self.path.is_file():
            return {}
        found = {}
        for line in self.path.read_text(encoding="utf-8").splitlines():
            try:
                entry = json.loads(line)
                found[entry["key"]] = entry["record"]
            except (ValueError, KeyError, TypeError):
                continue
        return found

    def add(self, entries):
        """Append pairs of key and record; on disk when this returns."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            for key, record in entries:
                # A line of its own, even after one that was cut off.
                text = json.dumps({"key": key, "record": record}, default=_plain)
                file.write(f"\n{text}\n" if file.tell() else f"{text}\n")

    def remove(self):
        """The run is complete."""
        self.path.unlink(missing_ok=True)


def _plain(value):
    return value.item()


def record_key(job, method):
    """All that decides a record, as a hash: scan, truth, method, parameters and the code itself."""
    plan = job.plan
    parts = [
        job.describe(),
        plan.sensor,
        list(plan.cells),
        world.fingerprint(job.scene, plan.sensor),
        method,
        *(_digest([name]) for name in method.split("+") if name.endswith((".yaml", ".yml"))),
        _code_digest(),
    ]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


@lru_cache(maxsize=1)
def _code_digest():
    """Hash of the package's Python sources, its compiled parts in use, and its parameter files."""
    maps = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    mapped = {line.split()[-1] for line in maps if _PACKAGE.name in line}
    compiled = {path for path in mapped if ".so" in path}
    sources = [*_PACKAGE.rglob("*.py"), *world.config_directory().glob("*.yaml")]
    return _digest(sorted(compiled) + sorted(sources))


def _digest(paths):
    digest = hashlib.sha256()
    for path in paths:
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()
