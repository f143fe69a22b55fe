"""Parameter files as people have them: ours, and what rqt_reconfigure and dynparam dump.

Ours are plain YAML keyed `denoiser:`, `segmenter:`, `reconstructor:`. A dump is YAML with Python
objects in it and holds the parameters of one nodelet, which is told from their names.
"""

import dataclasses
from typing import Any, Dict, Iterable, List

import yaml

from smoke_ground_reconstruction.params import Params

Groups = Dict[str, Dict[str, Any]]


class ParameterFileError(ValueError):
    """A parameter file cannot be read; the text names the file and what is wrong."""


class _DumpLoader(yaml.SafeLoader):
    """Plain YAML, in which a Python object is the mapping or sequence it is written as."""


def _plain(loader: yaml.SafeLoader, _tag: str, node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return loader.construct_mapping(node, deep=True)
    if isinstance(node, yaml.SequenceNode):
        return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node)


_DumpLoader.add_multi_constructor("tag:yaml.org,2002:python/", _plain)


def read_groups(path: str) -> Groups:
    """The parameters a file sets, by group; neither completed nor checked against their limits.

    Raises
    ------
    OSError : the file cannot be opened.
    ParameterFileError : no YAML, no mapping, or a name that belongs to no nodelet.
    """
    with open(path, encoding="utf-8") as file:
        try:
            values = yaml.load(file, Loader=_DumpLoader)
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise ParameterFileError(f"{path}: not YAML ({_one_line(error)})") from error
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise ParameterFileError(f"{path}: not a mapping of parameters")
    if set(values) <= {group.name for group in dataclasses.fields(Params)}:
        return {name: _without_dump_extras(group or {}) for name, group in values.items()}
    return _grouped(path, _without_dump_extras(values))


def read_params(paths: Iterable[str]) -> Params:
    """The defaults, overlaid by each file in turn, and checked.

    Raises
    ------
    OSError, ParameterFileError : as `read_groups`.
    ValueError : an unknown name, or a value out of its limits.
    """
    merged: Groups = {}
    for path in paths:
        for name, group in read_groups(path).items():
            merged.setdefault(name, {}).update(group)
    return Params.from_dict(merged)


def _without_dump_extras(values: Any) -> Any:
    """The parameters in a dump: its `dictitems`, without the `groups` that repeat them."""
    if not isinstance(values, dict):
        return values
    values = values.get("dictitems", values)
    return {name: value for name, value in values.items() if name not in ("groups", "state")}


def _grouped(path: str, values: Dict[str, Any]) -> Groups:
    groups: Groups = {}
    for name, value in values.items():
        groups.setdefault(_group_of(path, str(name)), {})[name] = value
    return groups


def _group_of(path: str, name: str) -> str:
    defaults = Params()
    holders: List[str] = [
        group.name
        for group in dataclasses.fields(Params)
        if hasattr(getattr(defaults, group.name), name)
    ]
    if not holders:
        raise ParameterFileError(f"{path}: '{name}' is a parameter of no nodelet")
    return holders[0]


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
