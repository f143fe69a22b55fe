"""room_boundary on rooms whose floor, walls and holes are known by geometry."""

import math
from dataclasses import replace

import numpy as np
import pytest

import rooms
from smoke_ground_reconstruction.params import Params
from smoke_ground_reconstruction.pipeline import Pipeline
from smoke_ground_reconstruction.reference.drop_edges import DropTolerances
from smoke_ground_reconstruction.reference.drop_offs import DropOffs, find_drop_offs
from smoke_ground_reconstruction.reference.floor_model import FloorModel, FloorSource, fit_floor
from smoke_ground_reconstruction.reference.floor_relief import find_relief
from smoke_ground_reconstruction.reference.hidden_drops import certain_floor
from smoke_ground_reconstruction.reference.label import Label
from smoke_ground_reconstruction.reference.posts import (
    Posts,
    ceiling_height,
    on_line_for,
    spread_of_walls,
    widening_for,
)
from smoke_ground_reconstruction.reference.ramp_fit import fit_ramp
from smoke_ground_reconstruction.reference.relief_facets import Crease
from smoke_ground_reconstruction.reference.room import floor_lift
from smoke_ground_reconstruction.reference.room_boundary import COLUMN_DEG, RoomBoundary
from smoke_ground_reconstruction.reference.scan import Mounting, ScanView
from smoke_ground_reconstruction.reference.sensor_model import SensorModel
from smoke_ground_reconstruction.reference.wall_feet import WallFeet
from smoke_ground_reconstruction.reference.wall_lines import Support, View
from smoke_ground_reconstruction.reference.wall_profile import column_profile
from smoke_ground_reconstruction.reference.wall_ramps import (
    WallRamp,
    find_wall_ramp,
    places_of_feet,
)

COLUMNS = 900
SEEN, INFERRED, LIMIT = 0, 1, 2
WALLS = (3.4, 3.0, -3.4, -3.0)
ELEVATIONS_DEG = np.linspace(-52.0, 50.0, 128)
MIDDLES = np.radians((np.arange(COLUMNS) + 0.5) * COLUMN_DEG)
DIRECTIONS = np.column_stack([np.cos(MIDDLES), np.sin(MIDDLES)])


def room_scan(noise=0.0, walls=WALLS):
    """A room of 6.8 x 6 m, 2.6 m high, seen from 0.7 m."""
    return rooms.box_room(walls, 1.9, -0.7, ELEVATIONS_DEG, 0.4, range_noise=noise)[0]


def true_distance(walls=WALLS):
    """Planar range of the walls in the middle of each column."""
    east, north = np.cos(MIDDLES), np.sin(MIDDLES)
    along_x = np.where(east > 0, walls[0], walls[2]) / east
    return np.minimum(along_x, np.where(north > 0, walls[1], walls[3]) / north)


def reconstruct(view, mounting=None):
    sensor = SensorModel()
    sensor.observe(view)
    return RoomBoundary().reconstruct(view, sensor, mounting or Mounting())


def without_walls(view, from_deg, to_deg):
    """The scan with all returns above the floor of a sector gone, as behind thick smoke."""
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) % 360.0
    hidden = (azimuth >= from_deg) & (azimuth < to_deg) & (view.xyz[:, 2] > -0.69)
    return view.select(~hidden)


def columns_of(xyz):
    return (np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0])) % 360.0 / COLUMN_DEG).astype(int)


# --- the floor ---------------------------------------------------------------------------------


def low_returns(plane, count=3000, noise=0.01, seed=1):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-4.0, 4.0, (count, 2))
    z = plane[0] * xy[:, 0] + plane[1] * xy[:, 1] + plane[2]
    return np.column_stack([xy, z + noise * rng.standard_normal(count)])


def test_plane_of_a_tilted_floor_despite_wall_feet_and_a_table():
    truth = (0.05, -0.03, -0.72)
    rng = np.random.default_rng(2)
    foot = np.column_stack([np.full(800, 4.0), rng.uniform(-4, 4, 800), rng.uniform(-0.8, 1, 800)])
    table = np.column_stack([rng.uniform(1, 2, (2000, 2)), np.full(2000, 0.04)])
    found = fit_floor(np.vstack([low_returns(truth), foot, table]), 0.70)
    assert found.source == FloorSource.MEASURED
    # 3000 returns of 10 mm: 0.2 mm at their centre, 0.1 mm/m in slope; five sigma.
    np.testing.assert_allclose(found.plane[:2], truth[:2], atol=1e-3)
    assert found.plane[2] == pytest.approx(truth[2], abs=2e-3)
    assert found.height_error == pytest.approx(0.02, abs=2e-3)


def test_covariance_of_the_plane_covers_its_error():
    errors = []
    for seed in range(40):
        found = fit_floor(low_returns((0.0, 0.0, -0.7), 400, seed=seed), 0.70)
        errors.append((found.plane[2] + 0.7) / np.sqrt(found.covariance[2, 2]))
    assert 0.6 < np.std(errors) < 1.6


@pytest.mark.parametrize("noise", [0.01, 0.06])
def test_a_ranges_noise_is_told_from_the_floors_unevenness(noise):
    rng = np.random.default_rng(3)
    xyz = low_returns((0.0, 0.0, -0.7), 20000, 0.0)
    ranges = np.sqrt((xyz**2).sum(axis=1, keepdims=True))
    noisy = fit_floor(xyz * (1.0 + noise * rng.standard_normal((len(xyz), 1)) / ranges), 0.70)
    assert noisy.noise == pytest.approx(noise, rel=0.15)
    assert noisy.uneven < 0.004 + 0.05 * noise
    xyz[:, 2] += 0.008 * rng.standard_normal(len(xyz))
    uneven = fit_floor(xyz, 0.70)
    assert uneven.noise < 0.004
    assert uneven.uneven == pytest.approx(0.008, rel=0.15)


def test_feet_of_one_far_wall_do_not_tilt_the_plane():
    # A wall at x = 4 whose lowest 50 mm are in reach of the coarse fit: 25 mm high in the mean.
    rng = np.random.default_rng(4)
    xyz = low_returns((0.0, 0.0, -0.7), 4000, 0.0)
    ranges = np.sqrt((xyz**2).sum(axis=1, keepdims=True))
    xyz *= 1.0 + 0.01 * rng.standard_normal((len(xyz), 1)) / ranges
    foot = np.column_stack(
        [np.full(200, 4.0), rng.uniform(-3, 3, 200), rng.uniform(-0.70, -0.65, 200)]
    )
    found = fit_floor(np.vstack([xyz, foot]), 0.70)
    # All 200 at full weight would tilt it by 2.5 mm over the 4 m.
    assert abs(found.plane[0] * 4.0 + found.plane[2] + 0.7) < 0.0015


def test_a_terrace_behind_glass_does_not_tilt_the_plane():
    found = fit_floor(rooms.glass_front(0.005).xyz.astype(np.float64), 0.70)
    assert found.plane == pytest.approx([0.0, 0.0, -0.7], abs=0.001)


def test_crowded_returns_tell_the_height_of_their_cell_but_once():
    """Carpet: each cell of 0.1 m has a height of its own, and all its returns share it."""
    errors = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        # Half of the returns crowd within 0.7 m, as rings do near the sensor.
        near, wide = rng.uniform(-0.7, 0.7, (4000, 2)), rng.uniform(-2.5, 2.5, (4000, 2))
        xy = np.concatenate([near, wide])
        cell = np.floor(xy / 0.1).astype(int) + 50
        z = -0.7 + 0.01 * rng.standard_normal((100, 100))[cell[:, 0], cell[:, 1]]
        found = fit_floor(np.column_stack([xy, z]), 0.70)
        errors.append(found.plane[:2] / np.sqrt(np.diag(found.covariance)[:2]))
    assert 0.6 < np.std(errors) < 1.6


def test_floor_at_one_range_alone_makes_a_plane():
    azimuth = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    ring = np.column_stack([2.0 * np.cos(azimuth), 2.0 * np.sin(azimuth), np.full(400, -0.7)])
    floor = fit_floor(ring, 0.7)
    assert floor.source == FloorSource.MEASURED
    assert np.abs(floor.plane - [0.0, 0.0, -0.7]).max() < 1e-6


def test_a_floor_too_far_from_the_mounting_height_is_not_followed():
    found = fit_floor(low_returns((0.0, 0.0, -1.2)), 0.70)
    assert found.source == FloorSource.MOUNTING
    np.testing.assert_array_equal(found.plane, [0.0, 0.0, -0.70])
    assert found.sigma(np.zeros(1), np.zeros(1))[0] >= 0.05


def test_the_last_good_plane_stands_in_where_smoke_hides_the_floor():
    good = fit_floor(low_returns((0.02, 0.0, -0.68)), 0.70)
    found = fit_floor(np.zeros((0, 3)), 0.70, good)
    assert found.source == FloorSource.MEASURED_BEFORE
    np.testing.assert_array_equal(found.plane, good.plane)
    assert np.all(np.diag(found.covariance) > np.diag(good.covariance))


@pytest.mark.parametrize("rings", [16, 128])
def test_feet_of_walls_are_no_floor(rings):
    """A wet floor sends nothing back: of the walls' returns the lowest, up to 0.1 m high all round,
    lie near a plane as well. The mounting height has to do."""
    view = rooms.box_room(WALLS, 1.9, -0.7, np.linspace(-52.0, 50.0, rings), 0.4)[0]
    walls = view.select(view.xyz[:, 2] > -0.699)
    result = reconstruct(walls)
    assert result.floor.source == FloorSource.MOUNTING
    np.testing.assert_array_equal(result.floor.plane, [0.0, 0.0, -0.7])
    assert not np.any(result.labels == Label.GROUND)
    reach = np.abs(result.surface.xyz[:, :2]).max(axis=0)
    np.testing.assert_allclose(reach, WALLS[:2], atol=0.02)  # up to the walls all the same


def test_walls_that_end_at_the_plane_stand_on_it():
    """Few rings meet the floor, and smoke takes every second of its returns: a quarter of those
    near the plane stand at walls, but none below it. The mounting is 2 cm off."""
    view = rooms.few_rings_in_smoke(noise=0.01)
    floor = reconstruct(view, Mounting(np.eye(3), 0.72)).floor
    assert floor.source == FloorSource.MEASURED
    assert floor.plane == pytest.approx([0.0, 0.0, -0.7], abs=0.001)


def test_one_line_of_returns_is_no_plane():
    line = low_returns((0.0, 0.0, -0.7), 500)
    line[:, 1] = 1.0
    assert fit_floor(line, 0.70).source == FloorSource.MOUNTING


# --- the walls -----------------------------------------------------------------------------------


def test_sigma_of_measured_and_drawn_points():
    found = reconstruct(room_scan(noise=0.01))
    xyz, measured = found.surface.xyz.astype(float), found.surface.provenance == 0
    sigma = found.surface.sigma
    assert sigma.dtype == np.float32 and len(sigma) == len(xyz)
    # A range's noise of 10 mm by the sine of the grazing angle.
    sine = 0.7 / np.sqrt((xyz[measured] ** 2).sum(axis=1))
    np.testing.assert_allclose(sigma[measured], 0.01 * sine, rtol=0.25)
    # Between the rings the floor's unevenness of at least 3 mm, and next to nothing more.
    assert sigma[~measured].min() >= 0.003
    assert np.median(sigma[~measured]) < 0.005


def test_profile_of_a_box_room():
    found = reconstruct(room_scan(noise=0.01))
    assert np.all(found.profile.kind == SEEN)
    np.testing.assert_allclose(found.profile.distance, true_distance(), atol=0.02)


def test_no_floor_is_claimed_past_a_wall():
    # Beams at the columns' edges: at a corner 3.4 m away the wall is up to 16 mm nearer there.
    view = room_scan(noise=0.01)
    cosine, sine = np.cos(np.radians(0.26)), np.sin(np.radians(0.26))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = view._replace(xyz=(view.xyz @ turn.T).astype(np.float32))
    xyz = reconstruct(turned).surface.xyz @ turn
    east, north, west, south = WALLS
    assert xyz[:, 0].max() < east and xyz[:, 0].min() > west
    assert xyz[:, 1].max() < north and xyz[:, 1].min() > south


def test_profile_does_not_end_at_furniture():
    view = room_scan()
    xyz = view.xyz.copy()
    range_ = np.linalg.norm(xyz, axis=1)
    # A cupboard 1.2 m high whose front stands at x = 2.5 from y = -0.8 to 0.8.
    at_front = xyz * (2.5 / np.maximum(xyz[:, :1], 1e-6))
    front = (xyz[:, 0] > 2.5) & (np.abs(at_front[:, 1]) < 0.8) & (at_front[:, 2] < 0.5)
    xyz[front] = at_front[front]
    assert np.count_nonzero(front & (range_ > 2.5)) > 500
    found = reconstruct(view._replace(xyz=xyz))
    np.testing.assert_allclose(found.profile.distance, true_distance(), atol=0.02)


def wall_returns(noise, smoke=0):
    """Column and planar range of 20 returns a column of a wall 3 m away, and some of smoke."""
    rng = np.random.default_rng(4)
    column = np.repeat(np.arange(COLUMNS), 20 + smoke)
    planar = 3.0 + noise * rng.standard_normal((COLUMNS, 20 + smoke))
    planar[:, 20:] = rng.uniform(0.5, 3.0, (COLUMNS, smoke))
    return column, planar.ravel()


@pytest.mark.parametrize("smoke", [0, 10], ids=["clear", "smoke"])
@pytest.mark.parametrize("noise", [0.01, 0.04, 0.06])
def test_walls_tell_how_far_their_returns_stray(noise, smoke):
    """Half of normal noise lies within 1.35 sigma, the narrowest half of 20 returns within 0.9 on
    the average, 0.7 in a twentieth of the columns. With smoke half of the 30 returns are three
    quarters of these 20."""
    told = spread_of_walls(*wall_returns(noise, smoke))
    assert told == pytest.approx((1.45 if smoke else 0.7) * noise, rel=0.1)


def test_few_columns_tell_no_spread():
    column, planar = wall_returns(0.05)
    assert spread_of_walls(column[:600], planar[:600]) > 0.0  # 30 columns, of which ten tell
    assert spread_of_walls(column[:540], planar[:540]) == 0.0


def test_columns_that_see_chairs_tell_no_spread():
    """Nine of ten columns see something else nearer to the wall, as they do in an office."""
    column, planar = wall_returns(0.01)
    chairs = (column % 30 != 0) & (np.arange(len(column)) % 3 > 0)
    planar[chairs] -= np.random.default_rng(5).uniform(0.05, 1.0, np.count_nonzero(chairs))
    assert spread_of_walls(column, planar) < 0.015


def test_places_of_walls_widen_only_where_returns_stray_more_than_usual():
    assert widening_for(0.0) == widening_for(0.02) == 1.0
    assert widening_for(0.05) == pytest.approx(2.0)
    assert widening_for(0.5) == 3.0


@pytest.mark.parametrize("noise", [0.04, 0.06])
def test_walls_of_a_sensor_of_much_range_noise_are_found(noise):
    """Four returns in a column of 60 lie within 25 mm, but not most of those around: 60 mm noise
    leaves 0.32 of them there, of 0.95 within 120 mm."""
    found = reconstruct(room_scan(noise=noise))
    assert np.count_nonzero(found.profile.line < 0) == 0
    np.testing.assert_allclose(found.profile.distance, true_distance(), atol=0.02)


def profile_of(distance, *reaches, spread=0.0):
    """The profile of columns 100 to 139 with posts at `distance` (40,) on lines with reaches (40,),
    of none of which the top is in view."""
    columns = np.arange(100, 140)
    reach, seen = np.full((len(reaches), COLUMNS), np.inf), np.zeros((len(reaches), COLUMNS), bool)
    reach[:, columns], seen[:, columns] = np.reshape(reaches, (-1, 40)), True
    nothing = np.zeros(40)
    posts = Posts(columns, np.full(40, 8), distance, nothing, nothing + 1.2, nothing, nothing)
    view, unknown = View(np.inf, 0.7, 0.1, 1.5), np.zeros(COLUMNS)
    normals = np.tile([1.0, 0.0], (len(reaches), 1))
    support = Support(seen, np.zeros_like(seen), reach, normals, np.zeros(len(reaches), bool))
    found = column_profile(posts, support, view, unknown, unknown, DIRECTIONS, 1.6, spread)
    return found.distance[columns]


def test_a_line_tells_better_than_one_column_how_far_a_wall_is():
    wall = np.full(40, 3.0)
    noisy = wall + np.where(np.arange(40) % 4 == 0, 0.012, -0.004)
    assert profile_of(noisy, wall) == pytest.approx(wall)


def test_a_noisy_sensors_posts_stray_farther_from_their_line():
    """Range noise of 30 mm lets the mean of six returns stray by 12 mm, three sigma are 37 mm."""
    wall = np.full(40, 3.0)
    noisy = wall + np.where(np.arange(40) % 4 == 0, 0.03, -0.01)
    assert profile_of(noisy, wall)[4:-4:4] == pytest.approx(noisy[4:-4:4])
    assert profile_of(noisy, wall, spread=0.8 * 0.03) == pytest.approx(wall)
    assert on_line_for(0.8 * 0.03) == pytest.approx(3.0 * 0.03 / np.sqrt(6.0), rel=0.15)


def test_a_line_that_crosses_a_wall_does_not_move_it():
    wall, across = np.full(40, 3.0), np.linspace(2.97, 3.03, 40)
    found = profile_of(wall, wall, across)
    assert found.max() <= 3.0 and found.min() > 2.993


def test_posts_side_by_side_behind_a_line_show_a_curved_wall():
    line = np.full(40, 3.0)
    curved = line + 0.012 * np.sin(np.linspace(0.0, np.pi, 40))
    assert profile_of(curved, line)[4:-4] == pytest.approx(curved[4:-4])


def test_a_gap_in_a_wall_is_bridged_along_it():
    found = reconstruct(without_walls(room_scan(), 350.0, 360.0))
    gap = slice(int(351 / COLUMN_DEG), int(359 / COLUMN_DEG))
    assert np.all(found.profile.kind[gap] == INFERRED)
    np.testing.assert_allclose(found.profile.distance[gap], true_distance()[gap], atol=0.02)


def test_a_gap_at_a_corner_is_bridged_round_it():
    corner = np.degrees(np.arctan2(3.0, 3.4))
    found = reconstruct(without_walls(room_scan(), corner - 8.0, corner + 8.0))
    gap = slice(int((corner - 7) / COLUMN_DEG), int((corner + 7) / COLUMN_DEG))
    assert np.all(found.profile.kind[gap] == INFERRED)
    np.testing.assert_allclose(found.profile.distance[gap], true_distance()[gap], atol=0.02)


@pytest.mark.parametrize(("top", "kind"), [(2.0, INFERRED), (2.6, LIMIT)], ids=["cupboard", "wall"])
def test_no_corner_is_drawn_on_behind_a_wall(top, kind):
    """Before a corner that smoke hides stand three columns of something, 2.5 m away: up to the
    ceiling it is a piece of wall, and the room may end there."""
    corner = int(np.degrees(np.arctan2(3.0, 3.4)) / COLUMN_DEG)
    view = without_walls(room_scan(), (corner - 20) * COLUMN_DEG, (corner + 20) * COLUMN_DEG)
    middle, z = np.meshgrid(MIDDLES[corner - 1 : corner + 2], np.arange(-0.65, top - 0.7, 0.05))
    piece = np.stack([2.5 * np.cos(middle), 2.5 * np.sin(middle), z], axis=-1).reshape(-1, 3)
    ring = np.r_[view.ring, np.full(len(piece), 60)]
    found = reconstruct(rooms.view_of(np.vstack([view.xyz, piece]), 60.0, ring))
    gap = np.r_[corner - 15 : corner - 3, corner + 4 : corner + 15]
    assert np.all(found.profile.kind[gap] == kind)


def scan_within(wall, noise=0.01):
    """A room 2.6 m high, seen from 0.7 m, whose wall stands so far away in each column."""
    elevation, azimuth = np.meshgrid(np.radians(ELEVATIONS_DEG), MIDDLES, indexing="ij")
    slope = np.tan(elevation)
    with np.errstate(divide="ignore"):
        planar = np.minimum(wall, np.where(slope > 0, 1.9, -0.7) / slope)  # wall, ceiling or floor
    planar += noise * np.random.default_rng(0).standard_normal(planar.shape)
    xyz = np.stack([planar * np.cos(azimuth), planar * np.sin(azimuth), planar * slope], axis=-1)
    ring = np.broadcast_to(np.arange(len(slope))[:, None], slope.shape)
    return rooms.view_of(xyz.reshape(-1, 3), 60.0, ring.ravel())


def test_a_round_wall_is_followed_where_its_top_is_hidden():
    view = scan_within(3.0)
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0]))
    view = view.select((azimuth < 100.0) | (azimuth > 140.0) | (view.xyz[:, 2] < 0.3))
    np.testing.assert_allclose(reconstruct(view).profile.distance, 3.0, atol=0.06)


def test_chords_of_a_round_wall_meet_in_no_corner():
    # Of 40 deg nothing is seen but the floor near by. The chords beside them would meet
    # 0.37 m outside.
    view = without_walls(scan_within(3.0), 70.0, 110.0)
    view = view.select((view.xyz[:, 1] < 1.6) | (view.xyz[:, 2] > -0.69))
    assert reconstruct(view).profile.distance.max() < 3.1


def test_a_blunt_corner_is_drawn_where_its_walls_are_long():
    # Six walls, 3 m away and 3.46 m long.
    wall = 3.0 / np.cos((MIDDLES + np.pi / 6.0) % (np.pi / 3.0) - np.pi / 6.0)
    found = reconstruct(without_walls(scan_within(wall), 84.0, 96.0)).profile
    gap = slice(int(85 / COLUMN_DEG), int(95 / COLUMN_DEG))
    assert np.all(found.kind[gap] == INFERRED)
    np.testing.assert_allclose(found.distance[gap], wall[gap], atol=0.02)


def test_half_a_room_without_walls_stays_unknown():
    view = without_walls(room_scan(), 100.0, 260.0)
    planar = np.hypot(view.xyz[:, 0], view.xyz[:, 1])
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) % 360.0
    thick = (azimuth > 100.0) & (azimuth < 260.0)
    found = reconstruct(view.select(~(thick & (planar > 1.5))))
    middle = slice(int(120 / COLUMN_DEG), int(240 / COLUMN_DEG))
    assert np.all(found.profile.kind[middle] == LIMIT)
    claimed = found.surface.xyz[np.isin(columns_of(found.surface.xyz), np.arange(300, 600))]
    # To the last ring measured within 1.5 m and no farther.
    assert 1.3 < np.hypot(claimed[:, 0], claimed[:, 1]).max() <= 1.5


def hazy_sector(*more):
    """Is floor what more (N, 3) was seen in a sector of a room that smoke hides from 1.2 m on?"""
    view = without_walls(room_scan(), 10.0, 130.0)
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) % 360.0
    planar = np.hypot(view.xyz[:, 0], view.xyz[:, 1])
    view = view.select(~((azimuth > 10.0) & (azimuth < 130.0) & (planar > 1.2)))
    room = reconstruct(rooms.joined(view, rooms.view_of(more, 15.0, 20)))
    return room.labels[-len(more) :] == Label.GROUND


def test_floor_is_measured_wherever_nothing_is_known_to_bound_it():
    pair = [(1.5, 1.5, -0.7), (1.52, 1.52, -0.7)]  # of one cell
    assert hazy_sector(*pair, (2.1, 1.1, -0.7)).tolist() == [True, True, False]


def test_a_lone_return_is_floor_if_the_cells_around_it_are():
    pair = [(1.5, 1.5, -0.7), (1.52, 1.52, -0.7)]
    assert hazy_sector(*pair, (1.7, 1.5, -0.7), (1.5, 1.9, -0.7)).tolist() == [True] * 3 + [False]
    assert not hazy_sector(*pair, (1.7, 1.5, -0.64))[-1]


def test_floor_behind_single_posts_need_not_be_as_level_as_through_an_opening():
    chair = [(1.5, 1.2 + 0.01 * i, -0.5 + 0.05 * k) for i in range(60) for k in range(10)]
    around = [(1.5 * f, 1.5 * f, -0.685) for f in (1.5, 1.505)]  # 15 mm above the plane
    assert hazy_sector(*chair, *around)[-2:].all()


def test_a_wall_has_a_foot_only_where_it_is_seen_near_by():
    """A partition x = 1 from y = 1 to the wall: its line goes on across the floor."""
    xyz = room_scan().xyz.astype(np.float64)
    at = xyz[:, 1] / np.where(xyz[:, 0] > 1.0, xyz[:, 0], np.inf)
    xyz[at > 1.0] /= xyz[at > 1.0, :1]
    found = reconstruct(room_scan()._replace(xyz=xyz.astype(np.float32)))
    x, y, z = xyz.T
    on = (np.abs(x - 1.0) < 0.03) & (z < -0.69)
    assert found.room.at_wall[on & (y > 1.0)].all()
    assert not found.room.at_wall[on & (np.abs(y) < 0.5)].any()


def test_smoke_near_the_sensor_bounds_nothing():
    smoke = rooms.smoke_ball(8000, seed=4)
    weak = smoke._replace(intensity=np.full(8000, 2.0, np.float32))
    view = rooms.joined(room_scan(), weak)
    np.testing.assert_allclose(reconstruct(view).profile.distance, true_distance(), atol=0.02)


# --- drop-offs -----------------------------------------------------------------------------------


def test_a_return_from_below_ends_the_floor_where_its_beam_crossed_it():
    # Sensor 0.7 m up; returns 0.7 m below the floor at 4 m: their beams crossed it at 2 m.
    column = np.array([10, 10, 10, 10, 10])
    planar = np.array([1.0, 1.8, 4.0, 4.0, 4.0])
    height = np.array([0.0, 0.0, -0.7, -0.7, -0.7])
    drops = find_drop_offs(column, planar, height, height == 0.0, 0.7, DIRECTIONS)
    assert drops.begin[10] == pytest.approx(1.78)  # the last measured floor, less 2 cm
    assert drops.end[10] == np.inf
    at = np.array([1.7, 1.9, 3.0])
    assert drops.hides(np.full(3, 10), at).tolist() == [False, True, True]
    assert not drops.hides(np.full(3, 500), at).any()


def test_the_floor_ends_farther_before_the_edge_that_a_noisy_sensor_sees():
    column = np.array([10, 10, 10, 10])
    planar, height = np.array([1.8, 4.0, 4.0, 4.0]), np.array([0.0, -0.7, -0.7, -0.7])
    wider = DropTolerances(widening=2.0)
    drops = find_drop_offs(column, planar, height, height == 0.0, 0.7, DIRECTIONS, tolerances=wider)
    assert drops.begin[10] == pytest.approx(1.76)  # the last measured floor, less 4 cm


def test_what_noise_may_have_lowered_is_not_from_below_the_floor():
    """Three sigma of 40 mm noise lower a return at 1 m from 0.7 m, 1.25 m away, by 67 mm, at 3 m by
    27 mm; 5 mm a metre come on top."""
    planar, height = np.array([1.0, 1.0, 3.0, 3.0]), np.array([-0.07, -0.09, -0.05, -0.06])
    lift = floor_lift(FloorModel(np.array([0.0, 0.0, -0.7]), None, 0.0, 0.04, 0.003, None))
    assert lift == pytest.approx(0.12 * 0.7)
    found = DropTolerances(0.04, lift).is_below(planar, height, 0.7)
    assert found.tolist() == [False, True, False, True]
    found = DropTolerances(0.04).is_below(planar, height, 0.7)
    assert found.tolist() == [True, True, False, True]


def test_a_noisy_sensors_steep_returns_of_floor_stray_farther():
    """At 1 m of planar range 40 mm noise lifts floor by 23 mm sigma: 0.8 lie within 30 mm of it."""
    view, surface = rooms.box_room(WALLS, 1.9, -0.7, ELEVATIONS_DEG, 0.4, range_noise=0.04)
    labels = reconstruct(view).labels
    near = (surface == 0) & (np.hypot(view.xyz[:, 0], view.xyz[:, 1]) < 1.0)
    assert np.mean(labels[near] == Label.GROUND) > 0.99


def test_one_return_from_below_is_witness_enough_where_no_two_are():
    floor = [(2.5, 0.4 * k) for k in range(-20, 21)]
    drops = find_drop_offs(*ledge([(3.06, 0.0)], floor), 0.7, DIRECTIONS)
    assert drops.begin[column_at(0.0)] == pytest.approx(2.5 - 0.02, abs=0.01)
    # Where two are, in other columns, single ones of those begin no drop.
    behind = [(x, 100.4 + 0.4 * k) for k in range(3) for x in (-3.06, -3.4)]
    drops = find_drop_offs(*ledge([(3.06, 0.0), *behind], floor), 0.7, DIRECTIONS)
    assert drops.begin[column_at(0.0)] == np.inf


def test_what_a_glossy_floor_mirrors_is_no_drop():
    # The feet of a wall at 3 m, 0.1 m high, in the mirror: their beams met the floor at 2.625 m.
    ranges = np.arange(1.0, 2.95, 0.1)
    column = np.concatenate([np.repeat(np.arange(20), len(ranges)), [10, 10, 10]])
    planar = np.concatenate([np.tile(ranges, 20), [3.0, 3.0, 3.0]])
    height = np.concatenate([np.zeros(20 * len(ranges)), [-0.1, -0.1, -0.1]])
    drops = find_drop_offs(column, planar, height, height == 0.0, 0.7, DIRECTIONS)
    assert not np.isfinite(drops.begin).any()
    ends_before = (height < 0.0) | (planar < 2.6)
    seen = (values[ends_before] for values in (column, planar, height, height == 0.0))
    drops = find_drop_offs(*seen, 0.7, DIRECTIONS)
    assert drops.begin[10] == pytest.approx(2.48)  # the last measured floor, less 2 cm


def test_floor_goes_on_beyond_a_pit_where_it_is_measured():
    column = np.full(8, 10)
    planar = np.array([1.8, 4.0, 4.0, 4.0, 2.9, 3.0, 3.1, 3.2])
    height = np.array([0.0, -0.7, -0.7, -0.7, 0.0, 0.0, 0.0, 0.0])
    drops = find_drop_offs(column, planar, height, height == 0.0, 0.7, DIRECTIONS)
    # Floor is measured again from 2.9 m on; the first 3 cm of it may lie over the pit.
    at = np.array([2.0, 2.5, 2.92, 2.94, 4.0])
    assert drops.hides(np.full(5, 10), at).tolist() == [True, True, True, False, False]


def column_at(azimuth_deg):
    return int(azimuth_deg % 360.0 / COLUMN_DEG)


def ledge(crossed, floor):
    """Returns about a ledge at x = 3: columns from (x, azimuth) of crossings and of floor.

    A beam that crosses the floor's plane at r reaches 0.7 m below it at 2 r.
    """
    at = np.array(crossed + floor)
    column = np.array([column_at(azimuth) for azimuth in at[:, 1]])
    planar = at[:, 0] / DIRECTIONS[column, 0]
    below = np.arange(len(at)) < len(crossed)
    height = np.where(below, -0.7, 0.0)
    return column, np.where(below, 2.0 * planar, planar), height, ~below


def two_sided_ledge(*more_floor):
    sides = [0.4 * k for k in range(85, 101)] + [-0.4 * k for k in range(85, 101)]
    crossed = [(x, azimuth) for azimuth in sides for x in (3.06, 3.4)]
    return ledge(crossed, [(2.5, azimuth) for azimuth in sides] + [(2.94, 8.0), *more_floor])


def test_a_straight_edge_ends_the_floor_in_columns_that_show_neither_side_of_it():
    seen = two_sided_ledge()
    drops = find_drop_offs(*seen, 0.7, DIRECTIONS, [(1.0, 0.0)])
    for azimuth in (-38.0, -20.0, 0.0, 20.0, 38.0):
        c = column_at(azimuth)
        # Floor is certain up to x = 2.94, the farthest measured before the drop at 3.06; columns
        # share what they see, which is 3 mm at 8 deg.
        assert drops.begin[c] * DIRECTIONS[c, 0] == pytest.approx(2.94, abs=4e-3)
        assert drops.floor_to[c] == drops.begin[c]
    without_walls = find_drop_offs(*seen, 0.7, DIRECTIONS)
    assert np.all(without_walls.floor_to == 0.0)
    assert np.all(without_walls.begin[drops.floor_to > 0.0] < np.inf)


def test_floor_measured_beyond_an_edge_divides_it():
    beyond = [(x, azimuth) for azimuth in (-2.0, -1.6, -1.2, -0.8, -0.4) for x in (3.15, 3.5)]
    drops = find_drop_offs(*two_sided_ledge(*beyond), 0.7, DIRECTIONS, [(1.0, 0.0)])
    c = column_at(-1.2)
    assert drops.begin[c] == np.inf and drops.floor_to[c] == 0.0


def test_an_edge_goes_on_sideways_until_floor_is_measured_behind_it():
    behind = [(x, azimuth) for azimuth in (46.0, 46.4, 46.8) for x in (3.1, 3.2, 3.3)]
    drops = find_drop_offs(*two_sided_ledge(*behind), 0.7, DIRECTIONS, [(1.0, 0.0)])
    assert drops.begin[column_at(43.0)] * DIRECTIONS[column_at(43.0), 0] == pytest.approx(
        2.94, abs=4e-3
    )
    assert drops.floor_to[column_at(43.0)] == 0.0  # no floor seen close to the edge beyond here
    assert drops.begin[column_at(46.4)] == np.inf
    assert drops.begin[column_at(60.0)] == np.inf


def test_an_edge_that_may_run_either_way_tells_of_floor_before_both():
    azimuths = [33.0 + 0.4 * k for k in range(10)]
    crossed = [(x, azimuth) for azimuth in azimuths for x in (3.2, 3.4)]
    seen = ledge(crossed, [(1.5, azimuth) for azimuth in azimuths])
    drops = find_drop_offs(*seen, 0.7, DIRECTIONS, [(1.0, 0.0), (0.0, 1.0)])
    x, y = (drops.floor_to[:, None] * DIRECTIONS).T
    assert 0.0 < x.max() < 3.2 and 0.0 < y.max() < 2.08
    assert np.all(drops.begin[drops.floor_to > 0.0] < np.inf)
    c = column_at(35.0)
    assert drops.begin[c] * DIRECTIONS[c, 0] < 1.5
    # The hole may lie behind either, x = 3.2 or y = 3.2 tan 33 deg = 2.08, to both sides.
    for azimuth in (25.0, 45.0):
        c = column_at(azimuth)
        east, north = DIRECTIONS[c]
        assert drops.begin[c] <= min(3.2 / east, 2.08 / north)


def test_past_the_end_of_one_edge_another_that_may_stand_for_it_is_in_doubt():
    """As before; floor is measured right behind x = 3.2, below 20 deg. If x = 3.2 is the edge, the
    hole may go on to that side nearer than y = 2.08, which is drawn on there."""
    azimuths = [33.0 + 0.4 * k for k in range(10)]
    crossed = [(x, azimuth) for azimuth in azimuths for x in (3.2, 3.4)]
    behind = [(3.3, azimuth) for azimuth in (18.8, 19.2, 19.6, 20.0)]
    seen = ledge(crossed, [(1.5, azimuth) for azimuth in azimuths] + behind)
    drops = find_drop_offs(*seen, 0.7, DIRECTIONS, [(1.0, 0.0), (0.0, 1.0)])
    doubted = 0.2 + 0.4 * np.flatnonzero(drops.is_doubted)
    low, high = doubted[doubted < 33.0], doubted[doubted > 37.0]
    # Only y = 2.08 is drawn on below 20.6 deg (columns share floor with the next), down to 9 deg,
    # where columns run almost along it, and above 81 deg, where they do along x = 3.2.
    assert low.max() == pytest.approx(20.6, abs=0.3) and low.min() == pytest.approx(8.8, abs=0.3)
    assert high.min() == pytest.approx(81.4, abs=0.4)
    assert not find_drop_offs(*seen, 0.7, DIRECTIONS).is_doubted.any()


@pytest.mark.parametrize("lift", [0.001, -0.001])
@pytest.mark.parametrize("tilt_deg", [0.02, -0.02])
def test_a_plane_a_little_off_moves_no_edge(lift, tilt_deg):
    column, planar, height, is_floor = two_sided_ledge()
    drops = find_drop_offs(column, planar, height, is_floor, 0.7, DIRECTIONS, [(1.0, 0.0)])
    off = lift + math.tan(math.radians(tilt_deg)) * planar * DIRECTIONS[column, 0]
    moved = find_drop_offs(
        column, planar, height + off, is_floor, 0.7 - lift, DIRECTIONS, [(1.0, 0.0)]
    )
    # A crossing 3 m away moves by 3 / 0.7 of what the plane moves there, 2 mm: less than 1 cm.
    known = np.isfinite(drops.begin)
    np.testing.assert_array_equal(np.isfinite(moved.begin), known)
    np.testing.assert_allclose(moved.begin[known], drops.begin[known], atol=0.01)
    np.testing.assert_allclose(moved.floor_to, drops.floor_to, atol=0.01)


def test_a_drop_stops_short_of_a_wall_that_is_seen_down_to_its_foot():
    azimuths = [0.4 * k for k in range(-2, 3)]
    crossed = [(x, azimuth) for azimuth in azimuths for x in (2.0, 2.2)]
    seen = ledge(crossed, [(1.8, azimuth) for azimuth in azimuths])
    alone = find_drop_offs(*seen, 0.7, DIRECTIONS)
    c = column_at(10.0)
    assert alone.begin[c] < 2.0  # where the drop ends is not seen
    at = np.repeat(np.arange(column_at(4.0), column_at(20.0)), 10)
    rows = np.tile(np.linspace(0.11, 0.2, 10), len(at) // 10)
    feet = WallFeet(at, rows, np.full(len(DIRECTIONS), 4.0))
    drops = find_drop_offs(*seen, 0.7, DIRECTIONS, feet=feet)
    # A drop from 1.8 m to the wall at 4 m would show it 0.7 (4 - 1.8) / 1.8 = 0.86 m deep.
    assert drops.begin[c] == np.inf
    assert drops.begin[column_at(2.0)] < 2.0
    assert drops.begin[column_at(-10.0)] < 2.0


def test_a_drop_goes_on_behind_floor_that_is_nearer_than_it_is_seen():
    """One beam fell through the floor 4 m away. Beside it floor is measured 3 m away, farther on
    4.4 m away; walls stand 6 m away, or 0.4 m behind the floor."""
    column = np.r_[10, 10, 16:40]
    planar = np.r_[1.8, 8.0, np.where(np.arange(16, 40) < 30, 3.0, 4.4)]
    height = np.where(planar == 8.0, -0.7, 0.0)
    none = np.zeros(0, np.int64), np.zeros(0)

    def begin(wall):
        feet = WallFeet(*none, np.full(COLUMNS, wall))
        return find_drop_offs(
            column, planar, height, height == 0.0, 0.7, DIRECTIONS, feet=feet
        ).begin

    assert begin(6.0)[20] == pytest.approx(2.98) and begin(6.0)[35] == np.inf
    assert begin(3.4)[20] == np.inf


def test_a_drop_goes_on_past_its_edge_where_smoke_hides_the_floor():
    seen = [0.4 * k for k in range(-15, 16)]
    crossed = [(x, azimuth) for azimuth in seen for x in (3.06, 3.4)]
    # Floor right behind the edge ends it at 10 deg; what the next columns hold is not seen.
    behind = [(x, azimuth) for azimuth in (10.0, 10.4, 10.8) for x in (3.12, 3.13)]
    returns = ledge(crossed, [(2.94, azimuth) for azimuth in seen] + behind)
    drops = find_drop_offs(*returns, 0.7, DIRECTIONS, [(1.0, 0.0)])
    c = column_at(15.0)
    assert 2.9 < drops.begin[c] < 3.13 / DIRECTIONS[column_at(10.8), 0]
    assert drops.begin[column_at(30.0)] == np.inf  # 16 deg and no farther


def test_no_floor_is_claimed_over_a_ledge():
    view = room_scan()
    xyz = view.xyz.astype(np.float64)
    # The floor ends at x = 1.8; beyond it the beams fly on to a floor 1 m lower or to the wall.
    falls = (xyz[:, 2] < -0.699) & (xyz[:, 0] > 1.8)
    longer = np.minimum(1.7 / 0.7, 3.4 / np.maximum(xyz[:, 0], 1e-9))
    longer = np.minimum(longer, 3.0 / np.maximum(np.abs(xyz[:, 1]), 1e-9))
    xyz[falls] *= longer[falls, None]
    found = reconstruct(view._replace(xyz=xyz.astype(np.float32)))
    # Columns share what they see with two to either side, 1.6 deg in all: 3 cm at 45 deg.
    assert 1.7 < found.surface.xyz[:, 0].max() <= 1.83
    assert found.surface.xyz[:, 0].min() < -3.3
    assert np.all(found.surface.boundary[:, 0] <= 1.83)


# --- ramps, platforms, openings -------------------------------------------------------------------


# --- drops that smoke hides ----------------------------------------------------------------------

HALF_KNOWN = np.where(np.arange(COLUMNS) < 100, 0.0, 4.0)  # no boundary in the first 100 columns
LOW_FROM_300 = np.where((np.arange(COLUMNS) >= 300) & (np.arange(COLUMNS) < 700), 1, 0)
NO_DROPS = DropOffs(
    np.full(COLUMNS, np.inf), np.full(COLUMNS, np.inf), np.zeros(COLUMNS), np.zeros(COLUMNS, bool)
)


NOTHING_RISES = np.zeros(COLUMNS, bool)


NOTHING_STANDS = np.zeros(COLUMNS)


def certain(floor, distance=HALF_KNOWN, drops=NO_DROPS, rises=NOTHING_RISES, stands=NOTHING_STANDS):
    return certain_floor(np.full(COLUMNS, floor), distance, drops, LOW_FROM_300, stands, rises)


@pytest.mark.parametrize("floor", [1.5, 3.5])
def test_in_a_gap_and_beside_it_floor_is_certain_where_it_is_measured(floor):
    # 0.3 m beyond it, to be exact, until the wall is seen low down: four returns in five columns.
    beside = np.ones(COLUMNS, bool)
    beside[300 - 2 + 3 : 700 - 1] = False
    np.testing.assert_allclose(certain(floor), np.where(beside, floor + 0.3, np.inf), rtol=1e-15)


def test_between_walls_all_round_no_floor_is_in_doubt():
    assert np.all(certain(1.5, np.full(COLUMNS, 4.0)) == np.inf)


def test_a_gap_of_12_columns_can_hide_a_drop_and_one_of_11_cannot():
    columns = np.arange(COLUMNS)
    # Over the seam, where columns count from 0 again.
    narrow = np.where((columns < 5) | (columns >= COLUMNS - 6), 0.0, 4.0)
    assert np.all(certain(1.5, narrow) == np.inf)
    wide = np.where((columns < 6) | (columns >= COLUMNS - 6), 0.0, 4.0)
    assert certain(1.5, wide)[[0, COLUMNS - 1, 20]] == pytest.approx(1.8)
    one_known = np.where(columns == 500, 4.0, 0.0)
    assert certain(1.5, one_known)[[0, 499, 501]] == pytest.approx(1.8)
    assert certain(1.5, np.zeros(COLUMNS))[500] == pytest.approx(1.8)


def test_a_gap_into_which_a_ramp_leads_is_not_in_doubt():
    # 12 columns to either side share what they see: 26 + 24 of the 100.
    ramp = (np.arange(COLUMNS) >= 40) & (np.arange(COLUMNS) < 66)
    assert np.all(certain(1.5, rises=ramp) == np.inf)
    ramp[65] = False
    assert certain(1.5, rises=ramp)[50] == pytest.approx(1.8)


def test_what_stands_low_down_stands_on_a_floor():
    desk = np.where((np.arange(COLUMNS) >= 50) & (np.arange(COLUMNS) < 200), 2.5, 0.0)
    found = certain(1.5, stands=desk)
    # In the gap, which ends at 100, floor goes on to the desk; beside it, doubt ends there.
    assert found[49] == 1.8 and found[50] == found[99] == 2.5
    assert np.all(found[100:690] == np.inf) and found[800] == 1.8
    before = certain(3.0, stands=desk)  # nothing is told by what stands before measured floor
    assert before[60] == before[150] == 3.3


def test_floor_beside_a_drop_is_in_doubt_as_it_is_beside_a_gap():
    begin = np.where(HALF_KNOWN == 0.0, 1.6, np.inf)
    drops = replace(NO_DROPS, begin=begin)
    found = certain(1.5, np.full(COLUMNS, 4.0), drops)
    assert found[150] == 1.8 and found[800] == 1.8 and found[400] == np.inf


def test_an_edge_tells_of_floor_however_thick_the_smoke_is():
    drops = replace(NO_DROPS, floor_to=np.full(COLUMNS, 2.5))
    assert certain(1.5, drops=drops)[50] == 2.5


def test_floor_is_in_doubt_where_an_edge_that_may_be_another_is_drawn_on():
    doubted = np.arange(COLUMNS) == 400
    drops = replace(NO_DROPS, begin=np.where(doubted, 3.0, np.inf), is_doubted=doubted)
    assert certain(1.5, np.full(COLUMNS, 4.0), drops)[400] == 1.8


def test_floor_before_a_wall_of_which_no_foot_is_seen_ends_where_nothing_is_known():
    view = rooms.thick_smoke(room_scan())
    found = reconstruct(view)
    # The third farthest of a column is floor 1.5 m away. From 100 deg on nothing of the wall is
    # seen, from 80 deg on its upper half.
    for azimuth in (85.0, 95.0):
        assert found.limit[column_at(azimuth)] == pytest.approx(1.8, abs=0.05)
    wall = column_at(60.0)
    assert found.limit[wall] == pytest.approx(true_distance()[wall], abs=0.02)
    kinds = dict(zip(columns_of(found.surface.boundary), found.surface.boundary_kind))
    assert found.profile.kind[column_at(90.0)] == SEEN
    assert kinds[column_at(90.0)] == LIMIT
    assert kinds[wall] == SEEN


def test_floor_goes_on_through_smoke_to_what_is_seen_low_down():
    def limit(*heights):
        return reconstruct(rooms.standing_in_smoke(room_scan(), heights)).limit[449:452]

    measured = reconstruct(rooms.thick_smoke(room_scan())).limit[449:452]
    assert 1.3 < measured.max() <= 1.6
    # The third farthest return tells, in its own column: the next ones may look past it.
    np.testing.assert_allclose(limit(0.2, 0.3, 0.25), [measured[0], 2.5, measured[2]], atol=1e-6)
    np.testing.assert_allclose(limit(0.2, 0.3, 0.25, 0.3)[1], 2.6, atol=1e-6)
    # Two returns are too few, and what is higher than 0.35 m may stand lower.
    for others in ((0.2, 0.3), (0.2, 0.3, 0.4), (1.0, 1.2, 1.4)):
        np.testing.assert_array_equal(limit(*others), measured)


def test_smoke_that_may_hide_a_drop_may_hide_a_ramp():
    surface = reconstruct(rooms.thick_smoke(room_scan())).surface
    column = columns_of(surface.xyz) == column_at(60.0)
    farthest = np.argmax(np.where(column, surface.xyz[:, 1], 0.0))
    # At the wall, 3.46 m away, of which 1.6 m are measured: two sigmas of a rise by 1 in 6.
    assert 2.0 * surface.sigma[farthest] == pytest.approx((3.46 - 1.6) / 6.0, abs=0.06)


def grid_of(x0, x1, y0, y1, step=0.04):
    x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
    return np.column_stack([x.ravel(), y.ravel()])


def relief_of(xy, height):
    return find_relief(xy, height, np.sqrt((xy**2).sum(axis=1)))


def test_a_ramp_and_the_platform_behind_it_are_floor():
    xy = grid_of(-3.0, 5.0, -1.0, 1.0)
    height = np.clip((xy[:, 0] - 1.0) / 8.0, 0.0, 0.25)  # 1:8 from x = 1 to 3, then level
    relief = relief_of(xy, height)
    at = np.array([[0.0, 0.1], [2.1, 0.1], [4.0, 0.1], [9.0, 0.1]])
    np.testing.assert_allclose(relief.at(at), [0.0, 1.1 / 8.0, 0.25, 0.25], atol=0.02)


def test_a_low_wide_platform_is_floor_and_a_box_is_not():
    floor = grid_of(-2.0, 2.0, -1.0, 1.0)
    podium, box = grid_of(2.0, 4.0, -1.0, 1.0), grid_of(-1.8, -1.2, -0.3, 0.3)
    low = relief_of(
        np.vstack([floor, podium]), np.r_[np.zeros(len(floor)), np.full(len(podium), 0.15)]
    )
    at = np.array([[3.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(low.at(at), [0.15, 0.0], atol=1e-9)
    for other, height in ((podium, 0.45), (box, 0.15)):
        xy = np.vstack([floor, other])
        assert relief_of(xy, np.r_[np.zeros(len(floor)), np.full(len(other), height)]).is_flat()


def test_a_ramp_goes_on_by_its_slope_until_a_wall_is_seen_beneath_it():
    floor = grid_of(-3.0, 2.0, -1.0, 1.0)
    height = np.clip((floor[:, 0] - 1.0) / 8.0, 0.0, None)  # 1:8 from x = 1, hidden from x = 2 on
    y, z = np.meshgrid(np.arange(-1.0, 1.0, 0.1), np.arange(0.3, 1.5, 0.05))
    wall = np.column_stack([np.full(y.size, 5.02), y.ravel()])  # down to 0.3 m over the plane
    relief = relief_of(np.vstack([floor, wall]), np.concatenate([height, z.ravel()]))
    at = np.array([[0.0, 0.0], [1.8, 0.5], [3.0, 0.0], [4.9, 0.5]])
    # The slope leads to 0.49 m at x = 4.9, but the floor lies no higher than the wall's foot.
    np.testing.assert_allclose(relief.at(at), [0.0, 0.1, 0.25, 0.3], atol=4e-3)


def test_a_ramp_and_a_platform_meet_where_neither_was_measured():
    floor, platform = grid_of(-3.0, 2.0, -1.0, 1.0), grid_of(3.2, 5.0, -1.0, 1.0)
    height = np.clip((floor[:, 0] - 1.0) / 8.0, 0.0, None)  # meets 0.2 m at x = 2.6
    relief = relief_of(np.vstack([floor, platform]), np.r_[height, np.full(len(platform), 0.2)])
    at = np.array([[2.3, 0.0], [2.5, 0.0], [2.7, 0.0], [3.1, 0.0]])
    np.testing.assert_allclose(relief.at(at), [0.1625, 0.1875, 0.2, 0.2], atol=4e-3)


def wall_above(foot, begin=-2.0, end=4.0):
    """Rows 4 cm apart of a wall along x, seen each 4 cm down to a height that depends on x."""
    x, z = np.meshgrid(np.arange(begin, end, 0.04), np.arange(0.0, 0.8, 0.04))
    seen = z >= foot(x)
    return x[seen], z[seen]


def wall_ramp(x, z, normal=(0.0, 1.0)):
    """Along a wall with the normal (0, 1) places count against x."""
    return find_wall_ramp(np.zeros(len(x), int), -x, z, np.array([normal]), 1.0 / 6.0)


def rising(x):
    return (x - 1.0) / 8.0


def test_the_feet_of_a_wall_show_a_ramp_that_smoke_hides():
    ramp = wall_ramp(*wall_above(rising))
    a, b, c = ramp.facet
    assert b == 0.0
    np.testing.assert_allclose([a * x + c for x in (1.5, 3.5)], [0.0625, 0.3125], atol=0.01)
    assert ramp.top == pytest.approx(0.36, abs=0.04)  # at x = 3.96


@pytest.mark.parametrize(
    "foot",
    [
        lambda x: np.zeros_like(x),
        lambda x: (x - 1.0) / 3.0,  # too steep
        lambda x: np.where(x > 1.0, 0.3, 0.0),  # a box before the wall
        lambda x: np.where(x > 1.0, 0.1 + rising(x), 0.0),  # no way up from the plane
        lambda x: np.where(np.sin(20.0 * x) > 0.0, 0.5, rising(x)),  # smoke
    ],
    ids=["level", "steep", "box", "hangs", "patchy"],
)
def test_other_feet_of_walls_show_no_ramp(foot):
    assert wall_ramp(*wall_above(foot)) is None


def test_a_ramp_that_walls_show_needs_a_floor_that_does_not_deny_it():
    floor, ramp = grid_of(-2.0, 1.2, -1.0, 1.0), WallRamp([0.125, 0.0, -0.125], 0.3)

    def relief_with(more, height):
        xy = np.vstack([floor, more])
        seen = xy, np.r_[np.zeros(len(floor)), height], np.sqrt((xy**2).sum(axis=1))
        return find_relief(*seen).with_ramp(ramp, *seen)

    at = np.array([[0.0, 0.0], [2.0, 0.0], [3.0, 0.5], [9.0, 0.0]])
    nothing = np.zeros((0, 2))
    np.testing.assert_allclose(relief_with(nothing, []).at(at), [0.0, 0.125, 0.25, 1.0])
    level = grid_of(2.0, 2.6, -1.0, 1.0)  # floor measured where the ramp is to be
    assert relief_with(level, np.zeros(len(level))).is_flat()
    column = np.array([[2.6, 0.5], [2.7, 0.5], [2.8, 0.5]])  # 0.2 m up there
    assert relief_with(column, np.full(3, 0.1)).is_flat()
    far = np.array([[6.0, 0.5], [6.0, 0.7], [6.0, 0.9]])  # a wall, 0.625 m up if it went on
    np.testing.assert_allclose(relief_with(far, np.full(3, 0.4)).at(at)[-1], 0.4)


ALONG_X = np.array([[0.0, 1.0]])  # the normal of a wall
PLANE_AND_RAMP = np.array([[0.0, 0.0, 0.0], [0.14, 0.007, -0.15]])  # 1:7, 3 deg askew
NOTHING = np.zeros((0, 3))


def ramp_at(x, y=0.0):
    """Places and heights of a ramp of 1:8 from x = 1."""
    return np.column_stack([x, np.full(len(x), y), (x - 1.0) / 8.0])


def fitted(floor, feet=NOTHING):
    return fit_ramp(PLANE_AND_RAMP, (Crease(0, 1, 1.0, 0.0, 1.1),), floor, feet, ALONG_X, 1 / 6.0)


def test_a_ramp_rises_as_the_scattered_returns_on_it_do_along_the_walls():
    facets, (crease,) = fitted(ramp_at(np.linspace(1.1, 2.5, 200)))
    np.testing.assert_allclose(facets, [[0.0, 0.0, 0.0], [0.125, 0.0, -0.125]], atol=1e-4)
    np.testing.assert_allclose([crease.nx, crease.ny, crease.rho], [1.0, 0.0, 1.0], atol=1e-3)


def test_a_ramp_stays_as_it_was_where_little_lies_on_it():
    floor = ramp_at(np.linspace(1.1, 2.5, 12))
    assert fitted(floor)[0] is not PLANE_AND_RAMP
    assert fitted(floor[1:])[0] is PLANE_AND_RAMP
    assert fitted(floor + [0.0, 0.0, 0.1])[0] is PLANE_AND_RAMP
    flat = np.zeros((1, 3))
    assert fit_ramp(flat, (), floor, NOTHING, ALONG_X, 1 / 6.0)[0] is flat


def test_a_ramp_lies_at_the_lowest_feet_of_walls():
    feet = np.vstack([ramp_at(np.linspace(1.2, 2.8, 40)) + [0.0, 0.0, up] for up in (0.0, 0.02)])
    facets, _ = fitted(NOTHING, feet)
    # What lies over it counts a twentieth of what lies below: 20 mm / 21.
    height = facets[1][0] * 2.0 + facets[1][2]
    assert height == pytest.approx(0.125 + 0.02 / 21.0, abs=2e-4)


def test_feet_of_walls_are_placed_on_their_lines():
    along, height = np.array([-1.0, -1.02, -2.0]), np.array([0.3, 0.2, 0.4])
    line, normals = np.zeros(3, int), np.array([[0.0, 1.0]])
    places = places_of_feet(line, along, height, normals, np.array([3.0]))
    # -1.0 and -1.02 may share a bin of 0.1 m: [-1.1, -1.0) and [-1.0, -0.9).
    np.testing.assert_allclose(places, [[2.0, 3.0, 0.4], [1.02, 3.0, 0.2], [1.0, 3.0, 0.3]])


def test_one_return_beneath_a_ramp_far_from_the_others_does_not_end_it():
    floor = grid_of(-3.0, 2.0, -1.0, 1.0)
    height = np.clip((floor[:, 0] - 1.0) / 8.0, 0.0, None)

    def end_with(y):  # of a wall at x = 5 that is seen down to 0.3 and, at one place, 0.2 m
        wall = np.array([[5.02, 0.1, 0.3], [5.02, 0.3, 0.3], [5.02, y, 0.2]])
        relief = relief_of(np.vstack([floor, wall[:, :2]]), np.r_[height, wall[:, 2]])
        return relief.at(np.array([[4.9, 0.0]]))[0]

    assert end_with(0.9) == pytest.approx(0.2) and end_with(1.2) == pytest.approx(0.3)


def riser_at(x, half_width, top):
    y, z = np.meshgrid(np.arange(-half_width, half_width, 0.05), np.arange(0.0, top + 1e-6, 0.025))
    return np.column_stack([np.full(y.size, x), y.ravel()]), z.ravel()


def test_a_long_riser_shows_the_height_of_a_platform_that_smoke_hides():
    floor = grid_of(-2.0, 2.03, -1.2, 1.2)
    riser, z = riser_at(2.05, 1.2, 0.15)
    xy, height = np.vstack([floor, riser]), np.r_[np.zeros(len(floor)), z]
    relief = relief_of(xy, height)
    at = np.array([[2.0, 0.0], [2.1, 0.0], [4.0, 3.0]])
    np.testing.assert_allclose(relief.at(at), [0.0, 0.15, 0.15], atol=1e-3)
    assert np.count_nonzero(relief.is_riser(xy, height)) == np.count_nonzero(z > 0.03)
    # A box as high but half as long is none, and neither is a kerb with floor behind it.
    short, low = riser_at(2.05, 0.6, 0.15)
    assert relief_of(np.vstack([floor, short]), np.r_[np.zeros(len(floor)), low]).is_flat()
    behind = grid_of(2.3, 3.0, -1.0, 1.0)
    kerb = relief_of(np.vstack([xy, behind]), np.r_[height, np.zeros(len(behind))])
    assert kerb.is_flat()


def test_sigma_of_the_relief_grows_away_from_measured_floor_and_with_slopes():
    floor = grid_of(-3.0, 2.0, -1.0, 1.0)
    at = np.array([[1.0, 0.5], [3.0, 0.0], [5.0, 0.0]])
    flat = relief_of(floor, np.zeros(len(floor))).sigma(at)
    ramp = relief_of(floor, np.clip((floor[:, 0] - 1.0) / 8.0, 0.0, None)).sigma(at)
    for sigma in (flat, ramp):
        assert sigma[0] == 0.0 and 0.0 < sigma[1] < sigma[2]
    assert np.all(ramp[1:] > 5.0 * flat[1:])


def open_door():
    """A door of 1 m in the wall x = 3.4, up to 0.6 m above the sensor: beams through it meet the
    floor up to x = 5 or nothing."""
    view = room_scan()
    xyz = view.xyz.astype(np.float64)
    through = np.isclose(xyz[:, 0], 3.4, atol=1e-3) & (np.abs(xyz[:, 1]) < 0.5) & (xyz[:, 2] < 0.6)
    down = through & (xyz[:, 2] < 0.0)
    xyz[down] *= (-0.7 / xyz[down, 2])[:, None]
    keep = ~through | (down & (xyz[:, 0] < 5.0))
    return view._replace(xyz=xyz.astype(np.float32)).select(keep)


def test_floor_behind_an_open_door_counts_where_it_is_measured():
    x, y, _ = reconstruct(open_door()).surface.xyz.T
    behind = x > 3.55
    assert 4.5 < x.max() < 5.0
    assert np.abs(y[behind] / x[behind]).max() < 0.5 / 3.4 + np.radians(2 * COLUMN_DEG)


def one_behind_the_door(lift, *at):
    """What is floor of the given returns behind an open door, if no others lie there."""
    view = open_door()
    view = view.select(view.xyz[:, 0] < 3.41)
    places = rooms.view_of([(x, y, -0.7 + lift) for x, y in at], 15.0, 0)
    return reconstruct(rooms.joined(view, places)).labels[len(view.xyz) :] == Label.GROUND


def test_few_returns_behind_a_door_are_floor_where_the_cells_around_them_are():
    cells = [(4.1, 0.1), (4.3, 0.1), (4.1, 0.3)]  # one in each of three cells of 0.2 m that touch
    assert one_behind_the_door(0.0, *cells).all()
    assert not one_behind_the_door(0.0, (4.1, 0.1), (4.5, 0.1), (4.9, 0.1)).any()
    assert not one_behind_the_door(-0.02, *cells).any()  # a terrace 2 cm lower


def test_one_ring_on_a_far_wall_is_no_floor_behind_a_door():
    at = [(7.0, 0.15 * k) for k in range(-3, 4)]  # one or two columns to a cell
    rows = [(x, y, -0.7 + lift) for x, y in at for lift in (0.0, 0.3, 0.5, 0.7, 0.9)]
    view = open_door()
    view = view.select(view.xyz[:, 0] < 3.41)
    found = reconstruct(rooms.joined(view, rooms.view_of(rows, 60.0, 0)))
    assert not np.any(found.labels[len(view.xyz) :] == Label.GROUND)


def behind_a_window(floor_from, floor_to):
    """What a sensor that looks up by 15 deg at most claims behind a window of 2 m in the wall x =
    3.4: a facade at x = 9 is seen through it, and level floor between two places."""
    elevations = np.linspace(-25.0, 15.0, 40)
    view = rooms.box_room(WALLS, 1.9, -0.7, elevations, 0.4)[0]
    xyz = view.xyz.astype(np.float64)
    through = np.isclose(xyz[:, 0], 3.4, atol=1e-3) & (np.abs(xyz[:, 1]) < 1.0)
    facade = xyz * (9.0 / np.where(through, xyz[:, 0], 1.0))[:, None]
    ground = xyz * (-0.7 / np.where(xyz[:, 2] < 0.0, xyz[:, 2], 1.0))[:, None]
    on_ground = through & (xyz[:, 2] < 0.0) & (ground[:, 0] < 9.0)
    xyz[through & ~on_ground] = facade[through & ~on_ground]
    xyz[on_ground] = ground[on_ground]
    keep = ~on_ground | ((xyz[:, 0] > floor_from) & (xyz[:, 0] < floor_to))
    view = view._replace(xyz=xyz.astype(np.float32)).select(keep)
    return reconstruct(view).surface.xyz[:, 0].max()


def test_a_facade_behind_a_window_whose_top_is_out_of_view_bounds_no_floor():
    assert behind_a_window(0.0, 0.0) < 3.4
    # Floor measured on the far side shows a doorway into another room.
    assert behind_a_window(3.4, 9.0) == pytest.approx(9.0, abs=0.05)


def between_desks(height):
    """What a sensor that looks up by 15 deg at most claims ahead: the wall x = 6 shows between two
    things of a height, in line at x = 2.4 and 1 m apart; smoke hides all else behind them."""
    view = rooms.box_room((6.0, 3.0, -3.4, -3.0), 1.9, -0.7, np.linspace(-25.0, 15.0, 40), 0.4)[0]
    xyz = view.xyz.astype(np.float64)
    x, y, z = xyz.T
    front = xyz * (2.4 / np.where(x > 2.4, x, 1.0))[:, None]
    behind, aside = x > 2.4, np.abs(front[:, 1])
    blocked = behind & (aside > 0.5) & (aside < 1.6) & (front[:, 2] < height - 0.7)
    xyz[blocked] = front[blocked]
    is_floor = z < -0.69
    keep = ~behind | blocked | ((aside <= 0.5) & ~is_floor)
    surface = reconstruct(view._replace(xyz=xyz.astype(np.float32)).select(keep)).surface
    x, y, _ = surface.xyz.T
    return x[np.abs(y) < 0.15 * x].max()


def test_desks_in_line_are_no_wall_with_a_window():
    assert between_desks(0.65) == pytest.approx(6.0, abs=0.05)
    assert between_desks(2.0) < 2.4


@pytest.mark.parametrize("seed", range(4))
def test_no_floor_is_claimed_behind_glass(seed):
    surface = reconstruct(rooms.glass_front(0.005, seed)).surface
    assert 3.15 < surface.xyz[:, 0].max() < 3.21


def test_the_foot_of_a_house_behind_glass_is_no_floor():
    """A ring meets the facade where the room's own floor would."""
    at_the_foot = np.degrees(np.arctan2(-0.7, 11.2)) + np.array([-0.02, 0.0, 0.02])
    rings = np.append(rooms.GLASS_FRONT_RINGS, at_the_foot)
    surface = reconstruct(rooms.glass_front(0.005, 1, rings)).surface
    assert surface.xyz[:, 0].max() < 3.21


def test_a_level_that_each_column_shows_at_one_range_is_no_ceiling():
    column = np.repeat(np.arange(300), 2)
    height = np.full(600, 1.9)
    assert ceiling_height(height, np.full(600, 3.0), column) == np.inf
    assert ceiling_height(height, np.tile([2.0, 3.0], 300), column) == pytest.approx(1.9)


# --- the floor that comes out -------------------------------------------------------------------


def test_floor_of_a_room_is_whole_and_ends_at_the_walls():
    surface = reconstruct(room_scan(noise=0.01)).surface
    x, y, z = surface.xyz.T
    assert np.abs(x).max() < 3.41 and np.abs(y).max() < 3.01
    np.testing.assert_allclose(z[surface.provenance == 1], -0.7, atol=3e-3)
    cells = set(zip(np.floor(x / 0.1).astype(int), np.floor(y / 0.1).astype(int)))
    wanted = {(i, j) for i in range(-34, 34) for j in range(-30, 30)}
    assert len(wanted - cells) == 0
    assert np.all(np.diff(surface.provenance.astype(int)) >= 0)
    assert np.all(surface.intensity[surface.provenance == 1] == 0.0)


def test_reconstructed_points_carry_the_ring_whose_beam_they_lie_on():
    surface = reconstruct(room_scan()).surface
    x, y, z = surface.xyz[surface.provenance == 1].astype(np.float64).T
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
    expected = np.abs(elevation[:, None] - ELEVATIONS_DEG).argmin(axis=1)
    off = np.abs(surface.ring[surface.provenance == 1].astype(int) - expected)
    assert off.max() <= 1  # halfway between two beams rounds either way


def test_outline_has_the_area_of_the_room():
    boundary = reconstruct(room_scan()).surface.boundary.astype(np.float64)
    x, y = boundary[:, 0], boundary[:, 1]
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(6.8 * 6.0, rel=0.01)  # positive: counter-clockwise


def test_the_scale_of_intensities_does_not_matter():
    view = rooms.joined(room_scan(), rooms.smoke_ball(3000, seed=5))
    answer = reconstruct(view)
    scaled = reconstruct(view._replace(intensity=(view.intensity / 64).astype(np.float32)))
    np.testing.assert_array_equal(answer.surface.xyz, scaled.surface.xyz)
    np.testing.assert_array_equal(answer.labels, scaled.labels)


def test_a_tilted_sensor_sees_the_same_room():
    view = room_scan()
    R = rooms.tilt(2.0, -3.0)  # level from sensor
    tilted = view._replace(xyz=(view.xyz.astype(np.float64) @ R).astype(np.float32))
    for mounting in (Mounting(R, 0.7), Mounting()):
        found = reconstruct(tilted, mounting)
        level = found.surface.xyz.astype(np.float64) @ R.T
        drawn = found.surface.provenance == 1
        np.testing.assert_allclose(level[drawn, 2], -0.7, atol=5e-3)
        assert 3.3 < level[:, 0].max() < 3.42 and 2.9 < level[:, 1].max() < 3.02
        normal = np.append(-found.surface.floor_plane[:2], 1.0)
        np.testing.assert_allclose(R @ normal / np.linalg.norm(normal), [0, 0, 1], atol=2e-3)


def shuffled(view):
    order = np.random.default_rng(3).permutation(len(view.xyz))
    first, second = reconstruct(view), reconstruct(view.select(order))
    return first, second, order


def test_order_of_points_does_not_matter():
    view = room_scan(noise=0.01)
    first, second, order = shuffled(view.select(slice(0, None, 13)))
    np.testing.assert_array_equal(first.labels[order], second.labels)
    np.testing.assert_allclose(first.profile.distance, second.profile.distance, atol=1e-6)


def test_order_changes_samples_of_large_scans_alone():
    first, second, order = shuffled(room_scan(noise=0.01))
    assert np.mean(first.labels[order] != second.labels) < 1e-4
    np.testing.assert_allclose(first.profile.distance, second.profile.distance, atol=1e-3)
    np.testing.assert_allclose(first.floor.plane, second.floor.plane, atol=1e-3)


@pytest.mark.parametrize("count", [0, 1, 30])
def test_few_points_claim_nothing(count):
    view = room_scan().select(slice(0, count))
    found = reconstruct(view)
    assert len(found.labels) == count
    assert len(found.surface) <= count and np.all(found.surface.provenance == 0)


def test_oddities_of_drivers_are_no_error():
    for seed in range(4):
        view = rooms.seeded_cloud(seed)
        found = reconstruct(view)
        bad = ~np.isfinite(view.xyz).all(axis=1)
        assert np.all(found.labels[bad] == Label.INVALID)
        assert np.isfinite(found.surface.xyz).all()


# --- the pipeline --------------------------------------------------------------------------------


def test_pipeline_runs_it():
    params = Params.from_dict({"reconstructor": {"method": "room_boundary"}})
    view = room_scan()
    result = Pipeline(params, engine="python").process(*view)
    assert set(np.unique(result.labels)) <= {Label.KEPT, Label.NOISE, Label.GROUND, Label.WALL}
    assert np.count_nonzero(result.labels == Label.WALL) > 10000
    assert {-1, 0, 100} == set(np.unique(result.occupancy.cells).tolist())
    assert isinstance(view, ScanView)
