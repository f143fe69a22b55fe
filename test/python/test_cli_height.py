"""The sensor's height is told from the floor's returns, or refused; never guessed."""

import numpy as np
import pytest

import rooms
from box_room import box_room
from smoke_ground_reconstruction.height import HeightError, estimate_sensor_height


def tilted(xyz: np.ndarray, degrees: float) -> np.ndarray:
    """Turned about the y axis through the point of the floor below the sensor."""
    angle = np.radians(degrees)
    rotation = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    return xyz @ rotation.T


@pytest.mark.parametrize("height", [0.1, 0.3, 0.7, 1.25, 2.0])
def test_the_height_of_a_box_room_is_found(height):
    scan = box_room(half_x=4, half_y=3, height=height)
    noise = np.random.default_rng(1).normal(0, 0.005, (len(scan.xyz), 1))
    xyz = scan.xyz + noise * scan.xyz / np.linalg.norm(scan.xyz, axis=1, keepdims=True)
    assert estimate_sensor_height(xyz) == pytest.approx(height, abs=0.01)


def test_a_tilted_sensor_is_measured_straight_down_its_own_axis():
    scan = box_room(half_x=4, half_y=3)
    expected = 0.7 / np.cos(np.radians(2.0))
    assert estimate_sensor_height(tilted(scan.xyz, 2.0)) == pytest.approx(expected, abs=0.01)


def test_invalid_points_do_not_matter():
    scan = box_room()
    bad = np.array([[np.nan, 0, -1], [np.inf, 0, -1], [0, 0, 0]], np.float32)
    together = np.vstack([scan.xyz, np.repeat(bad, 1000, axis=0)])
    assert estimate_sensor_height(together) == pytest.approx(0.7, abs=0.01)


def test_a_few_reflections_below_the_floor_do_not_matter():
    scan = box_room(half_x=4, half_y=3)
    mirrored = scan.xyz[scan.xyz[:, 2] > 0.2][::50] * [1, 1, -1] - [0, 0, 1.4]
    estimate = estimate_sensor_height(np.vstack([scan.xyz, mirrored]))
    assert estimate == pytest.approx(0.7, abs=0.01)


def test_walls_without_a_floor_are_refused():
    xyz = box_room(rings=128).xyz
    with pytest.raises(HeightError):
        estimate_sensor_height(xyz[xyz[:, 2] > -0.65])


@pytest.mark.parametrize("radius", [1.0, 2.0, 4.0])
def test_a_ball_of_smoke_is_refused(radius):
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(50_000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    with pytest.raises(HeightError):
        estimate_sensor_height(direction * rng.uniform(0.2, radius, (50_000, 1)))


def test_a_table_above_the_floor_is_not_the_floor():
    scan = box_room(half_x=4, half_y=3, height=1.2)
    x, y = np.meshgrid(np.arange(-1.5, 1.5, 0.03), np.arange(-1.0, 1.0, 0.03))
    table = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -0.45)])
    assert estimate_sensor_height(np.vstack([scan.xyz, table])) == pytest.approx(1.2, abs=0.01)


def test_a_table_alone_is_refused_where_walls_go_below_it():
    scan = box_room(half_x=4, half_y=3, height=1.2)
    wall_only = scan.xyz[scan.xyz[:, 2] > -1.15]
    x, y = np.meshgrid(np.arange(-1.0, 1.0, 0.03), np.arange(-0.8, 0.8, 0.03))
    table = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -0.3)])
    with pytest.raises(HeightError):
        estimate_sensor_height(np.vstack([wall_only, table]))


def test_an_empty_scan_is_refused():
    with pytest.raises(HeightError, match="0 cells"):
        estimate_sensor_height(np.zeros((0, 3), np.float32))


def level_grid(half_x, half_y, z):
    x, y = np.meshgrid(np.arange(-half_x, half_x, 0.03), np.arange(-half_y, half_y, 0.03))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


def test_a_level_with_much_below_it_is_no_floor():
    y, z = np.meshgrid(np.arange(-1.0, 1.0, 0.03), np.arange(-0.95, -0.45, 0.01))
    wall = np.column_stack([np.full(y.size, 3.0), y.ravel(), z.ravel()])
    assert estimate_sensor_height(level_grid(1.5, 1.5, -0.3)) == pytest.approx(0.3, abs=0.01)
    with pytest.raises(HeightError, match="0.30 m below the sensor, is no floor"):
        estimate_sensor_height(np.vstack([level_grid(1.5, 1.5, -0.3), wall]))


def test_the_rings_of_a_coarse_sensor_on_the_walls_are_no_floor():
    # 16 rings 2 deg apart: the one below the horizon draws a nearly level curve on walls 6 m away,
    # with more cells than the one ring that smoke left on the floor.
    view, _ = rooms.box_room(
        walls=(6.0, 6.0, -6.0, -6.0),
        floor=-0.92,
        elevations_deg=np.linspace(-15.0, 15.0, 16),
        azimuth_step_deg=0.2,
    )
    x, y, z = view.xyz.T
    xyz = view.xyz[(z > -0.9) | (np.hypot(x, y) < 3.6)]
    assert estimate_sensor_height(xyz) == pytest.approx(0.92, abs=0.02)
