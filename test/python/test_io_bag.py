"""Bags are read scan by scan and keep stamps; a result bag holds what the nodelets publish."""

import tracemalloc
from pathlib import Path

import genpy
import numpy as np
import pytest
import rosbag
from sensor_msgs.msg import PointField
from std_msgs.msg import Header, String

from box_room import HEIGHT, box_room
from smoke_ground_reconstruction import Params, Pipeline, ros_messages
from smoke_ground_reconstruction.io import DataError, bag, files
from smoke_ground_reconstruction.io.clouds import floor_of_result

STAMPS = [(1_700_000_000, 123_456_789), (1_700_000_000, 223_456_780), (1_700_000_001, 1)]


def cloud(scan, stamp=STAMPS[0]):
    header = Header(stamp=genpy.Time(*stamp), frame_id="hesai_lidar")
    return ros_messages.scan_message(header, scan.xyz, scan.intensity, scan.ring, scan.t)


def write(path, messages):
    """A bag of (topic, message) in this order, a tenth of a second apart."""
    with rosbag.Bag(str(path), "w") as out:
        for number, (topic, message) in enumerate(messages):
            out.write(topic, message, genpy.Time(1_700_000_000 + number // 10, number % 10 * 10**8))
    return str(path)


@pytest.fixture(scope="module")
def room():
    return box_room(rings=48, steps=300)


@pytest.fixture
def three_scans(tmp_path, room):
    return write(tmp_path / "scans.bag", [("/points", cloud(room, stamp)) for stamp in STAMPS])


def test_scans_come_back_with_their_stamps(three_scans, room):
    scans = files.open_scans(three_scans)
    assert len(scans) == 3
    for scan, (seconds, nanoseconds) in zip(scans, STAMPS):
        assert scan.stamp_ns == seconds * 10**9 + nanoseconds
        assert scan.frame_id == "hesai_lidar"
        np.testing.assert_array_equal(scan.xyz, room.xyz)
        np.testing.assert_array_equal(scan.ring, room.ring)
        np.testing.assert_allclose(scan.t, room.t, atol=1e-7)
    (second,) = files.open_scans(three_scans, index=1)
    assert second.stamp_ns % 10**9 == STAMPS[1][1]


def test_scans_written_to_a_bag_are_read_again(tmp_path, room):
    path = str(tmp_path / "written.bag")
    files.write_scans(path, [room, room])
    for scan in files.open_scans(path):
        np.testing.assert_array_equal(scan.xyz, room.xyz)
        np.testing.assert_array_equal(scan.intensity, room.intensity)
        assert scan.stamp_ns == room.stamp_ns


@pytest.mark.parametrize(
    "name, datatype, values, seconds",
    [
        ("t", PointField.UINT32, [0, 50_000_000, 99_000_000], [0, 0.05, 0.099]),  # Ouster, ns
        ("time", PointField.FLOAT32, [-0.05, 0, 0.05], [0, 0.05, 0.1]),  # Velodyne, s
        ("timestamp", PointField.FLOAT64, [1.7e9, 1.7e9 + 0.5, 1.7e9 + 1], [0, 0.5, 1]),  # Hesai
    ],
)
def test_the_time_of_points_is_relative_and_in_seconds(tmp_path, name, datatype, values, seconds):
    three = np.ones((3, 3), np.float32)
    message = ros_messages.scan_message(Header(), three, np.ones(3), np.ones(3))
    types = {PointField.UINT32: "u4", PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}
    extra = {name: np.array(values, types[datatype])}
    message = ros_messages.select_points(message, np.ones(3, bool), extra)
    (scan,) = files.open_scans(write(tmp_path / "time.bag", [("/points", message)]))
    np.testing.assert_allclose(scan.t, seconds, atol=1e-6)


def test_a_long_bag_takes_the_memory_of_one_scan(tmp_path, room):
    path = write(tmp_path / "long.bag", [("/points", cloud(room))] * 60)
    size_of_scan = len(cloud(room).data)
    tracemalloc.start()
    assert sum(len(scan.xyz) > 0 for scan in files.open_scans(path)) == 60
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10 * size_of_scan


def test_one_of_several_topics_must_be_named(tmp_path, room):
    path = write(tmp_path / "two.bag", [("/a", cloud(room)), ("/b", cloud(room)), ("/c", String())])
    with pytest.raises(DataError, match=r"by --topic: /a \(1\), /b \(1\)"):
        files.open_scans(path)
    assert len(files.open_scans(path, topic="/b")) == 1
    assert len(files.open_scans(path, topic="b")) == 1
    with pytest.raises(DataError, match=r"no sensor_msgs/PointCloud2 on /c; it has /a \(1\), /b"):
        files.open_scans(path, topic="/c")


def test_bags_that_cannot_be_read_are_named(tmp_path, three_scans):
    with pytest.raises(DataError, match=r"no scan 3; /points has 0 to 2"):
        files.open_scans(three_scans, index=3)
    with pytest.raises(DataError, match="no sensor_msgs/PointCloud2 in it"):
        files.open_scans(write(tmp_path / "none.bag", [("/c", String())]))
    text = tmp_path / "text.bag"
    text.write_text("no bag at all\n")
    with pytest.raises(DataError, match="not a readable bag"):
        files.open_scans(str(text))
    (tmp_path / "cut.bag").write_bytes(Path(three_scans).read_bytes()[:-3000])
    with pytest.raises(DataError, match="rosbag reindex|not a readable bag"):
        files.open_scans(str(tmp_path / "cut.bag"))


def test_a_broken_cloud_is_named_with_its_number(tmp_path, room):
    broken = cloud(room)
    broken.data = broken.data[:-1]
    path = write(tmp_path / "broken.bag", [("/points", cloud(room)), ("/points", broken)])
    with pytest.raises(DataError, match=r"broken.bag: scan 1 of /points: data holds"):
        list(files.open_scans(path))


@pytest.fixture(scope="module")
def results(room):
    params = Params.from_dict({"reconstructor": {"sensor_height": HEIGHT}})
    return Pipeline(params, engine="python").process(room.xyz, room.intensity, room.ring)


def test_a_result_bag_holds_the_output_topics(tmp_path, three_scans, results):
    path = str(tmp_path / "result.bag")
    with bag.FloorWriter(path) as writer:
        for scan in files.open_scans(three_scans):
            writer.add_result(scan, results, HEIGHT)
    prefix = "/ground_reconstruction/"
    with rosbag.Bag(path) as written:
        topics = written.get_type_and_topic_info().topics
        assert {topic: (info.msg_type, info.message_count) for topic, info in topics.items()} == {
            prefix + "denoiser/denoised": ("sensor_msgs/PointCloud2", 3),
            prefix + "denoiser/noise": ("sensor_msgs/PointCloud2", 3),
            prefix + "segmenter/ground": ("sensor_msgs/PointCloud2", 3),
            prefix + "segmenter/walls": ("sensor_msgs/PointCloud2", 3),
            prefix + "reconstructor/ground_surface": ("sensor_msgs/PointCloud2", 3),
            prefix + "reconstructor/occupancy": ("nav_msgs/OccupancyGrid", 3),
            prefix + "reconstructor/boundary": ("smoke_ground_reconstruction/FloorBoundary", 3),
            prefix + "reconstructor/boundary_polygon": ("geometry_msgs/PolygonStamped", 3),
            prefix + "reconstructor/markers": ("visualization_msgs/MarkerArray", 3),
        }
        surface_topic = prefix + "reconstructor/ground_surface"
        stamps = [
            (m.header.stamp.secs, m.header.stamp.nsecs)
            for _, m, _ in written.read_messages(topics=[surface_topic])
        ]
    assert stamps == STAMPS


def test_rings_told_from_elevation_are_in_the_result(tmp_path, room, results, capsys):
    message = cloud(room)
    message.fields = [field for field in message.fields if field.name != "ring"]
    source = write(tmp_path / "no_ring.bag", [("/points", message), ("/points", message)])
    path = str(tmp_path / "result.bag")
    with bag.FloorWriter(path) as writer:
        for scan in files.open_scans(source):
            np.testing.assert_array_equal(scan.ring, room.ring)
            writer.add_result(scan, results, HEIGHT)
    assert capsys.readouterr().err.count("no field 'ring'") == 1
    with rosbag.Bag(path) as written:
        topic = "/ground_reconstruction/segmenter/walls"
        walls = [m for _, m, _ in written.read_messages(topics=[topic])][0]
    is_wall = results.clusters != 0xFFFFFFFF
    np.testing.assert_array_equal(ros_messages.read_cloud(walls).ring, room.ring[is_wall])


def test_floors_are_joined_by_stamp_whatever_the_order(tmp_path, room, results):
    path = str(tmp_path / "result.bag")
    with bag.FloorWriter(path) as writer:
        for seconds, nanoseconds in STAMPS:
            floor = floor_of_result(results, room)
            stamp_ns = seconds * 10**9 + nanoseconds
            writer.add_floor(type(floor)(**{**vars(floor), "stamp_ns": stamp_ns}))
    with rosbag.Bag(path) as written:
        messages = [(topic, message) for topic, message, _ in written.read_messages()]
    shuffled = [messages[i] for i in np.random.default_rng(3).permutation(len(messages))]
    floors = list(files.open_floors(write(tmp_path / "shuffled.bag", shuffled)))
    assert {f.stamp_ns for f in floors} == {s * 10**9 + n for s, n in STAMPS}
    for floor in floors:
        np.testing.assert_array_equal(floor.xyz, results.surface)
        np.testing.assert_array_equal(floor.provenance, results.provenance)
        np.testing.assert_array_equal(floor.boundary, results.boundary)
        np.testing.assert_array_equal(floor.boundary_kind, results.boundary_kind)
        assert len(floor.walls) == np.count_nonzero(results.clusters != 0xFFFFFFFF)


def test_scans_are_no_floors(three_scans):
    assert not files.holds_floors(three_scans)
    with pytest.raises(DataError, match=r"no topic .../reconstructor/ground_surface"):
        files.open_floors(three_scans)
