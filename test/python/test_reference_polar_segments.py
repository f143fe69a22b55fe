"""Reconstruction against segments worked out by hand. Thesis: Eq. 3.1, Algorithms 3 and 5."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rooms import joined, tilt, view_of
from smoke_ground_reconstruction.params import PolarSegmentsParams
from smoke_ground_reconstruction.reference.floor_surface import BoundaryKind, Provenance
from smoke_ground_reconstruction.reference.polar_segments import PolarSegments
from smoke_ground_reconstruction.reference.scan import Mounting, Scan
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

DEFAULT = PolarSegmentsParams()
LEVEL = Mounting(sensor_height=0.70)
SENSOR = SensorModel.from_elevations(np.linspace(-45.0, 0.0, 10))  # ring i has rank i
NOTHING = view_of([])


def polar(azimuth_deg, r, z):
    return r * math.cos(math.radians(azimuth_deg)), r * math.sin(math.radians(azimuth_deg)), z


def wall(segment=0, count=10, r=2.0, z=-0.70, ring=4):
    """Wall points in the middle of a 10 deg segment, at a planar distance."""
    return view_of([polar(10.0 * segment + 5.0, r, z)] * count, 60.0, ring)


def ground(segment=0, count=1, r=1.0):
    return view_of([polar(10.0 * segment + 5.0, r, -0.70)] * count, 20.0, 2)


def segments_of(walls, floor=NOTHING, params=DEFAULT, sensor=SENSOR, mounting=LEVEL):
    method = PolarSegments(params)
    return method.segments(Scan(floor, mounting), Scan(walls, mounting), sensor, mounting)


def reconstruct(walls, floor=NOTHING, params=DEFAULT, sensor=SENSOR, mounting=LEVEL):
    return PolarSegments(params).reconstruct(floor, walls, sensor, mounting)


# --- Step 1: minima -------------------------------------------------------------------------------


def test_minima_are_independent_of_each_other():
    low = wall(z=-0.65, r=3.0, ring=6, count=4)
    of_low_ring = wall(z=-0.30, r=2.5, ring=3, count=4)
    near = wall(z=0.0, r=2.0, ring=9, count=4)
    segment = segments_of(joined(low, of_low_ring, near))[0]
    assert segment.wall_points == 12
    assert segment.lowest_z == np.float32(-0.65)
    assert segment.rings_below_wall == 3
    assert segment.min_distance == pytest.approx(2.0)


def test_rings_below_the_wall_are_counted_in_elevation_order():
    """Ouster numbers its rings from the top: the wall's ring 9 is then the lowest beam."""
    from_the_top = SensorModel.from_elevations(np.linspace(0.0, -45.0, 10))
    walls = joined(wall(ring=9, count=5), wall(ring=4, count=5))
    assert segments_of(walls, sensor=from_the_top)[0].rings_below_wall == 0
    assert segments_of(walls)[0].rings_below_wall == 4


def test_segments_are_half_open_in_azimuth():
    # The edge of 90 deg is exact in floats.
    on_edge = view_of([(0.0, 2.0, 0.0)] * 10, ring=4)
    grid = segments_of(on_edge)
    assert (grid[8].wall_points, grid[9].wall_points) == (0, 10)
    on_first_edge = view_of([(2.0, 0.0, 0.0)] * 10, ring=4)
    assert segments_of(on_first_edge)[0].wall_points == 10


@pytest.mark.parametrize(("distance", "expected"), [("range", 5.0), ("planar_range", 4.0)])
def test_distance_is_the_range_as_printed_or_planar(distance, expected):
    walls = view_of([polar(5.0, 4.0, -3.0)] * 10, ring=4)
    segment = segments_of(walls, params=replace(DEFAULT, wall_distance=distance))[0]
    assert segment.min_distance == pytest.approx(expected)


# --- Step 2: Eq. 3.1 ------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "keeps"), [(0, False), (15, False), (16, True)])
def test_strictly_more_ground_than_expected_keeps_it(count, keeps):
    """4 rings below the wall * 10 deg / 0.4 deg * 0.15 = 15 points."""
    assert segments_of(wall(ring=4), ground(count=count))[0].keeps_measured is keeps


def test_ground_of_another_segment_does_not_count():
    grid = segments_of(wall(ring=4), ground(segment=1, count=100))
    assert not grid[0].keeps_measured


def test_the_gain_enters_once():
    params = replace(DEFAULT, reconstruction_gain=0.5)  # 50 points
    assert not segments_of(wall(), ground(count=50), params)[0].keeps_measured
    assert segments_of(wall(), ground(count=51), params)[0].keeps_measured


@pytest.mark.parametrize(("count", "has_wall"), [(9, False), (10, True)])
def test_fewer_than_ten_wall_points_are_no_wall(count, has_wall):
    grid = segments_of(wall(count=count))
    assert grid[0].has_wall is has_wall
    assert grid[0].keeps_measured is not has_wall


def test_without_a_wall_the_ground_stays_and_nothing_is_reconstructed():
    floor = ground(count=3)
    surface = reconstruct(wall(count=9), floor)
    np.testing.assert_array_equal(surface.xyz, floor.xyz)
    assert surface.provenance.tolist() == [Provenance.MEASURED] * 3


def test_too_little_ground_is_dropped_and_replaced():
    surface = reconstruct(wall(ring=4), ground(count=15))
    assert set(surface.provenance) == {Provenance.RECONSTRUCTED}


# --- Step 3: heights ------------------------------------------------------------------------------


def heights_of(by_segment, params=DEFAULT, r=10.0):
    """adjusted_z by segment; 10 m away the slope limit of 5 deg allows 0.875 m."""
    walls = joined(*(wall(segment, z=z, r=r) for segment, z in by_segment.items()))
    grid = segments_of(walls, params=params)
    return {segment: grid[segment].adjusted_z for segment in by_segment}


def test_a_foot_higher_than_the_lower_neighbor_takes_its_height():
    adjusted = heights_of({3: -0.60, 4: -0.40, 5: -0.55})
    assert adjusted[4] == pytest.approx(-0.60)
    assert adjusted[5] == pytest.approx(-0.55)  # its neighbour is higher


@pytest.mark.parametrize(("z", "expected"), [(-0.651, -0.651), (-0.649, -0.70)])
def test_the_height_difference_must_exceed_the_threshold(z, expected):
    assert heights_of({3: -0.70, 4: z})[4] == pytest.approx(expected)


def test_heights_are_compared_unadjusted():
    """Each takes its neighbour's first height, not what that neighbour was given in its turn."""
    adjusted = heights_of({3: -0.70, 4: -0.60, 5: -0.50})
    assert [adjusted[s] for s in (3, 4, 5)] == pytest.approx([-0.70, -0.70, -0.60])


def test_the_first_and_the_last_segment_are_neighbors():
    assert heights_of({35: -0.70, 0: -0.40})[0] == pytest.approx(-0.70)
    assert heights_of({0: -0.70, 35: -0.40})[35] == pytest.approx(-0.70)


def test_neighbors_without_wall_are_ignored():
    walls = joined(wall(4, z=-0.40, r=10.0), wall(5, z=-0.70, r=10.0, count=9))
    assert segments_of(walls)[4].adjusted_z == pytest.approx(-0.40)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_floor_steeper_than_five_degrees_goes_to_the_sensor_s_floor(sign):
    """tan 5 deg * 10 m = 0.8749 m above or below the floor at -0.70 m."""
    params = replace(DEFAULT, wall_distance="planar_range")
    gentle, steep = -0.70 + sign * 0.874, -0.70 + sign * 0.876
    assert heights_of({4: gentle}, params)[4] == pytest.approx(gentle)
    assert heights_of({4: steep}, params)[4] == -0.70


def test_the_slope_is_judged_after_the_neighbor_s_height_is_taken():
    assert heights_of({3: -0.60, 4: 1.5})[4] == pytest.approx(-0.60)


def test_origin_z_is_minus_the_sensor_s_height():
    grid = segments_of(wall(4, z=1.5), mounting=Mounting(sensor_height=0.45))
    assert grid[4].adjusted_z == -0.45


def test_a_segment_that_keeps_its_ground_is_not_adjusted():
    walls = joined(wall(3, z=-0.70), wall(4, z=-0.20))
    grid = segments_of(walls, ground(segment=4, count=16))
    assert grid[4].adjusted_z == pytest.approx(-0.20)


# --- Step 4: Algorithm 3 --------------------------------------------------------------------------


def test_rings_are_drawn_from_the_sensor_s_foot_to_the_wall():
    params = replace(DEFAULT, wall_distance="planar_range")
    surface = reconstruct(wall(2, r=3.0, z=-0.64, ring=4), params=params)
    radii = np.hypot(surface.xyz[:, 0], surface.xyz[:, 1])
    azimuths = np.degrees(np.arctan2(surface.xyz[:, 1], surface.xyz[:, 0]))
    # 4 rings lie below the wall: radii 0, 1, 2 and 3 m, heights from -0.70 to -0.64 m.
    assert len(radii) == 1 + 3 * 26
    assert surface.xyz[0] == pytest.approx([0.0, 0.0, -0.70])
    np.testing.assert_allclose(radii[1:], np.repeat([1.0, 2.0, 3.0], 26), rtol=1e-6)
    np.testing.assert_allclose(surface.xyz[1:, 2], np.repeat([-0.68, -0.66, -0.64], 26), rtol=1e-6)
    np.testing.assert_allclose(azimuths[1:], np.tile(20.0 + 0.4 * np.arange(26), 3), atol=1e-4)
    assert surface.ring.tolist() == [0] + [1] * 26 + [2] * 26 + [3] * 26
    assert np.all(surface.intensity == 0.0)


def test_point_j_carries_the_jth_ring_from_below():
    from_the_top = SensorModel.from_elevations(np.linspace(0.0, -45.0, 10))
    surface = reconstruct(wall(ring=6), sensor=from_the_top)  # ring 6 has rank 3
    assert list(dict.fromkeys(surface.ring.tolist())) == [9, 8, 7]


@pytest.mark.parametrize(("ring", "points"), [(0, 0), (1, 1), (2, 27)])
def test_few_rings_below_the_wall(ring, points):
    """No ring: nothing to draw. One ring: its radius is 0."""
    assert len(reconstruct(wall(ring=ring))) == points


def test_both_ends_of_a_segment_are_drawn_where_the_step_does_not_divide_it():
    surface = reconstruct(wall(ring=2), params=replace(DEFAULT, horizontal_resolution_deg=3.0))
    azimuths = np.degrees(np.arctan2(surface.xyz[1:, 1], surface.xyz[1:, 0]))
    np.testing.assert_allclose(azimuths, [0.0, 3.0, 6.0, 9.0, 10.0], atol=1e-4)


def test_measured_points_come_first_then_segments_in_order():
    floor = joined(ground(30, count=50), ground(7, count=50))
    walls = joined(wall(12), wall(7), wall(2))
    surface = reconstruct(walls, floor)
    measured = surface.provenance == Provenance.MEASURED
    assert measured.tolist() == [True] * 100 + [False] * 158
    np.testing.assert_array_equal(surface.xyz[:100], floor.xyz)
    np.testing.assert_array_equal(surface.intensity[:100], floor.intensity)
    azimuths = np.degrees(np.arctan2(surface.xyz[100:, 1], surface.xyz[100:, 0]))
    assert np.all(azimuths[1:79] < 31.0)
    assert np.all(azimuths[80:] > 119.0)


def test_confidence_is_the_share_of_azimuth_steps_with_a_wall_point():
    azimuths = 0.2 + 0.4 * np.arange(10)  # 10 of the 25 steps
    walls = view_of([polar(azimuth, 2.0, -0.7) for azimuth in azimuths], ring=4)
    surface = reconstruct(walls, joined(ground(9, count=2)))
    assert surface.confidence[:2].tolist() == [1.0, 1.0]
    np.testing.assert_allclose(surface.confidence[2:], 10 / 25)


def test_a_tilted_sensor_gets_its_floor_in_its_own_frame():
    mounting = Mounting(tilt(3.0, -8.0), 0.70)
    level_walls = joined(*(wall(segment, r=3.0, z=-0.70) for segment in range(36)))
    walls = level_walls._replace(xyz=mounting.to_sensor(level_walls.xyz))
    surface = reconstruct(walls, mounting=mounting)
    a, b, c = surface.floor_plane
    x, y, z = surface.xyz.T.astype(float)
    np.testing.assert_allclose(z, a * x + b * y + c, atol=1e-5)
    np.testing.assert_allclose(mounting.to_level(surface.xyz)[:, 2], -0.70, atol=1e-5)


# --- The outline ----------------------------------------------------------------------------------


def test_the_outline_of_a_round_room():
    params = replace(DEFAULT, wall_distance="planar_range")
    walls = joined(*(wall(segment, r=3.0, z=-0.70) for segment in range(36)))
    surface = reconstruct(walls, params=params)
    x, y, z = surface.boundary.T
    assert len(x) == 72  # both ends of 36 segments
    np.testing.assert_allclose(np.hypot(x, y), 3.0, rtol=1e-6)
    np.testing.assert_allclose(z, -0.70, rtol=1e-6)
    assert set(surface.boundary_kind) == {BoundaryKind.WALL_SEEN}
    # Counter-clockwise: the area of the 36-gon by the shoelace formula is positive.
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert area == pytest.approx(36 * 0.5 * 9.0 * math.sin(math.radians(10.0)), rel=1e-5)


def test_the_outline_ends_at_the_foot_where_nothing_is_known():
    surface = reconstruct(wall(4, r=3.0), params=replace(DEFAULT, wall_distance="planar_range"))
    radii = np.hypot(surface.boundary[:, 0], surface.boundary[:, 1])
    np.testing.assert_allclose(radii, [0.0, 3.0, 3.0, 0.0], rtol=1e-6)
    limit, seen = BoundaryKind.LIMIT_OF_KNOWLEDGE, BoundaryKind.WALL_SEEN
    assert surface.boundary_kind.tolist() == [limit, seen, seen, limit]


@pytest.mark.parametrize(
    ("farthest", "kind"),
    [(2.9, BoundaryKind.WALL_SEEN), (2.5, BoundaryKind.LIMIT_OF_KNOWLEDGE)],
)
def test_measured_floor_ends_at_the_wall_or_where_it_was_last_seen(farthest, kind):
    params = replace(DEFAULT, wall_distance="planar_range")
    floor = joined(ground(4, count=20, r=1.0), ground(4, count=1, r=farthest))
    surface = reconstruct(wall(4, r=3.0), floor, params)
    reaches = np.hypot(surface.boundary[:, 0], surface.boundary[:, 1])
    assert reaches.max() == pytest.approx(farthest)
    assert surface.boundary_kind[reaches > 0.0].tolist() == [kind] * 2


def test_no_floor_no_outline():
    surface = reconstruct(NOTHING)
    assert len(surface) == 0
    assert surface.boundary.shape == (0, 3)
    assert surface.floor_plane == pytest.approx([0.0, 0.0, -0.70])


def test_walls_that_cannot_be_ranked_or_are_no_returns_are_left_out():
    strange = joined(wall(ring=200), view_of([(np.nan, 1, 1), (0, 0, 0)] * 10, ring=4))
    assert segments_of(strange)[0].wall_points == 0
