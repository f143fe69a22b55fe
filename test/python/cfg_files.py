"""The cfg files as they are run: by a stub in dynamic_reconfigure's place."""

import runpy
import sys
import types
from pathlib import Path
from typing import NamedTuple, Optional, Tuple

ROOT = Path(__file__).resolve().parents[2]
STAGES = {"denoiser": "Denoiser", "segmenter": "Segmenter", "reconstructor": "Reconstructor"}


class Parameter(NamedTuple):
    """One gen.add(...) of a cfg file."""

    name: str
    type: str
    text: str
    default: object
    minimum: Optional[float]
    maximum: Optional[float]
    choices: Tuple[str, ...]


class _Generator:
    """Stands in for ParameterGenerator; keeps what it is told."""

    def __init__(self):
        self.parameters = []

    def const(self, name, kind, value, text):
        return value

    def enum(self, values, text):
        return tuple(values)

    def add(self, name, kind, level, text, default, minimum=None, maximum=None, edit_method=()):
        row = Parameter(name, kind, text, default, minimum, maximum, edit_method)
        self.parameters.append(row)

    def generate(self, package, node, name):
        self.generated = (package, node, name)
        return 0


def read_cfg(stage):
    """Parameters of ``denoiser``, ``segmenter`` or ``reconstructor``, in the file's order."""
    generators = []

    def make_generator():
        generators.append(_Generator())
        return generators[-1]

    catkin = types.ModuleType("dynamic_reconfigure.parameter_generator_catkin")
    catkin.ParameterGenerator = make_generator
    for kind in ("bool_t", "int_t", "double_t", "str_t"):
        setattr(catkin, kind, kind[:-2])
    stubs = {
        "dynamic_reconfigure": types.ModuleType("dynamic_reconfigure"),
        catkin.__name__: catkin,
    }
    kept = {name: sys.modules.get(name) for name in stubs}
    sys.modules.update(stubs)
    try:
        runpy.run_path(str(ROOT / "cfg" / f"{STAGES[stage]}.cfg"))
    except SystemExit as end:
        assert not end.code
    finally:
        for name, module in kept.items():
            sys.modules.pop(name)
            if module is not None:
                sys.modules[name] = module
    (generator,) = generators
    package = "smoke_ground_reconstruction"
    assert generator.generated == (package, package, STAGES[stage])
    return generator.parameters
