"""The true floor, cell by cell, against geometry worked out by hand."""

import math

import numpy as np
import pytest

from simulation_rooms import write_scene

pytest.importorskip("smoke_ground_reconstruction._core")
from smoke_ground_reconstruction import simulation as sim  # noqa: E402


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("SMOKE_GROUND_CACHE", "off")


@pytest.fixture(scope="module")
def sensor():
    return sim.load_sensor("qt128")


def centres(truth):
    x = truth.origin[0] + truth.cell * (np.arange(truth.shape[1]) + 0.5)
    y = truth.origin[1] + truth.cell * (np.arange(truth.shape[0]) + 0.5)
    return np.meshgrid(x, y)


@pytest.mark.parametrize("cell, columns, rows", [(0.2, 31, 25), (0.1, 60, 50)])
def test_a_box_is_counted_by_hand(tmp_path, sensor, cell, columns, rows):
    # x from -2.9 to 3.1, y from -2.4 to 2.6. 0.2 m: columns [-3.0, -2.8) .. [3.0, 3.2), rows
    # [-2.4, -2.2) .. [2.4, 2.6); 0.1 m: 60 and 50 whole cells
    truth = sim.floor_truth(sim.load_scene(write_scene(tmp_path)), sensor, 0, cell)
    visible_rows, visible_columns = np.nonzero(truth.visible_floor)
    assert np.ptp(visible_columns) + 1 == columns
    assert np.ptp(visible_rows) + 1 == rows
    assert np.count_nonzero(truth.visible_floor) == columns * rows
    assert not truth.out_of_sight.any() and not truth.hole.any() and not truth.edge_crossing.any()
    assert np.allclose(truth.floor_z[truth.visible_floor], -0.7)
    assert np.isnan(truth.floor_z[~truth.visible_floor]).all()
    assert truth.knowable.sum() == truth.visible_floor.sum()  # clear air


def test_the_grid_is_the_floor_and_a_margin(tmp_path, sensor):
    truth = sim.floor_truth(sim.load_scene(write_scene(tmp_path)), sensor, 0, 0.2)
    assert truth.origin == pytest.approx([-3.2, -2.8])  # -2.9 - 0.3 and -2.4 - 0.3, outwards
    assert truth.shape == (29, 33)  # up to 2.6 + 0.3 -> 3.0 and 3.1 + 0.3 -> 3.4
    assert truth.cells_of([[-3.19, -2.79], [3.39, 2.99], [3.41, 0.0]]).tolist() == [0, 956, -1]


def test_the_disc_under_the_sensor(tmp_path, sensor):
    truth = sim.floor_truth(sim.load_scene(write_scene(tmp_path)), sensor, 0, 0.1)
    x, y = centres(truth)
    radius = 0.7 / math.tan(math.radians(52.62676282)) + 0.1
    assert np.array_equal(truth.under_sensor, np.hypot(x, y) <= radius)


def test_round_the_corner_is_out_of_sight(sensor):
    # l_shape, from (4.8, 1.6): the inner corner (3.2, 3) hides what lies above the line through
    # it, y - 3 > (3 - 1.6) / (3.2 - 4.8) (x - 3.2) for x < 3.2
    scene = sim.load_scene("l_shape")
    truth = sim.floor_truth(scene, sensor, "long_arm", 0.1)
    x, y = centres(truth)
    world_x, world_y = 4.8 - x, 1.6 - y  # yaw 180 deg
    above = world_y - (3.0 - 0.875 * (world_x - 3.2))
    inside = scene.is_floor(np.column_stack([world_x.ravel(), world_y.ravel()])).reshape(x.shape)
    clear_cut = np.abs(above) > 0.15
    in_arm = inside & (world_x < 3.1) & clear_cut
    assert np.array_equal(truth.out_of_sight[in_arm], above[in_arm] > 0)
    assert np.array_equal(truth.visible_floor[in_arm], above[in_arm] < 0)


def test_furniture_does_not_hide_floor_but_pillars_do(tmp_path, sensor):
    box = [{"type": "box", "at": [4.5, 2.4], "size": [0.5, 2.0, 1.5]}]
    furnished = sim.floor_truth(sim.load_scene(write_scene(tmp_path, "a", objects=box)), sensor)
    assert not furnished.out_of_sight.any()
    pillar = {"polygon": [[4.25, 1.4], [4.75, 1.4], [4.75, 3.4], [4.25, 3.4]]}
    room = {"outline": [[0, 0], [6, 0], [6, 5], [0, 5]], "pillars": [pillar]}
    walled = sim.floor_truth(sim.load_scene(write_scene(tmp_path, "b", room=room)), sensor)
    x, y = centres(walled)
    behind = (x > 2.1) & (x < 2.9) & (np.abs(y) < 0.9)
    assert walled.out_of_sight[behind].all() and not walled.visible_floor[behind].any()
    within = (np.abs(x - 1.6) < 0.1) & (np.abs(y) < 0.8)  # in the pillar itself
    assert not walled.visible_floor[within].any() and not walled.out_of_sight[within].any()
    assert walled.wall[(np.abs(y) < 0.9) & (np.abs(x - 1.35) < 0.1)].any()


def test_a_pit_is_a_hole_with_a_rim(sensor):
    truth = sim.floor_truth(sim.load_scene("open_pit"), sensor, "before_the_pit", 0.1)
    x, y = centres(truth)  # the pit: x 1.6 .. 2.5, y -1.1 .. 1.3
    inside = (x > 1.6) & (x < 2.5) & (y > -1.1) & (y < 1.3)
    assert np.array_equal(truth.hole & ~truth.visible_floor, inside)
    rim = truth.hole_rim & ~truth.hole
    outside_x = np.maximum(np.maximum(1.6 - x, x - 2.5), 0)
    outside_y = np.maximum(np.maximum(-1.1 - y, y - 1.3), 0)
    distance = np.hypot(outside_x, outside_y)
    assert rim[(distance > 0) & (distance < 0.25) & truth.visible_floor].all()
    assert not rim[distance > 0.36].any()


def test_a_steps_edge_and_its_two_heights(sensor):
    truth = sim.floor_truth(sim.load_scene("step"), sensor, "below", 0.2)
    x, y = centres(truth)  # the edge: x = 2.2, on the border of two columns
    assert set(np.round(x[truth.edge_crossing], 3)) == {2.1, 2.3}
    lower, upper = truth.visible_floor & (x < 2.0), truth.visible_floor & (x > 2.4)
    assert np.allclose(truth.floor_z[lower], -0.7)
    assert np.allclose(truth.floor_z[upper], -0.55)


def test_a_tilted_floor_keeps_its_slope_in_the_level_frame(sensor):
    truth = sim.floor_truth(sim.load_scene("tilted_floor"), sensor, "middle", 0.2)
    x, y = centres(truth)
    whole = truth.visible_floor & (np.hypot(x, y) < 2.0)
    yaw = math.radians(30)
    downhill = math.cos(yaw) * x - math.sin(yaw) * y  # world x of the cell
    expected = -0.7 - math.tan(math.radians(3)) * downhill
    assert np.allclose(truth.floor_z[whole], expected[whole], atol=1e-5)


def test_thick_smoke_leaves_little_to_know(tmp_path, sensor):
    scene = sim.load_scene(write_scene(tmp_path))
    counts = []
    for extinction in (0.1, 0.6, 1.5, 6.0):
        smoke = sim.Smoke(mean_extinction=extinction, sigma_ln=0.0)
        truth = sim.floor_truth(scene, sensor, 0, 0.2, smoke)
        assert not (truth.knowable & ~truth.visible_floor).any()
        counts.append(int(truth.knowable.sum()))
    assert counts[0] == 31 * 25
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < 0.2 * counts[0]


def test_floor_before_an_unseen_wall_is_known_only_where_it_is_seen(tmp_path, sensor):
    """Homogeneous smoke, so that detection depends on range alone: a disc of seen floor."""
    scene = sim.load_scene(
        write_scene(
            tmp_path,
            room={"outline": [[-20, -20], [20, -20], [20, 20], [-20, 20]], "ceiling": 30.0},
        )
    )
    smoke = sim.Smoke(mean_extinction=0.5, sigma_ln=0.0)
    truth = sim.floor_truth(scene, sensor, 0, 0.2, smoke)
    x, y = centres(truth)
    # the wall is 17 m away or more: S = 6 (20/17)^2 exp(-17) is nothing. The floor: with
    # S = 140 / R^3 exp(-R), R = 2.9 m has S = 0.316, 4.6 sigma below
    assert not truth.knowable[np.hypot(x, y) > 3.2].any()
    assert truth.knowable[(np.hypot(x, y) < 1.5) & (np.hypot(x, y) > 0.8)].all()
