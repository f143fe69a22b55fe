"""The whole pipeline: the compiled core and the reference give the same floor."""

import copy
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smoke_ground_reconstruction
from parity import as_partition, assert_same_grid
from rooms import (
    SENSOR_HEIGHT,
    box_room,
    joined,
    read_scan,
    seeded_cloud,
    smoke_ball,
    tilt,
    view_of,
)
from smoke_ground_reconstruction import Params, Pipeline
from smoke_ground_reconstruction.params import RECONSTRUCTION_METHODS

NOISE, GROUND = 2, 3


def assert_same_result(actual, expected):
    close = {"rtol": 1e-5, "atol": 1e-5}
    np.testing.assert_array_equal(actual.labels, expected.labels)
    np.testing.assert_array_equal(as_partition(actual.clusters), as_partition(expected.clusters))
    for name in ("surface", "confidence", "boundary", "floor_plane"):
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), **close)
    for name in ("intensity", "ring", "provenance", "boundary_kind"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name))
    for name in ("surface", "intensity", "ring", "provenance", "confidence", "boundary_kind"):
        assert getattr(actual, name).dtype == getattr(expected, name).dtype
    assert_same_grid(actual.occupancy, expected.occupancy)
    for name in ("extinction", "extinction_sigma"):
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), rtol=1e-6)
    assert list(actual.times) == list(expected.times)


def assert_parity(view, params=None, **mounting):
    results = [Pipeline(params, engine).process(*view, **mounting) for engine in ("cpp", "python")]
    assert_same_result(*results)
    return results[0]


def room_params():
    """All stages of the thesis, with wall clusters of the coarse test rooms."""
    return Params.from_dict({
        "segmenter": {"cluster_tolerance": 0.2, "max_cluster_size": 0},
        "reconstructor": {"method": "polar_segments"},
    })  # fmt: skip


@pytest.mark.parametrize("method", RECONSTRUCTION_METHODS)
@pytest.mark.parametrize("seed", range(10))
def test_seeded_rooms(core, seed, method):
    params = room_params()
    params.reconstructor.method = method
    result = assert_parity(seeded_cloud(seed), params)
    assert len(result.surface) > 0


@pytest.mark.parametrize("engine", ["window", "kdtree"])
def test_either_engine_of_the_denoiser(core, engine):
    if engine == "kdtree" and not core.HAVE_PCL:
        pytest.skip("built without PCL")
    params = room_params()
    params.denoiser.engine = engine
    assert_parity(seeded_cloud(11), params)


def test_tilted_sensor(core):
    assert_parity(seeded_cloud(3), room_params(), rotation=tilt(2.0, -6.0), sensor_height=0.6)


def test_rings_are_learned_from_scan_to_scan(core):
    pipelines = [Pipeline(room_params(), engine) for engine in ("cpp", "python")]
    for seed in (0, 3):
        assert_same_result(*(pipeline.process(*seeded_cloud(seed)) for pipeline in pipelines))


def test_known_beams(core):
    elevations = np.linspace(-52.0, 20.0, 40)
    pipelines = [Pipeline(room_params(), engine, elevations) for engine in ("cpp", "python")]
    assert_same_result(*(pipeline.process(*seeded_cloud(0)) for pipeline in pipelines))


@pytest.mark.parametrize("method", RECONSTRUCTION_METHODS)
def test_real_scans(core, every_real_scan, method):
    params = Params.from_dict({"reconstructor": {"method": method}})
    result = assert_parity(read_scan(every_real_scan), params)
    assert len(result.surface) > 0


# A lattice of dim points, some exactly at the denoiser's radius of others; few, odd rings.
COORDINATE = st.one_of(
    st.integers(-4, 4).map(lambda i: i * 0.25),
    st.sampled_from([np.nan, np.inf, -0.0, 1e-30, 1e6, 1e20]),
)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE, st.sampled_from([0, 1, 2, 7, 65535]))


@settings(max_examples=150, deadline=None)
@given(
    points=st.lists(POINT, max_size=50),
    angles_deg=st.sampled_from([(0.0, 0.0), (3.0, -11.0), (90.0, 0.0)]),
    method=st.sampled_from(RECONSTRUCTION_METHODS),
)
def test_odd_clouds(core, points, angles_deg, method):
    table = np.array(points, np.float64).reshape(-1, 4)
    params = Params.from_dict({
        "denoiser": {"alpha": 0.5, "theta_deg": 1.0, "min_neighbors": 2},
        "segmenter": {"column_width_deg": 10.0, "cluster_tolerance": 0.6, "min_cluster_size": 1},
        "reconstructor": {"min_wall_points": 1, "method": method},
    })  # fmt: skip
    view = view_of(table[:, :3], intensity=0.0, ring=table[:, 3])
    assert_parity(view, params, rotation=tilt(*angles_deg))


@pytest.mark.parametrize("engine", ["cpp", "python"])
def test_the_denoiser_works_in_the_sensor_s_frame(core, engine):
    """As its nodelet does. Radius 0.5 r: 2 m away the neighbours 1 m off are at it, so none counts;
    levelled, rounding would move some of them inside."""
    axis = np.arange(-4.0, 5.0)
    lattice = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    params = room_params()
    params.denoiser.theta_deg, params.denoiser.min_neighbors = 1.0, 0
    view = view_of(lattice, intensity=0.0)
    result = Pipeline(params, engine).process(*view, rotation=tilt(3.0, -11.0))
    at_two_metres = np.linalg.norm(lattice, axis=1) == 2.0
    assert np.count_nonzero(at_two_metres) == 6
    assert set(result.labels[at_two_metres]) == {NOISE}


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_points(core, count):
    result = assert_parity(seeded_cloud(0).select(slice(0, count)))
    assert len(result.labels) == count


def test_one_ring(core):
    view = seeded_cloud(0)
    result = assert_parity(view.select(view.ring == 7), room_params())  # no pair, no wall
    assert len(result.surface) == 0


@pytest.mark.parametrize("engine", ["cpp", "python"])
def test_the_floor_comes_out_without_one_ground_return(core, engine):
    """The thesis's claim: walls alone tell where the floor is."""
    room, surface = box_room((3.0, 2.5, -3.0, -2.5), azimuth_step_deg=0.4)
    smoke = smoke_ball(1500, 0)
    dim = smoke._replace(intensity=smoke.intensity / 2)  # all below the denoiser's threshold
    view = joined(room.select(surface != 0), dim)
    params = room_params()
    params.segmenter.min_cluster_size = 10
    result = Pipeline(params, engine).process(*view)
    assert not np.any(result.labels == GROUND)
    assert np.all(result.provenance == 1)
    x, y, z = result.surface.T
    # 10 deg segments, each up to its nearest wall: most of the room, and nothing outside of it
    # but by half an azimuth step (3.9 m * 0.2 deg).
    assert np.all((np.abs(x) <= 3.0 + 0.015) & (np.abs(y) <= 2.5 + 0.015))
    cells = {(i, j) for i, j in zip(np.floor(x / 0.2).astype(int), np.floor(y / 0.2).astype(int))}
    assert len(cells) > 0.75 * (6.0 / 0.2) * (5.0 / 0.2)
    # A wall's lowest return is up to a beam's spacing above the floor; Step 3 bounds the slope.
    steepest = np.tan(np.radians(5.0)) * np.hypot(3.0, 2.5)
    assert np.all((z >= -SENSOR_HEIGHT - 1e-3) & (z <= -SENSOR_HEIGHT + steepest))


def test_inputs_are_not_changed(core):
    view = seeded_cloud(0)
    before = copy.deepcopy(view)
    assert_parity(view)
    for array, copied in zip(view, before):
        np.testing.assert_array_equal(array, copied)


def test_friendly_dtypes(core):
    view = seeded_cloud(0)
    friendly = (view.xyz.astype(np.float64), view.intensity, view.ring.astype(np.int64))
    for engine in ("cpp", "python"):
        assert_same_result(Pipeline(None, engine).process(*friendly), assert_parity(view))


BAD_INPUTS = {
    "xyz must be": lambda v: (v.xyz[:, :2], v.intensity, v.ring),
    "xyz must be (N, 3)": lambda v: (np.zeros(v.xyz.shape, int), v.intensity, v.ring),
    "intensity must be": lambda v: (v.xyz, v.intensity[:-1], v.ring),
    "intensity must be (": lambda v: (v.xyz, v.intensity[:, None], v.ring),
    "ring must be (": lambda v: (v.xyz, v.intensity, v.ring.astype(float)),
    "ring must be from 0 to 65535": lambda v: (v.xyz, v.intensity, v.ring.astype(int) - 1),
}


@pytest.mark.parametrize("engine", ["cpp", "python"])
@pytest.mark.parametrize("message", BAD_INPUTS)
def test_bad_arrays_are_named(core, message, engine):
    with pytest.raises(ValueError) as error:
        Pipeline(None, engine).process(*BAD_INPUTS[message](seeded_cloud(0)))
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(
    "mounting",
    [
        {"sensor_height": 0.0},
        {"sensor_height": np.nan},
        {"rotation": np.zeros((3, 3))},
        {"rotation": np.diag([1.0, 1.0, -1.0])},
        {"rotation": np.eye(2)},
    ],
)
def test_bad_mountings_are_named(core, mounting):
    with pytest.raises(ValueError, match=next(iter(mounting))):
        Pipeline().process(*seeded_cloud(0), **mounting)


def test_the_reference_works_without_the_compiled_module():
    program = (
        "import sys, numpy\n"
        "sys.modules['smoke_ground_reconstruction._core'] = None\n"  # importing it fails
        "from smoke_ground_reconstruction import Params, Pipeline\n"
        "params = Params.from_dict({'reconstructor': {'method': 'polar_segments'}})\n"
        "xyz = numpy.array([[2.0, 0.0, -0.7], [2.3, 0.0, -0.7]])\n"
        "pipeline = Pipeline(params, engine='python')\n"
        "result = pipeline.process(xyz, numpy.full(2, 50.0), numpy.arange(2))\n"
        "assert result.labels.tolist() == [3, 1]\n"
    )
    source = str(Path(smoke_ground_reconstruction.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": source}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


def test_unknown_engine_is_refused():
    with pytest.raises(ValueError, match="engine must be one of cpp, python, is rust"):
        Pipeline(engine="rust")
