"""Reading of YAML files by key, so that each mistake is named with its file and key."""

import math

import yaml

from .errors import SceneError

_REQUIRED = object()


class Keys:
    """One mapping of a YAML file, read key by key.

    Parameters
    ----------
    mapping : dict
    file : str
        Named in errors.
    path : str
        Where the mapping stands, e.g. ``objects[2]``; empty for the file itself.
    """

    def __init__(self, mapping, file, path=""):
        self.file = file
        self.path = path
        if not isinstance(mapping, dict):
            raise self.error("", "must be a mapping of keys to values")
        self._mapping = dict(mapping)
        self._known = []

    def error(self, key, message):
        """A SceneError that names the file and the key."""
        where = ".".join(part for part in (self.path, key) if part)
        return SceneError(f"{self.file}: {where + ': ' if where else ''}{message}")

    def has(self, key):
        """Is the key there and not yet taken?"""
        return key in self._mapping

    def take(self, key, default=_REQUIRED):
        """The value as YAML has it; each key is taken once."""
        self._known.append(key)
        if key in self._mapping:
            return self._mapping.pop(key)
        if default is _REQUIRED:
            raise self.error(key, "is missing")
        return default

    def number(self, key, default=_REQUIRED, low=-math.inf, high=math.inf):
        """A finite number within [low, high]."""
        value = self.take(key, default)
        if value is default and default is not _REQUIRED:
            return value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, f"must be a number, not {value!r}")
        if not (math.isfinite(value) and low <= value <= high):
            raise self.error(key, f"must lie in [{low:g}, {high:g}], not {value!r}")
        return float(value)

    def numbers(self, key, count, default=_REQUIRED):
        """A list of `count` finite numbers, as a tuple of floats."""
        value = self.take(key, default)
        if value is default and default is not _REQUIRED:
            return value
        if not _are_numbers(value, count):
            raise self.error(key, f"must be {count} numbers, not {value!r}")
        return tuple(float(item) for item in value)

    def text(self, key, default=_REQUIRED, choices=None):
        """A string, one of `choices` if they are given."""
        value = self.take(key, default)
        if value is default and default is not _REQUIRED:
            return value
        if not isinstance(value, str):
            raise self.error(key, f"must be text, not {value!r}")
        if choices is not None and value not in choices:
            raise self.error(key, f"must be one of {', '.join(choices)}, not {value!r}")
        return value

    def flag(self, key, default=_REQUIRED):
        """true or false."""
        value = self.take(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"must be true or false, not {value!r}")
        return value

    def mapping(self, key):
        """A nested mapping; empty if the key is absent."""
        path = f"{self.path}.{key}" if self.path else key
        return Keys(self.take(key, {}), self.file, path)

    def mappings(self, key):
        """A list of mappings; empty if the key is absent."""
        items = self.take(key, [])
        if not isinstance(items, list):
            raise self.error(key, f"must be a list, not {items!r}")
        path = f"{self.path}.{key}" if self.path else key
        return [Keys(item, self.file, f"{path}[{i}]") for i, item in enumerate(items)]

    def points(self, key):
        """A list of [x, y] as it stands, each checked; arcs are left for the caller."""
        items = self.take(key)
        if not isinstance(items, list):
            raise self.error(key, f"must be a list of [x, y], not {items!r}")
        for i, item in enumerate(items):
            if not (isinstance(item, dict) or _are_numbers(item, 2)):
                raise self.error(f"{key}[{i}]", f"must be [x, y], not {item!r}")
        return items

    def finish(self):
        """Refuses keys that nobody asked for."""
        for key in self._mapping:
            raise self.error(str(key), f"unknown key (known: {', '.join(sorted(self._known))})")


def _are_numbers(value, count):
    return (
        isinstance(value, list)
        and len(value) == count
        and all(isinstance(item, (int, float)) and not isinstance(item, bool) for item in value)
        and all(math.isfinite(item) for item in value)
    )


def read_yaml(path):
    """The file's mapping as Keys.

    Raises
    ------
    SceneError
        If the file is absent or no YAML mapping.
    """
    try:
        with open(path, encoding="utf-8") as file:
            return Keys(yaml.safe_load(file), str(path))
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    except yaml.YAMLError as error:
        first_line = " ".join(str(error).split())
        raise SceneError(f"{path}: not YAML: {first_line}") from error
