"""One truth for parameters: cfg, Python, C++, YAML and README say the same."""

import dataclasses
import importlib.machinery
import importlib.util
import math
from pathlib import Path

import pytest
import yaml

from smoke_ground_reconstruction import Params
from smoke_ground_reconstruction.pipeline import compiled_params

ROOT = Path(__file__).resolve().parents[2]
STAGES = ["denoiser", "segmenter", "reconstructor"]
# Where each parameter of a stage lives in the compiled core.
COMPILED_GROUPS = {
    "denoiser": ["denoiser"],
    "segmenter": ["segmenter.segmentation", "segmenter.clustering"],
    "reconstructor": [
        "reconstructor",
        "reconstructor.polar_segments",
        "reconstructor.room_boundary",
    ],
}


def load_script(name):
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "scripts" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


tables = load_script("generate_parameter_tables")
CFG = {stage: tables.read_cfg(stage) for stage in STAGES}
PARAMETERS = [(stage, parameter) for stage in STAGES for parameter in CFG[stage].parameters]
NUMBERS = [(s, p) for s, p in PARAMETERS if p.type in ("int", "double")]
CHOICES = [(s, p) for s, p in PARAMETERS if p.choices]


def name_of(value):
    return value if isinstance(value, str) else value.name


def compiled_member(params, stage, name):
    """(group, value) of a parameter in the compiled parameters made from `params`."""
    compiled = compiled_params(params)
    for path in COMPILED_GROUPS[stage]:
        group = compiled
        for part in path.split("."):
            group = getattr(group, part)
        if hasattr(group, name):
            return group, getattr(group, name)
    raise AssertionError(f"{stage}.{name} is unknown to the compiled core")


@pytest.mark.parametrize("stage", STAGES)
def test_cfg_makes_the_config_of_its_stage(stage):
    package = "smoke_ground_reconstruction"
    assert CFG[stage].generated == (package, package, stage.capitalize())


@pytest.mark.parametrize("stage", STAGES)
def test_python_has_the_parameters_of_cfg_in_order(stage):
    group = getattr(Params(), stage)
    defaults = {entry.name: getattr(group, entry.name) for entry in dataclasses.fields(group)}
    assert list(defaults) == [parameter.name for parameter in CFG[stage].parameters]
    for parameter in CFG[stage].parameters:
        assert defaults[parameter.name] == parameter.default
        assert type(defaults[parameter.name]) is type(parameter.default)


def test_defaults_are_those_of_table_a_1():
    """What the thesis prints in Table A.1, Algorithm 4 line 5 and Algorithm 5 line 21."""
    printed = {
        "denoiser": {
            "min_neighbors": 100, "max_neighbors": 5000, "intensity_threshold": 25, "alpha": 0.5,
        },
        "segmenter": {
            "min_cluster_size": 50, "max_cluster_size": 5000,
            "min_ground_angle_deg": -3, "max_ground_angle_deg": 3,
            "min_wall_angle_deg": 60, "max_wall_angle_deg": 120,
            "relative_distance_margin": 0.15,
            "max_ground_step_height": 0.05, "min_range_step": 0.03,
        },
        "reconstructor": {
            "height_difference_threshold": 0.05, "segment_angle_deg": 10,
            "reconstruction_gain": 0.15, "min_wall_points": 10, "max_elevation_angle_deg": 5,
            "sensor_height": 0.70,
        },
    }  # fmt: skip
    assert Params.from_dict(printed) == Params()


@pytest.mark.parametrize(("stage", "parameter"), PARAMETERS, ids=name_of)
def test_compiled_defaults_are_those_of_cfg(core, stage, parameter):
    fresh = core.PipelineParams()
    for path in COMPILED_GROUPS[stage]:
        group = fresh
        for part in path.split("."):
            group = getattr(group, part)
        if hasattr(group, parameter.name):
            assert getattr(group, parameter.name) == parameter.default
            return
    raise AssertionError(f"{stage}.{parameter.name} is unknown to the compiled core")


@pytest.mark.parametrize("stage", STAGES)
def test_the_compiled_core_has_no_parameter_beyond_cfg(core, stage):
    names = set()
    for path in COMPILED_GROUPS[stage]:
        group = core.PipelineParams()
        for part in path.split("."):
            group = getattr(group, part)
        names |= {name for name in dir(group) if not name.startswith("_")}
    names -= {"validate", "polar_segments", "room_boundary", "segmentation", "clustering"}
    assert names == {parameter.name for parameter in CFG[stage].parameters}


@pytest.mark.parametrize(("stage", "parameter"), PARAMETERS, ids=name_of)
def test_every_parameter_reaches_the_compiled_core(core, stage, parameter):
    """A value other than the default, so that a forgotten mapping shows."""
    if parameter.type == "bool":
        value = not parameter.default
    elif parameter.choices:
        value = parameter.choices[-1]
    else:
        limit = parameter.maximum
        limit = parameter.minimum if parameter.default == limit else limit
        value = type(parameter.default)(parameter.default + limit) / 2
        value = int(value) if parameter.type == "int" else value
    params = Params()
    setattr(getattr(params, stage), parameter.name, value)
    assert compiled_member(params, stage, parameter.name)[1] == value


@pytest.mark.parametrize(("stage", "parameter"), CHOICES, ids=name_of)
def test_every_choice_of_cfg_is_known_everywhere(core, stage, parameter):
    for choice in parameter.choices:
        params = Params.from_dict({stage: {parameter.name: choice}})
        assert compiled_member(params, stage, parameter.name)[1] == choice
        # YAML must read the bare word as that string ('off' would be a boolean).
        assert yaml.safe_load(choice) == choice
    wrong = Params()
    setattr(getattr(wrong, stage), parameter.name, "no such choice")
    with pytest.raises(ValueError) as reference:
        wrong.validate()
    with pytest.raises(ValueError) as compiled:
        compiled_params(wrong)
    expected = f"{parameter.name} must be one of {', '.join(parameter.choices)}, is no such choice"
    assert str(reference.value) == str(compiled.value) == expected


def partner_changes(name, value):
    """What must change with a parameter so that it alone is judged at its limit."""
    return {
        "min_neighbors": {"max_neighbors": 0},
        "max_neighbors": {"min_neighbors": 0},
        "min_cluster_size": {"max_cluster_size": 0},
        "segment_angle_deg": {"horizontal_resolution_deg": min(0.4, value)},
        "min_ground_angle_deg": {"max_ground_angle_deg": value + 1.0},
        "max_ground_angle_deg": {"min_ground_angle_deg": value - 1.0},
        "min_wall_angle_deg": {"max_wall_angle_deg": min(180.0, value + 1.0)},
        "max_wall_angle_deg": {"min_wall_angle_deg": value - 1.0},
    }.get(name, {})


@pytest.mark.parametrize("edge", ["minimum", "maximum"])
@pytest.mark.parametrize(("stage", "parameter"), NUMBERS, ids=name_of)
def test_the_limits_of_cfg_are_accepted(core, stage, parameter, edge):
    value = type(parameter.default)(getattr(parameter, edge))
    params = Params()
    group = getattr(params, stage)
    setattr(group, parameter.name, value)
    for name, partner in partner_changes(parameter.name, value).items():
        setattr(group, name, partner)
    params.validate()
    compiled_member(params, stage, parameter.name)[0].validate()


BAD_VALUES = [
    ("denoiser", {"intensity_threshold": -1.0}),
    ("denoiser", {"alpha": 0.0}),
    ("denoiser", {"alpha": math.inf}),
    ("denoiser", {"theta_deg": math.nan}),
    ("denoiser", {"min_neighbors": -1}),
    ("denoiser", {"max_neighbors": -1}),
    ("denoiser", {"max_neighbors": 100}),
    ("segmenter", {"column_width_deg": 0.37}),
    ("segmenter", {"min_ground_angle_deg": 4.0}),
    ("segmenter", {"min_ground_angle_deg": -200.0}),
    ("segmenter", {"max_wall_angle_deg": 200.0}),
    ("segmenter", {"min_ground_angle_deg": -90.0, "max_ground_angle_deg": 90.0}),
    ("segmenter", {"max_ground_step_height": -0.1}),
    ("segmenter", {"max_wall_step_height": math.nan}),
    ("segmenter", {"min_range_step": -0.01}),
    ("segmenter", {"relative_distance_margin": 0.0}),
    ("segmenter", {"cluster_tolerance": 0.0}),
    ("segmenter", {"cluster_tolerance_per_range": -0.1}),
    ("segmenter", {"min_cluster_size": 0}),
    ("segmenter", {"max_cluster_size": -1}),
    ("segmenter", {"max_cluster_size": 49}),
    ("reconstructor", {"sensor_height": 0.0}),
    ("reconstructor", {"occupancy_resolution": 0.001}),
    ("reconstructor", {"segment_angle_deg": 7.0}),
    ("reconstructor", {"horizontal_resolution_deg": 0.0}),
    ("reconstructor", {"horizontal_resolution_deg": 10.5}),
    ("reconstructor", {"reconstruction_gain": -0.1}),
    ("reconstructor", {"min_wall_points": 0}),
    ("reconstructor", {"height_difference_threshold": -1.0}),
    ("reconstructor", {"max_elevation_angle_deg": 90.0}),
    ("reconstructor", {"max_floor_tilt_deg": 0}),
    ("reconstructor", {"max_height_deviation": 0.6}),
    ("reconstructor", {"floor_tolerance": 0.3}),
    ("reconstructor", {"max_slope": 0.6}),
    ("reconstructor", {"max_step_height": 0.6}),
    ("reconstructor", {"drop_depth": 0.6}),
    ("reconstructor", {"smoke_gate": 20.1}),
    ("reconstructor", {"min_wall_height": 2.1}),
    ("reconstructor", {"furniture_height": 12.1}),
    ("reconstructor", {"max_bridge_ratio": 10.1}),
    ("reconstructor", {"max_range": 50.1}),
    ("reconstructor", {"cell_size": 0.6}),
]


@pytest.mark.parametrize(("stage", "values"), BAD_VALUES)
def test_bad_values_are_refused_in_the_same_words(core, stage, values):
    with pytest.raises(ValueError) as reference:
        Params.from_dict({stage: values})
    message = str(reference.value)
    assert message.split()[0] in values
    assert "\n" not in message
    params = Params()
    for name, value in values.items():
        setattr(getattr(params, stage), name, value)
    with pytest.raises(ValueError) as compiled:
        compiled_member(params, stage, message.split()[0])[0].validate()
    assert str(compiled.value) == message


WRONG_TYPES = [
    ({"denoiser": {"alpha": "0.5"}}, "alpha must be a finite number, is 0.5"),
    ({"denoiser": {"alpha": True}}, "alpha must be a finite number, is True"),
    ({"denoiser": {"min_neighbors": 2.5}}, "min_neighbors must be a whole number"),
    ({"denoiser": {"max_neighbors": 2**31}}, "max_neighbors must be a whole number"),
    ({"segmenter": {"wall_range_step": False}}, "wall_range_step must be one of"),
    ({"segmenter": {"wall_relative_margin": 1}}, "wall_relative_margin must be true or false"),
    ({"denoiser": {"alpah": 1.0}}, "unknown parameter of denoiser: alpah"),
    ({"denoisr": {}}, "unknown group: denoisr"),
    ({"denoiser": [1]}, "expected a mapping"),
    ([1], "expected a mapping"),
]


@pytest.mark.parametrize(("values", "message"), WRONG_TYPES)
def test_from_dict_names_what_is_wrong(values, message):
    with pytest.raises(ValueError) as error:
        Params.from_dict(values)
    assert str(error.value).startswith(message)


def test_whole_numbers_serve_as_floats_and_gaps_as_defaults():
    params = Params.from_dict({"denoiser": {"alpha": 1}, "segmenter": None})
    assert params.denoiser.alpha == 1.0
    assert isinstance(params.denoiser.alpha, float)
    assert params.segmenter == Params().segmenter


def test_yaml_round_trip(tmp_path):
    params = Params.from_dict({"denoiser": {"alpha": 0.7, "engine": "kdtree"}})
    params.to_yaml(tmp_path / "params.yaml")
    assert Params.from_yaml(tmp_path / "params.yaml") == params


def test_an_empty_file_is_the_defaults(tmp_path):
    (tmp_path / "empty.yaml").write_text("")
    assert Params.from_yaml(tmp_path / "empty.yaml") == Params()


@pytest.mark.parametrize("text", ["denoiser: {alpha: -1}", "a: [", "!!python/object:os.x {}"])
def test_a_bad_file_is_named_in_one_line(tmp_path, text):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(ValueError) as error:
        Params.from_yaml(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_the_launch_file_loads_the_defaults():
    assert Params.from_yaml(ROOT / "config" / "parameters.yaml") == Params()


def test_readme_shows_the_parameters_of_cfg():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert tables.with_tables(readme) == readme, "run scripts/generate_parameter_tables"


def test_a_stale_readme_is_noticed():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    stale = readme.replace("| `alpha` | `0.5`", "| `alpha` | `0.6`")
    assert stale != readme
    assert tables.with_tables(stale) == readme


@pytest.mark.parametrize(("stage", "parameter"), PARAMETERS, ids=name_of)
def test_every_parameter_tells_its_unit_and_source(stage, parameter):
    told = tables.TEXT.fullmatch(parameter.text)
    assert told is not None
    if parameter.name.endswith("_deg"):
        assert told["unit"] == "deg"
