"""Scenes: points lie where their truth says, and every mistake is named."""

from dataclasses import replace

import numpy as np
import pytest

from simulation_rooms import BOX, write_scene

pytest.importorskip("smoke_ground_reconstruction._core")
from smoke_ground_reconstruction import simulation as sim  # noqa: E402
from smoke_ground_reconstruction.simulation.files import config_directory  # noqa: E402
from smoke_ground_reconstruction.simulation.scan import pose_matrix, simulate_moving  # noqa: E402

SQUARE = [[0, 0], [6, 0], [6, 5], [0, 5]]
POSE = {"name": "p", "at": [2.9, 2.4]}


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch):
    monkeypatch.setenv("SMOKE_GROUND_CACHE", "off")


def quiet(name):
    """A sensor without noise, range walk or rounding."""
    sensor = sim.load_sensor(name)
    still = {"range_noise": 0.0, "range_walk": 0.0, "range_unit": 0.0}
    return replace(sensor, receiver={**sensor.receiver, **still})


def in_world(scan):
    return scan.xyz.astype(np.float64) @ scan.pose[:3, :3].T + scan.pose[:3, 3]


@pytest.mark.parametrize("name", sim.scene_names())
def test_floor_points_lie_on_the_scenes_floor(name):
    scene = sim.load_scene(name)
    sensor = quiet("qt128")
    for pose in scene.poses:
        scan = sim.simulate(scene, sensor, pose)
        points = in_world(scan)
        floor = points[scan.truth == sim.Truth.FLOOR]
        assert len(floor) > 3000
        assert scene.is_floor(floor[:, :2]).mean() > 0.999  # float32 rounds across an edge
        assert np.abs(floor[:, 2] - scene.floor_z(floor[:, :2])).max() < 1e-5
        ceiling = points[scan.truth == sim.Truth.CEILING]
        assert np.allclose(ceiling[:, 2], scene.ceiling, atol=1e-5)


def test_a_patch_may_rise_from_below_the_floor_to_above_it(tmp_path):
    tilted = {"polygon": [[3.5, 1], [5.5, 1], [5.5, 4], [3.5, 4]], "plane": [0.1, 0, -0.45]}
    scene = sim.load_scene(write_scene(tmp_path, floor={"patches": [tilted]}))
    scan = sim.simulate(scene, quiet("raster128"))
    points = in_world(scan)
    floor = points[scan.truth == sim.Truth.FLOOR]
    assert np.abs(floor[:, 2] - scene.floor_z(floor[:, :2])).max() < 1e-5
    assert np.isfinite(sim.expect(scene, quiet("raster128"), 0)["range"]).all()  # no gaps
    # seen from within, the side y = 1 shows where the patch lies lower than the floor: x < 4.5
    risers = points[(scan.truth == sim.Truth.WALL) & (points[:, 0] < 5.9)]
    side = risers[np.abs(risers[:, 1] - 1.0) < 1e-4]
    assert len(side) > 10 and (side[:, 0] < 4.5).all()
    assert (side[:, 2] < 1e-5).all() and (side[:, 2] > 0.1 * side[:, 0] - 0.45 - 1e-5).all()


def test_every_beam_of_a_closed_room_meets_something():
    scene, sensor = sim.load_scene("empty_room"), quiet("qt128")
    met = sim.expect(scene, sensor, 0)["range"]
    assert np.isfinite(met).all()
    assert len(met) == 86_400


def test_a_pose_tilts_and_turns_the_sensor_frame():
    scene, sensor = sim.load_scene("tilted_sensor"), quiet("raster128")
    scan = sim.simulate(scene, sensor, "nose_down")
    floor = scan.truth == sim.Truth.FLOOR
    assert np.allclose(scan.level_xyz[floor, 2], -0.7, atol=1e-5)
    ahead = floor & (np.abs(scan.xyz[:, 1]) < 0.02) & (scan.xyz[:, 0] > 0)
    # 3 deg nose down: straight ahead the level floor rises in the sensor's own frame
    expected = -0.7 / np.cos(np.radians(3)) + np.tan(np.radians(3)) * scan.xyz[ahead, 0]
    assert np.allclose(scan.xyz[ahead, 2], expected, atol=1e-4)


def test_a_person_walks_on_between_scans_and_within_one(tmp_path):
    people = [{"path": [[1.0, 4.0], [5.0, 4.0]], "speed": 2.0}]
    scene = sim.load_scene(write_scene(tmp_path, people=people))
    sensor = quiet("raster128")
    assert np.allclose(scene.people[0].motion(1.0)[0], [3.0, 4.0])
    assert np.allclose(scene.people[0].motion(3.0)[0], [3.0, 4.0])  # on the way back
    assert np.allclose(scene.people[0].motion(3.0)[1], [-2.0, 0.0])
    for stamp in (0.5, 1.5):
        scan = sim.simulate(scene, sensor, stamp=stamp)
        points = in_world(scan)
        trunk = (scan.truth == sim.Truth.PERSON) & (points[:, 2] > 0.9) & (points[:, 2] < 1.4)
        middle = 1.0 + 2.0 * (stamp + scan.t[trunk].astype(float))
        radius = np.hypot(points[trunk, 0] - middle, points[trunk, 1] - 4.0)
        assert np.count_nonzero(trunk) > 100
        assert radius.min() > 0.219 and radius.max() < 0.225  # a 20-gon about 0.22 m


def test_the_robots_body_turns_with_the_sensor(tmp_path):
    robot = [{"type": "box", "at": [0.3, 0.0], "size": [0.1, 0.1, 0.3], "lift": 0.1}]
    scene = sim.load_scene(write_scene(tmp_path, robot=robot))
    for yaw in (0.0, 90.0):
        pose = sim.Pose("p", (2.9, 2.4), 0.7, yaw_deg=yaw)
        scan = sim.simulate(scene, quiet("raster128"), pose)
        body = scan.xyz[scan.truth == sim.Truth.ROBOT]
        assert len(body) > 50
        assert body[:, 0].min() > 0.24 and body[:, 0].max() < 0.36
        assert np.abs(body[:, 1]).max() < 0.06


def test_glass_is_seen_head_on_and_looked_through_elsewhere():
    scene, sensor = sim.load_scene("windows"), quiet("qt128")
    scan = sim.simulate(scene, sensor)
    points = in_world(scan)
    glass = points[scan.truth == sim.Truth.GLASS]
    assert len(glass) > 5
    assert np.allclose(glass[:, 0], 6.5, atol=1e-5)
    cone = np.radians(7) * 3.2  # half angle of the mirror's cone, with a margin, at 3.2 m
    assert np.abs(glass[:, 1] - 2.3).max() < cone
    beyond = points[:, 0] > 6.6
    assert np.count_nonzero(beyond & (scan.truth == sim.Truth.DROP)) > 50
    assert np.count_nonzero(beyond & (scan.truth == sim.Truth.FLOOR)) == 0


def test_motion_within_the_scan_bends_a_wall():
    scene, sensor = sim.load_scene("empty_room"), quiet("raster128")
    start = pose_matrix(scene, scene.pose(0))
    poses = np.tile(start, (sensor.steps, 1, 1))
    poses[:, 0, 3] += 0.1 * np.arange(sensor.steps) / sensor.steps  # 1 m/s along x
    scan = simulate_moving(scene, sensor, poses, 0.7)
    ahead = (scan.truth == sim.Truth.WALL) & (scan.xyz[:, 0] > 3.0) & (np.abs(scan.xyz[:, 1]) < 1)
    expected = 3.1 - 1.0 * scan.t[ahead]  # the wall x = 6 comes nearer while the sensor turns
    assert np.allclose(scan.xyz[ahead, 0], expected, atol=2e-4)


@pytest.mark.parametrize(
    "changes, key",
    [
        ({"room": {"outline": [[0, 0], [6, 5], [6, 0], [0, 5]]}}, "room.outline: edges"),
        ({"room": {"outline": [[0, 0], [6, 0]]}}, "room.outline: needs at least three"),
        ({"room": {"outline": [[0, 0], [6, 0], "x"]}}, "room.outline[2]: must be [x, y]"),
        ({"room": {"outline": SQUARE, "celing": 3}}, "room.celing: unknown key"),
        ({"room": {"outline": SQUARE, "ceiling": "high"}}, "room.ceiling: must be a number"),
        ({"rooms": {}}, "rooms: unknown key"),
        ({"poses": [{"name": "p", "at": [9, 9]}]}, "poses[0].at: the sensor stands outside"),
        ({"poses": [{"name": "p", "at": [5.97, 2]}]}, "poses[0].at: the sensor stands in a wall"),
        (
            {"poses": [{"name": "p", "at": [2, 2], "height": 9}]},
            "poses[0].at: the sensor stands above",
        ),
        ({"poses": [{"name": "p"}]}, "poses[0].at: is missing"),
        ({"poses": []}, "poses: a scene needs at least one"),
        ({"bounded": "yes"}, "bounded: must be true or false"),
        ({"objects": [{"type": "piano", "at": [1, 1]}]}, "objects[0].type: must be one of"),
        ({"objects": [{"type": "box", "at": [9, 1]}]}, "objects[0].at: (9, 1) lies outside"),
        (
            {"objects": [{"type": "box", "at": [2.9, 2.4], "size": [1, 1, 1]}]},
            "poses[0].at: the sensor stands inside objects[0] (box)",
        ),
        (
            {
                "floor": {
                    "patches": [
                        {"polygon": [[2, 2], [4, 2], [4, 3], [2, 3]], "z": -1, "drop": True}
                    ]
                }
            },
            "poses[0].at: the sensor stands over a hole",
        ),
        (
            {"floor": {"patches": [{"polygon": [[2, 2], [9, 2], [4, 3]], "z": -1}]}},
            "floor.patches[0].polygon: (9, 2) lies outside",
        ),
        (
            {"floor": {"patches": [{"polygon": [[4, 2], [5, 2], [5, 3]]}]}},
            "floor.patches[0].z: give",
        ),
        (
            {"room": {"outline": SQUARE, "openings": [{"edge": 7}]}},
            "room.openings[0].edge: must lie",
        ),
        ({"people": [{"path": [[1, 1], [9, 9]]}]}, "people[0].path: (9, 9) lies outside"),
        ({"drive": {"points": [[1, 1], [9, 9]]}}, "drive.points[1]: the sensor stands outside"),
    ],
)
def test_a_bad_scene_ends_in_one_line_that_names_file_and_key(tmp_path, changes, key):
    path = write_scene(tmp_path, "bad", **changes)
    with pytest.raises(sim.SceneError) as caught:
        sim.load_scene(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: {key}"), message
    assert "\n" not in message


def test_files_that_are_no_scenes_are_named(tmp_path):
    with pytest.raises(sim.SceneError, match="nowhere: no such scene .known: basic_room"):
        sim.load_scene("nowhere")
    with pytest.raises(sim.SceneError, match="gone.yaml: No such file"):
        sim.load_scene(tmp_path / "gone.yaml")
    broken = tmp_path / "broken.yaml"
    broken.write_text("room: [1, 2")
    with pytest.raises(sim.SceneError, match="broken.yaml: not YAML") as caught:
        sim.load_scene(broken)
    assert "\n" not in str(caught.value)


def test_a_scenes_pose_must_be_there():
    scene = sim.load_scene("basic_room")
    with pytest.raises(sim.SceneError, match="basic_room.yaml: poses: no pose 'x'"):
        scene.pose("x")


@pytest.mark.parametrize("name", sim.sensor_names())
def test_every_sensor_fires_each_of_its_rings(name):
    sensor = sim.load_sensor(name)
    scan = sim.simulate(sim.load_scene("empty_room"), sensor)
    # upper beams of a VLP-32C and the like may look over nothing: a closed room answers them all
    assert len(np.unique(scan.ring)) == sensor.rings
    assert scan.t.max() < 1 / sensor.rate


def test_a_bad_sensor_is_named(tmp_path):
    path = tmp_path / "bad.yaml"
    good = (config_directory() / "vlp16.yaml").read_text()
    for old, new, key in (
        ("azimuth_step_deg: 0.2", "azimuth_step_deg: 0.7", "azimuth_step_deg: 360 deg must hold"),
        ("clockwise: true", "clockwise: 3", "clockwise: must be true or false"),
        ("layout: velodyne", "layout: sick", "layout: must be one of"),
        ("rate: 10", "rate: 10\ncolour: red", "colour: unknown key"),
        ("[-15, 0]", "[-95, 0]", "rings: elevations"),
    ):
        assert old in good
        path.write_text(good.replace(old, new))
        with pytest.raises(sim.SceneError) as caught:
            sim.load_sensor(path)
        assert str(caught.value).startswith(f"{path}: {key}"), str(caught.value)


def test_box_is_a_good_scene(tmp_path):
    scene = sim.load_scene(write_scene(tmp_path))
    assert scene.bounded and scene.pose("centre").height == BOX["poses"][0]["height"]
