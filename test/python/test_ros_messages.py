"""PointCloud2 from and to NumPy; skipped where the package's messages are not built."""

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("smoke_ground_reconstruction.msg")
pytest.importorskip("rospy")
sys.path.append(str(Path(__file__).resolve().parents[1] / "nodelets"))

import genpy
from cloud_layouts import LAYOUTS, cloud_of
from std_msgs.msg import Header

from smoke_ground_reconstruction import ros_messages
from smoke_ground_reconstruction.reference.floor_surface import OccupancyGrid
from smoke_ground_reconstruction.reference.scan import Mounting

HEADER = Header(stamp=genpy.Time(7, 123456789), frame_id="lidar")
# Two rings of three points, 10 deg apart.
XYZ = np.array(
    [(4, 0, 0), (0, 4, 0), (-4, 0, 0), (4, 0, 0.705), (0, 4, 0.705), (-4, 0, 0.705)], np.float32
)
INTENSITY = np.array([1, 2, 3, 4, 5, 255], np.float32)
RING = np.array([0, 0, 0, 1, 1, 1], np.uint16)
# From (-1, -2) to (4, 3), 0.7 m below the sensor.
RECTANGLE = np.array([(-1, -2, -0.7), (4, -2, -0.7), (4, 3, -0.7), (-1, 3, -0.7)], np.float32)


def make_cloud(layout="hesai_ros2", **options):
    return cloud_of(layout, HEADER, XYZ, INTENSITY, RING, **options)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("rows, padding", [(1, 0), (2, 0), (3, 5)])
def test_every_layout_is_read(layout, rows, padding):
    cloud = ros_messages.read_cloud(make_cloud(layout, rows=rows, padding=padding))
    np.testing.assert_array_equal(cloud.xyz, XYZ)
    np.testing.assert_array_equal(cloud.intensity, INTENSITY)
    np.testing.assert_array_equal(cloud.ring, RING)
    assert cloud.has_ring == (layout != "rslidar_xyzi")
    assert (cloud.xyz.dtype, cloud.ring.dtype) == (np.float32, np.uint16)


def without(name):
    cloud = make_cloud()
    cloud.fields = [field for field in cloud.fields if field.name != name]
    return cloud


def changed(**changes):
    cloud = make_cloud()
    for name, value in changes.items():
        setattr(cloud, name, value)
    return cloud


def with_field(number, **changes):
    cloud = make_cloud()
    for name, value in changes.items():
        setattr(cloud.fields[number], name, value)
    return cloud


@pytest.mark.parametrize(
    "cloud, reason",
    [
        (without("x"), r"'x' of FLOAT32 or FLOAT64; fields: y FLOAT32 @4, z FLOAT32 @8, intens"),
        (without("intensity"), "no single field 'intensity' of numbers"),
        (changed(data=b"short"), r"data holds 5 bytes, height \* row_step asks 156"),
        (changed(row_step=155), r"row_step 155 is less than width \* point_step = 156"),
        (changed(point_step=0), "point_step is 0"),
        (changed(is_bigendian=True), "big-endian"),
        (changed(width=2**32 - 1, height=2**32 - 1), "row_step"),
        (with_field(0, offset=2**32 - 1), "field 'x' reaches beyond point_step 26"),
        (with_field(2, datatype=9), "field 'z' has unknown datatype 9"),
        (with_field(1, datatype=5), "no single field 'y'"),
        (with_field(0, count=3), r"x FLOAT32\[3\] @0"),
        (with_field(4, datatype=7), "no single field 'ring' of integers"),
    ],
)
def test_what_contradicts_itself_is_refused(cloud, reason):
    with pytest.raises(ros_messages.CloudError, match=reason):
        ros_messages.read_cloud(cloud)


def test_ring_outside_sixteen_bits_is_named():
    cloud = cloud_of("ring_i16", HEADER, XYZ, INTENSITY, np.array([0, 0, -1, 1, 1, 1]))
    with pytest.raises(ros_messages.CloudError, match="ring -1 of point 2"):
        ros_messages.read_cloud(cloud)


def test_empty_cloud_is_read_whatever_its_fields():
    cloud = ros_messages.read_cloud(changed(width=0, data=b"", fields=[]))
    assert cloud.xyz.shape == (0, 3)
    assert not cloud.has_ring


def test_selected_points_keep_header_fields_and_order():
    clusters = np.array([7, 8, 9, 10, 11, 12], np.uint32)
    which = np.array([False, True, False, False, True, False])
    cut = ros_messages.select_points(make_cloud(rows=2), which, {"cluster": clusters})
    assert cut.header == HEADER
    assert (cut.width, cut.height, cut.point_step) == (2, 1, 30)
    points = ros_messages.structured_points(cut)
    np.testing.assert_array_equal(points["timestamp"], [2, 5])  # numbers the points
    np.testing.assert_array_equal(points["cluster"], [8, 11])
    with pytest.raises(ros_messages.CloudError, match="'cluster' already"):
        ros_messages.select_points(cut, [True, True], {"cluster": clusters[:2]})
    assert ros_messages.select_points(make_cloud(), np.zeros(6, bool)).data == b""


def test_scan_message_is_read_back():
    times = np.arange(6, dtype=np.float32) / 10
    message = ros_messages.scan_message(HEADER, XYZ, INTENSITY, RING, times)
    cloud = ros_messages.read_cloud(message)
    np.testing.assert_array_equal(cloud.xyz, XYZ)
    np.testing.assert_array_equal(cloud.ring, RING)
    np.testing.assert_array_equal(ros_messages.structured_points(message)["t"], times)


def test_surface_message_has_the_agreed_layout():
    provenance = np.array([0, 1, 2, 0, 1, 2], np.uint8)
    confidence = np.linspace(0, 1, 6, dtype=np.float32)
    arrays = (XYZ, INTENSITY, RING, provenance, confidence)
    message = ros_messages.surface_message(HEADER, *arrays, np.full(6, 0.01, np.float32))
    assert ros_messages.describe_fields(message) == (
        "x FLOAT32 @0, y FLOAT32 @4, z FLOAT32 @8, intensity FLOAT32 @12, ring UINT16 @16, "
        "provenance UINT8 @18, confidence FLOAT32 @20, sigma FLOAT32 @24"
    )
    points = ros_messages.structured_points(message)
    assert points.dtype.itemsize == 28
    np.testing.assert_array_equal(points["provenance"], provenance)
    np.testing.assert_array_equal(points["confidence"], confidence)
    np.testing.assert_array_equal(points["sigma"], np.float32(0.01))
    unsaid = ros_messages.surface_message(HEADER, *arrays)
    assert np.isnan(ros_messages.structured_points(unsaid)["sigma"]).all()


def test_occupancy_turns_with_the_mounting():
    grid = OccupancyGrid(0.5, 4, 0, np.array([[0, 100, -1]], np.int8))
    level = ros_messages.occupancy_message(HEADER, grid, None, 0.7)
    assert list(level.data) == [0, 100, -1]
    assert (level.info.width, level.info.height) == (3, 1)
    assert (level.info.origin.position.x, level.info.origin.position.z) == (2.0, -0.7)
    assert level.info.origin.orientation.w == 1.0
    # Forward is the sensor's +y: R_level_sensor takes +y to +x.
    rotation = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    turned = ros_messages.occupancy_message(HEADER, grid, rotation, 0.7).info.origin
    np.testing.assert_allclose((turned.position.x, turned.position.y), (0, 2), atol=1e-12)
    half = np.sqrt(0.5)
    np.testing.assert_allclose((turned.orientation.z, turned.orientation.w), (half, half))


@pytest.mark.parametrize("axis", range(3))
def test_quaternion_of_half_a_turn(axis):
    R = -np.eye(3)
    R[axis, axis] = 1.0
    q = ros_messages._quaternion(R)
    expected = np.zeros(4)
    expected[axis] = 1.0
    np.testing.assert_allclose(np.abs((q.x, q.y, q.z, q.w)), expected, atol=1e-12)


def test_markers_tell_kinds_and_distances():
    kinds = np.array([0, 0, 2, 0], np.uint8)
    mounting = Mounting(sensor_height=0.7)
    array = ros_messages.marker_message(HEADER, RECTANGLE, kinds, mounting)
    texts = dict(m.text.split("\n") for m in array.markers if m.ns == "distance")
    assert texts == {
        "FRONT": "unknown beyond 4.0 m",
        "LEFT": "unknown beyond 3.0 m",
        "BACK": "wall 1.0 m",
        "RIGHT": "wall 2.0 m",
    }
    lines = {m.id: len(m.points) for m in array.markers if m.ns == "outline"}
    assert lines == {0: 4, 1: 0, 2: 4}
    none = ros_messages.marker_message(HEADER, np.zeros((0, 3)), [], mounting)
    assert len(none.markers) == len(array.markers)
    assert none.markers[-1].text == "NO FLOOR KNOWN"


def test_boundary_keeps_vertices_and_kinds():
    kinds = np.array([0, 1, 2, 0], np.uint8)
    message = ros_messages.boundary_message(HEADER, RECTANGLE, kinds)
    assert list(message.kinds) == [0, 1, 2, 0]
    assert (message.points[2].x, message.points[2].y) == (4.0, 3.0)
    assert len(ros_messages.polygon_message(HEADER, RECTANGLE).polygon.points) == 4
