"""Simulated bags, sequences, overlays and the command line."""

from dataclasses import replace

import numpy as np
import pytest

from simulation_rooms import write_scene

pytest.importorskip("smoke_ground_reconstruction._core")
from smoke_ground_reconstruction import cli  # noqa: E402
from smoke_ground_reconstruction import simulation as sim  # noqa: E402
from smoke_ground_reconstruction.io import files  # noqa: E402
from smoke_ground_reconstruction.io.clouds import LidarScan  # noqa: E402
from smoke_ground_reconstruction.simulation import overlay, sequence  # noqa: E402

SMOKE = sim.Smoke(mean_extinction=0.3)


@pytest.fixture(autouse=True)
def _cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("SMOKE_GROUND_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


@pytest.fixture(scope="module")
def qt128():
    return sim.load_sensor("qt128")


@pytest.fixture(scope="module")
def vlp16():
    return sim.load_sensor("vlp16")


@pytest.fixture()
def bags():
    pytest.importorskip("rosbag")
    from smoke_ground_reconstruction.simulation import bags

    return bags


# --- driver layouts ---------------------------------------------------------------------------


def test_a_hesai_cloud_has_a_slot_for_each_channel_of_each_step(bags, qt128):
    scan = sim.simulate(sim.load_scene("empty_room"), qt128, smoke=SMOKE)
    message, truth = bags.cloud_message(qt128, scan, "last")
    assert (message.height, message.width, message.point_step) == (1, 115_200, 26)
    assert [(f.name, f.offset, f.datatype) for f in message.fields] == [
        ("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4),
        ("timestamp", 18, 8),
    ]  # fmt: skip
    assert len(message.data) == message.row_step == 26 * 115_200
    points = np.frombuffer(message.data, dtype=bags.point_dtype("hesai"))
    assert np.array_equal(points["ring"], np.tile(np.arange(128), 900))
    returned = points["x"] ** 2 + points["y"] ** 2 + points["z"] ** 2 > 0
    assert np.count_nonzero(returned) == len(scan)
    # even steps fire channels 1-32, odd ones 33-64
    ring, step = points["ring"], np.repeat(np.arange(900), 128)
    assert not returned[(step % 2 == 0) & (ring >= 32) & (ring < 64)].any()
    assert not returned[(step % 2 == 1) & (ring < 32)].any()
    order = np.lexsort((scan.ring, scan.step))
    assert np.array_equal(points["x"][returned], scan.xyz[order, 0])
    assert np.array_equal(truth[returned], scan.truth[order])
    assert not truth[~returned].any()
    stamp = message.header.stamp.to_sec()
    assert points["timestamp"][0] == pytest.approx(stamp, abs=1e-6)
    assert points["timestamp"][-1] - stamp == pytest.approx(0.1 * 899 / 900, abs=1e-6)


def test_a_dual_cloud_has_two_blocks_and_repeats_lone_returns(bags, qt128):
    scan = sim.simulate(sim.load_scene("empty_room"), qt128, smoke=SMOKE, mode="dual")
    points, truth = bags.driver_points(qt128, scan, "dual")
    assert len(points) == 230_400
    blocks = points.reshape(900, 2, 128)
    classes = truth.reshape(900, 2, 128)
    first, second = blocks[:, 0], blocks[:, 1]
    ranges = [
        np.sqrt(b["x"].astype(float) ** 2 + b["y"] ** 2 + b["z"] ** 2) for b in (first, second)
    ]
    assert np.array_equal(ranges[0] > 0, ranges[1] > 0)
    lone = first == second
    two = ~lone & (ranges[0] > 0)
    assert np.count_nonzero(two) > 1000
    assert (classes[:, 0][two] == sim.Truth.SMOKE).all()
    assert (classes[:, 1][two] != sim.Truth.SMOKE).all()


def test_velodyne_and_ouster_clouds_have_their_drivers_layout(bags, vlp16):
    scene = sim.load_scene("empty_room")
    scan = sim.simulate(scene, vlp16)
    message, _ = bags.cloud_message(vlp16, scan, "strongest")
    assert (message.point_step, message.width) == (22, len(scan))
    os0 = sim.load_sensor("os0_128")
    scan = sim.simulate(scene, os0)
    message, truth = bags.cloud_message(os0, scan, "strongest")
    assert (message.point_step, message.height, message.width) == (48, 128, 1024)
    points = np.frombuffer(message.data, dtype=bags.point_dtype("ouster"))
    metres = np.sqrt(points["x"].astype(float) ** 2 + points["y"] ** 2 + points["z"] ** 2)
    assert np.abs(points["range"] / 1000 - metres).max() < 6e-4
    assert np.array_equal(points["ring"].reshape(128, 1024)[:, 0], np.arange(128))
    assert np.count_nonzero(truth) == len(scan)


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0, 180.0, -120.0])
def test_quaternions_turn_as_their_matrices(bags, turn):
    from smoke_ground_reconstruction.simulation.geometry import rotation

    for R in (rotation(turn), rotation(turn, 10, 20), rotation(0, turn if abs(turn) < 90 else 0),
              rotation(0, 0, turn)):  # fmt: skip
        w, x, y, z = bags.quaternion(R)
        back = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        assert np.allclose(back, R, atol=1e-7)  # roots of rounded zeros


# --- sequences --------------------------------------------------------------------------------


def test_a_course_drives_its_legs_and_turns_between_them(tmp_path):
    drive = {"points": [[1, 1], [3, 1], [3, 3]], "speed": 0.5, "height": 0.6}
    course = sequence.Course(sim.load_scene(write_scene(tmp_path, drive=drive)).drive)
    turn = (np.pi / 2) / sequence.TURN_RATE
    assert course.duration == pytest.approx(4.0 + turn + 4.0)
    places, headings = course.at([0.0, 2.0, 4.0 + turn / 2, 4.0 + turn + 2.0, 99.0])
    assert np.allclose(places, [[1, 1], [2, 1], [3, 1], [3, 2], [3, 3]])
    assert np.allclose(headings, [0, 0, np.pi / 4, np.pi / 2, np.pi / 2])


def test_tf_and_clouds_agree_where_the_walls_are(bags, qt128, tmp_path):
    import rosbag

    drive = {"points": [[2, 2], [5, 2]], "speed": 1.0, "height": 0.6}
    scene = sim.load_scene(write_scene(tmp_path, drive=drive))
    path = str(tmp_path / "drive.bag")
    with bags.SequenceWriter(path, qt128, "last") as writer:
        for step in sequence.drive_through(scene, qt128, 0.3):
            writer.add(step)
        writer.close_tf(step)
    with rosbag.Bag(path) as bag:
        messages = list(bag.read_messages())
    clouds = [m for topic, m, _ in messages if topic == "/lidar_points"]
    tf = [m.transforms for topic, m, _ in messages if topic == "/tf"]
    assert len(clouds) == 3 and len(tf) == 3 * bags.TF_PER_SCAN + 1
    assert {(t.header.frame_id, t.child_frame_id) for pair in tf for t in pair} == {
        ("odom", "base_link"), ("base_link", "hesai_lidar"),
    }  # fmt: skip
    stamps = [pair[0].header.stamp.to_sec() for pair in tf]
    assert stamps == sorted(stamps)
    assert stamps[-1] >= clouds[-1].header.stamp.to_sec() + 0.0999
    points = np.frombuffer(clouds[2].data, dtype=bags.point_dtype("hesai"))
    points = points[points["x"] ** 2 + points["y"] ** 2 > 0]
    # Hesai's y looks forward, along the world's x: the wall x = 6 from a robot that started at 2
    ahead = (points["y"] > 3) & (np.abs(points["x"]) < 1) & (np.abs(points["z"]) < 0.3)
    robot_x = 2.0 + points["timestamp"][ahead] - 1e-9 * bags.START_NS
    assert np.count_nonzero(ahead) > 100
    assert np.abs(robot_x + points["y"][ahead] - 6.0).mean() < 0.02


def test_scans_of_a_sequence_share_the_smoke_and_differ_in_noise(qt128, tmp_path):
    scene = sim.load_scene(write_scene(tmp_path))
    smoke = replace(SMOKE, drift=(0.0, 0.0, 0.0))
    first, second = (s.scan for s in sequence.stand_still(scene, qt128, 0, 0.2, smoke, seed=3))
    assert second.stamp == pytest.approx(0.1)
    assert not np.array_equal(first.xyz, second.xyz)
    alone = sim.simulate(scene, qt128, 0, smoke, seed=3)
    assert np.array_equal(first.xyz, alone.xyz)


def test_a_scene_without_a_drive_says_so(qt128, tmp_path):
    scene = sim.load_scene(write_scene(tmp_path))
    with pytest.raises(sim.SceneError, match="room.yaml: drive: is missing"):
        next(sequence.drive_through(scene, qt128, 1.0))


# --- smoke over recorded scans ----------------------------------------------------------------


def recorded_room(sensor, **changes):
    scan = sim.simulate(sim.load_scene("empty_room"), sensor, seed=4)
    kept = LidarScan(scan.xyz, scan.intensity, scan.ring, scan.t)
    return overlay.RecordedScan.of(replace(kept, **changes), 0.7), scan


def test_no_smoke_leaves_a_recorded_scan_as_it_was(qt128):
    recorded, scan = recorded_room(qt128)
    result = overlay.overlay(recorded, qt128, SMOKE.with_extinction(0.0))
    # detection was already thrown once: at least 2 sigma above the limit, 97.7 % and more stay
    assert len(result["xyz"]) > 0.99 * len(scan)
    kept = np.isin(scan.step.astype(int) * 128 + scan.ring, _beams(result, qt128))
    assert np.allclose(result["xyz"], scan.xyz[kept], atol=1e-6)
    assert np.array_equal(result["intensity"], scan.intensity[kept])


def _beams(result, sensor):
    step = np.round(result["t"].astype(float) * sensor.rate * sensor.steps).astype(int)
    return step * 128 + result["ring"]


@pytest.mark.parametrize("mode", ["last", "strongest"])
def test_the_share_of_floor_returns_that_survives_is_the_one_asked_for(qt128, mode):
    recorded, _ = recorded_room(qt128)
    extinction = overlay.extinction_for_survival(recorded, qt128, SMOKE, 0.66, mode=mode)
    result = overlay.overlay(recorded, qt128, SMOKE.with_extinction(extinction), mode=mode)
    floor = np.count_nonzero(result["truth"] == sim.Truth.FLOOR)
    assert floor / np.count_nonzero(recorded.is_floor) == pytest.approx(0.66, abs=0.01)


def test_the_share_of_floor_cells_that_survive_is_the_one_asked_for(qt128):
    """Far cells go first, and returns are dense near the sensor: more than three quarters of them
    are left in two thirds of the cells."""
    recorded, _ = recorded_room(qt128)
    extinction = overlay.extinction_for_survival(recorded, qt128, SMOKE, 0.66, cell=0.2)
    result = overlay.overlay(recorded, qt128, SMOKE.with_extinction(extinction))
    floor = result["xyz"][result["truth"] == sim.Truth.FLOOR]
    clear = (recorded.directions * recorded.ranges[:, None])[recorded.is_floor]
    left, all_cells = (len(np.unique(np.floor(xyz[:, :2] / 0.2), axis=0)) for xyz in (floor, clear))
    assert left / all_cells == pytest.approx(0.66, abs=0.02)
    assert len(floor) > 0.75 * len(clear)


def test_an_overlay_fades_as_beer_and_lambert_say(qt128):
    recorded, _ = recorded_room(qt128)
    smoke = replace(SMOKE, sigma_ln=0.0, mean_extinction=0.2)
    result = overlay.overlay(recorded, qt128, smoke, mode="last")
    hard = (result["truth"] != sim.Truth.SMOKE) & (result["intensity"] > 20)
    before = dict(zip(zip(np.round(recorded.t, 6), recorded.ring), recorded.intensity))
    clear = np.array([before[key] for key in zip(np.round(result["t"], 6), result["ring"])])
    distance = np.linalg.norm(result["xyz"].astype(float), axis=1)
    ratio = (result["intensity"] / clear)[hard] / np.exp(-0.4 * distance[hard])
    assert ratio == pytest.approx(1.0, abs=0.026)  # 0.5 of 20: rounding


def test_the_floor_of_a_recorded_scan_is_found(qt128):
    recorded, scan = recorded_room(qt128)
    is_floor = scan.truth == sim.Truth.FLOOR
    assert (recorded.is_floor[is_floor]).mean() > 0.999
    # walls have their lowest 5 cm within the band
    assert np.count_nonzero(recorded.is_floor & ~is_floor) < 0.05 * np.count_nonzero(is_floor)


def test_an_overlay_refuses_what_it_cannot_do(qt128):
    recorded, scan = recorded_room(qt128)
    with pytest.raises(ValueError, match="survival must lie between 0 and 1"):
        overlay.extinction_for_survival(recorded, qt128, SMOKE, 1.0)
    empty = LidarScan(np.zeros((5, 3), np.float32), np.zeros(5, np.float32), np.zeros(5, np.uint16))
    with pytest.raises(ValueError, match="holds no return"):
        overlay.RecordedScan.of(empty, 0.7)
    kept = LidarScan(scan.xyz, scan.intensity, scan.ring)
    with pytest.raises(ValueError, match="fewer than 100 returns lie on a floor 1.9 m below"):
        overlay.RecordedScan.of(kept, 1.9)


# --- the command line -------------------------------------------------------------------------


def run(*arguments):
    return cli.main(["simulate", *map(str, arguments)])


def test_simulate_writes_a_scan_with_its_truth(tmp_path):
    path = tmp_path / "scan.npz"
    assert run("empty_room", path, "--sensor", "vlp16", "--extinction", 0.2, "--seed", 3) == 0
    with np.load(path) as stored:
        scene, sensor = sim.load_scene("empty_room"), sim.load_sensor("vlp16")
        smoke = sim.Smoke.of_scene(scene, mean_extinction=0.2)
        scan = sim.simulate(scene, sensor, 0, smoke, 3)
        assert np.array_equal(stored["x"], scan.xyz[:, 0])
        assert np.array_equal(stored["truth"], scan.truth)
        assert stored["sensor_height"] == 0.7
    (read,) = files.open_scans(str(path))
    assert np.array_equal(read.xyz, scan.xyz)


def test_simulate_writes_pcd_and_bag(tmp_path):
    pytest.importorskip("rosbag")
    truth = tmp_path / "truth.npz"
    assert run("empty_room", tmp_path / "a.pcd", "--sensor", "vlp16", "--level", "clear") == 0
    assert run("empty_room", tmp_path / "a.bag", "--level", "clear", "--sequence", 0.2,
               "--truth", truth) == 0  # fmt: skip
    (read,) = files.open_scans(str(tmp_path / "a.pcd"))
    scans = list(files.open_scans(str(tmp_path / "a.bag")))
    assert len(read.xyz) > 20_000
    assert len(scans) == 2 and scans[0].frame_id == "hesai_lidar"
    with np.load(truth) as stored:
        assert stored["stamp_ns"].tolist() == [scan.stamp_ns for scan in scans]
        assert stored["points"].tolist() == [115_200, 115_200]
        returned = np.any(scans[0].xyz != 0, axis=1)
        assert (stored["truth"][:115_200] > 0).sum() == returned.sum()


def test_simulate_lays_smoke_over_a_scan(tmp_path, capsys):
    clear, smoky = tmp_path / "clear.npz", tmp_path / "smoky.npz"
    assert run("empty_room", clear, "--level", "clear") == 0
    assert run(smoky, "--overlay", clear, "--survival", 0.4, "--sensor-height", 0.7) == 0
    assert "floor returns survive (4" in capsys.readouterr().err
    with np.load(smoky) as stored:
        assert (stored["truth"] == sim.Truth.SMOKE).sum() > 1000


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["nowhere", "a.npz"], "nowhere: no such scene"),
        (["empty_room", "a.txt"], "the ending must be one of"),
        (["a.npz"], "give either SCENE OUTPUT, or --overlay"),
        (["empty_room", "a.npz", "--pose", "x"], "no pose 'x'"),
        (["empty_room", "a.npz", "--height", "3"], "above the ceiling"),
        (["empty_room", "a.npz", "--sequence", "1"], "--sequence needs a .bag"),
        (["empty_room", "a.npz", "--truth", "t.npz"], "--truth needs a .bag"),
        (["empty_room", "a.npz", "--survival", ".5"], "--survival is for --overlay"),
        (["empty_room", "a.npz", "--extinction", "-1"], "--extinction must be at least 0"),
        (["empty_room", "a.npz", "--sensor", "x"], "x: no such sensor"),
        (["a.npz", "--overlay", "gone.npz"], "gone.npz: No such file"),
        (["a.npz", "--overlay", "gone.npz", "--level", "heavy"], "--level is for scenes"),
        (["a.bag", "--overlay", "gone.npz"], "--overlay writes .npz or .pcd"),
    ],
)
def test_mistakes_end_in_one_line(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert message in lines[-1], lines
    assert list(tmp_path.glob("a.*")) == []
