"""Layout of a scan: bins, ring order and rings from elevation are the same in both engines."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rooms import read_scan, seeded_cloud, view_of
from smoke_ground_reconstruction.reference.azimuth_bins import AzimuthBins
from smoke_ground_reconstruction.reference.sensor_model import SensorModel, rings_from_elevation

WIDTHS_DEG = [0.01, 0.2, 0.4, 1.0, 7.5, 10.0, 90.0]
FINITE = st.floats(-1e6, 1e6, width=32)
POINTS = st.lists(st.tuples(FINITE, FINITE), max_size=50)


def assert_same_bins(core, width_deg, x, y):
    compiled = core.AzimuthBins(width_deg)
    expected = AzimuthBins(width_deg).index(x, y)
    actual = [compiled.index(u, v) for u, v in zip(x.tolist(), y.tolist())]
    np.testing.assert_array_equal(actual, expected)


def assert_same_order(compiled, reference):
    expected = reference.rings_by_elevation()
    np.testing.assert_array_equal(compiled.rings_by_elevation, expected)
    rings = np.array([0, 1, 5, 127, 4000, 65535])
    assert [compiled.rank(ring) for ring in rings] == reference.rank(rings).tolist()
    tangents = [compiled.tangent(ring) for ring in expected]
    np.testing.assert_array_equal(tangents, reference.tangent(expected))


@pytest.mark.parametrize("width_deg", WIDTHS_DEG)
def test_bins_of_points_on_and_beside_the_edges(core, width_deg):
    edges = np.radians(width_deg * np.arange(min(400, round(360 / width_deg))))
    angles = np.concatenate([edges, edges + 1e-7, edges - 1e-7, edges + 1e-9])
    x, y = 3.0 * np.cos(angles), 3.0 * np.sin(angles)
    assert_same_bins(core, width_deg, x.astype(np.float32), y.astype(np.float32))


@settings(deadline=None)
@given(points=POINTS, width=st.sampled_from(WIDTHS_DEG[1:]))
def test_bins_of_any_point(core, points, width):
    x, y = np.array(points, np.float32).reshape(-1, 2).T
    assert_same_bins(core, width, x, y)


@pytest.mark.parametrize("width_deg", [0.0, -10.0, 7.0, 0.37, 180.0, 0.001, np.nan, np.inf])
def test_both_refuse_a_width_that_does_not_divide_the_circle(core, width_deg):
    with pytest.raises(ValueError) as compiled:
        core.AzimuthBins(width_deg)
    with pytest.raises(ValueError) as reference:
        AzimuthBins(width_deg)
    assert str(compiled.value) == str(reference.value)


@pytest.mark.parametrize("seed", range(6))
def test_rings_learned_over_several_scans(core, seed):
    compiled, reference = core.SensorModel(), SensorModel()
    for step in range(3):
        cloud = seeded_cloud(seed + step)
        view = cloud.select(slice(0, None, 1 + step))
        compiled.observe(view.xyz, view.ring)
        reference.observe(view)
        assert_same_order(compiled, reference)


def test_rings_of_real_scans(core, real_scan):
    view = read_scan(real_scan)
    compiled, reference = core.SensorModel(), SensorModel()
    compiled.observe(view.xyz, view.ring)
    reference.observe(view)
    assert_same_order(compiled, reference)


def test_known_beams_stay_and_unknown_rings_join(core):
    elevations = [10.0, -20.0, -20.0, 0.0]
    compiled = core.SensorModel.from_elevations(elevations)
    reference = SensorModel.from_elevations(elevations)
    assert_same_order(compiled, reference)
    view = view_of([(1, 0, 1)] * 50 + [(1, 0, -0.1)], ring=[1] * 50 + [6])
    compiled.observe(view.xyz, view.ring)
    reference.observe(view)
    assert_same_order(compiled, reference)
    assert reference.rings_by_elevation().tolist() == [1, 2, 6, 3, 0]


@pytest.mark.parametrize("seed", range(4))
def test_rings_from_elevation(core, seed):
    xyz = seeded_cloud(seed).xyz
    np.testing.assert_array_equal(core.rings_from_elevation(xyz), rings_from_elevation(xyz))


def test_rings_from_elevation_of_real_scans(core, real_scan):
    xyz = read_scan(real_scan).xyz
    np.testing.assert_array_equal(core.rings_from_elevation(xyz), rings_from_elevation(xyz))
