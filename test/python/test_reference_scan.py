"""Levelling, columns and the order of rings."""

import numpy as np
import pytest

from rooms import box_room, joined, tilt, view_of
from smoke_ground_reconstruction.reference.azimuth_bins import AzimuthBins
from smoke_ground_reconstruction.reference.scan import Mounting, Scan, ScanColumns
from smoke_ground_reconstruction.reference.sensor_model import SensorModel, rings_from_elevation


def test_a_level_mounting_changes_nothing():
    view = view_of([(1, 2, 3), (np.nan, 0, 0)])
    assert Scan(view).xyz is view.xyz


def test_a_pitched_sensor_is_levelled():
    # Nose 90 deg down: the sensor's +x looks at the floor.
    mounting = Mounting(tilt(0.0, 90.0))
    np.testing.assert_allclose(Scan(view_of([(2, 0, 0)]), mounting).xyz, [[0, 0, -2]], atol=1e-6)
    np.testing.assert_allclose(mounting.to_sensor(np.float32([[0, 0, -2]])), [[2, 0, 0]], atol=1e-6)


def test_levelling_and_back_is_the_identity():
    xyz = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    mounting = Mounting(tilt(11.0, -7.0))
    np.testing.assert_allclose(mounting.to_sensor(mounting.to_level(xyz)), xyz, atol=1e-6)


def test_validity_is_judged_in_the_sensor_frame():
    view = view_of([(0, 0, 0), (1, 0, 0), (np.inf, 0, 0)])
    scan = Scan(view, Mounting(tilt(5.0, 5.0)))
    assert scan.valid.tolist() == [False, True, False]


def test_columns_go_from_the_lowest_ring_up():
    sensor = SensorModel.from_elevations([30.0, -30.0, 0.0])
    view = view_of(
        [(1, 0.1, 0.5), (-1, 0.1, 0.5), (1, 0.1, -0.5), (1, 0.1, 0), (1, 0.1, -0.6), (1, 0.1, 0)],
        ring=[0, 0, 1, 2, 1, 9],
    )
    use = np.array([True, True, True, True, True, True])
    columns = ScanColumns(Scan(view), use, AzimuthBins(90.0), sensor)
    assert columns.order.tolist() == [2, 4, 3, 0, 1]  # ring 9 has no rank
    assert columns.column.tolist() == [0, 0, 0, 0, 1]
    assert columns.rank.tolist() == [0, 0, 1, 2, 2]


def test_columns_leave_out_unused_and_invalid_points():
    sensor = SensorModel.from_elevations([0.0])
    view = view_of([(1, 0, 0), (2, 0, 0), (np.nan, 0, 0)])
    columns = ScanColumns(Scan(view), np.array([False, True, True]), AzimuthBins(90.0), sensor)
    assert columns.order.tolist() == [1]


@pytest.mark.parametrize("is_reversed", [False, True])
def test_rings_are_ordered_by_measured_elevation(is_reversed):
    elevations = np.array([-40.0, -10.0, 5.0, 20.0])
    view, _ = box_room(elevations_deg=elevations[::-1] if is_reversed else elevations)
    sensor = SensorModel()
    sensor.observe(view)
    order = [3, 2, 1, 0] if is_reversed else [0, 1, 2, 3]
    assert sensor.rings_by_elevation().tolist() == order
    tangents = sensor.tangent(sensor.rings_by_elevation())
    np.testing.assert_allclose(tangents, np.tan(np.radians(elevations)), rtol=1e-5)


def test_interleaved_rings_as_of_the_qt128():
    # Ring 2 drops back below ring 1, as ring 96 does below ring 95.
    view = view_of([(1, 0, -0.5), (1, 0, 0.5), (1, 0, 0.25)], ring=[0, 1, 2])
    sensor = SensorModel()
    sensor.observe(view)
    assert sensor.rings_by_elevation().tolist() == [0, 2, 1]
    assert sensor.rank(np.array([0, 1, 2, 3])).tolist() == [0, 2, 1, SensorModel.NO_RANK]


def test_a_rings_elevation_is_the_lower_median():
    view = view_of([(1, 0, z) for z in (0.4, 0.1, 0.3, 0.2)])
    sensor = SensorModel()
    sensor.observe(view)
    assert sensor.tangent(0) == pytest.approx(0.2)


def test_a_smoky_scan_does_not_overrule_a_clear_one():
    clear = view_of([(1, 0, -0.5)] * 20 + [(1, 0, 0.5)] * 20, ring=[0] * 20 + [1] * 20)
    smoky = view_of([(1, 0, 0.9)] * 3 + [(1, 0, 0.6)] * 30, ring=[0] * 3 + [1] * 30)
    same = view_of([(1, 0, 0.9)] * 20, ring=0)
    sensor = SensorModel()
    for view in (clear, smoky, same):
        sensor.observe(view)
    assert sensor.tangent(np.array([0, 1])) == pytest.approx([-0.5, 0.6])


def test_what_tells_nothing_of_elevation():
    nothing = view_of([(0, 0, 0), (np.nan, 1, 1), (0, 0, 5), (0, 0, -1), (1, np.inf, 0)])
    sensor = SensorModel()
    sensor.observe(nothing)
    assert len(sensor.rings_by_elevation()) == 0
    assert sensor.rank(np.array([0])).tolist() == [SensorModel.NO_RANK]


def test_equal_elevations_are_ordered_by_ring_number():
    sensor = SensorModel.from_elevations([1.0, -5.0, 1.0, -5.0])
    assert sensor.rings_by_elevation().tolist() == [1, 3, 0, 2]


def beam(elevation_deg, count=5):
    azimuth = np.linspace(0.0, 6.0, count)
    height = np.full(count, np.tan(np.radians(elevation_deg)))
    return view_of(np.stack([2 * np.cos(azimuth), 2 * np.sin(azimuth), 2 * height], axis=1))


def test_rings_are_found_at_gaps_of_elevation():
    view = joined(beam(10.0), beam(-5.0), view_of([(0, 0, 0)]), beam(-5.1), beam(-4.0))
    rings = rings_from_elevation(view.xyz)
    # -5.1 and -5.0 are one ring (0.1 deg), -4.0 and 10.0 others; the zero point gets ring 0.
    assert rings.tolist() == [2] * 5 + [0] * 5 + [0] + [0] * 5 + [1] * 5


def test_rings_that_run_together_become_steps():
    view = joined(*(beam(elevation, 1) for elevation in np.arange(-3.0, 3.01, 0.1)))
    rings = rings_from_elevation(view.xyz)  # 6 deg without a gap
    elevation = np.arange(-3.0, 3.01, 0.1) + 3.0
    away_from_edges = np.abs(elevation / 0.5 - np.round(elevation / 0.5)) > 0.01
    expected = np.floor(elevation / 0.5)
    np.testing.assert_array_equal(rings[away_from_edges], expected[away_from_edges])
