"""Simulated scans as ROS bags in the layouts of the LiDARs' own drivers."""

import contextlib

import genpy
import numpy as np
import rosbag
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ..io import replacing

START_NS = 1_700_000_000_000_000_000
"""Stamp of scene time 0."""

WORLD_FRAME, BASE_FRAME = "odom", "base_link"
TF_PER_SCAN = 5

_LAYOUTS = {  # names, formats, offsets, point_step
    "hesai": (
        ("x", "y", "z", "intensity", "ring", "timestamp"),
        ("<f4", "<f4", "<f4", "<f4", "<u2", "<f8"),
        (0, 4, 8, 12, 16, 18),
        26,
    ),
    "velodyne": (
        ("x", "y", "z", "intensity", "ring", "time"),
        ("<f4", "<f4", "<f4", "<f4", "<u2", "<f4"),
        (0, 4, 8, 12, 16, 18),
        22,
    ),
    "ouster": (
        ("x", "y", "z", "intensity", "t", "reflectivity", "ring", "ambient", "range"),
        ("<f4", "<f4", "<f4", "<f4", "<u4", "<u2", "<u2", "<u2", "<u4"),
        (0, 4, 8, 16, 20, 24, 26, 28, 32),
        48,
    ),
}
_ROS_TYPES = {
    "<f4": PointField.FLOAT32,
    "<f8": PointField.FLOAT64,
    "<u2": PointField.UINT16,
    "<u4": PointField.UINT32,
}


def point_dtype(layout):
    """The driver's point as a packed numpy dtype."""
    names, formats, offsets, size = _LAYOUTS[layout]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


def driver_points(sensor, scan, mode, start_ns=START_NS):
    """A scan's points as the driver orders and fills them.

    Hesai's driver publishes a slot for each channel of each azimuth step, (0, 0, 0) where nothing
    came back or the channel did not fire; in dual mode two blocks a step, which repeat a lone
    return. Ouster's publishes rings as rows. Velodyne's publishes returns alone.

    Returns
    -------
    points : structured array (slots,) of point_dtype()
    truth : (slots,) uint8
    """
    slot, which, total = _slots(sensor, scan, mode)
    points = np.zeros(total, dtype=point_dtype(sensor.layout))
    truth = np.zeros(total, dtype=np.uint8)
    _fill_frame(points, sensor, scan, mode, start_ns)
    for axis, name in enumerate("xyz"):
        points[name][slot] = scan.xyz[which, axis]
    points["intensity"][slot] = scan.intensity[which]
    truth[slot] = scan.truth[which]
    if sensor.layout == "velodyne":
        points["ring"], points["time"] = scan.ring, scan.t
    if sensor.layout == "ouster":
        points["reflectivity"][slot] = scan.intensity[which]
        millimetres = 1000.0 * np.linalg.norm(scan.xyz[which].astype(float), axis=1)
        points["range"][slot] = np.round(millimetres)
    return points, truth


def _slots(sensor, scan, mode):
    """Slot of each point, the point in it, and the number of slots."""
    step, ring = scan.step.astype(np.int64), scan.ring.astype(np.int64)
    points = np.arange(len(scan))
    if sensor.layout == "velodyne":
        return points, points, len(scan)
    if sensor.layout == "ouster":  # the last echo of a beam wins its pixel
        return ring * sensor.steps + step, points, sensor.rings * sensor.steps
    if mode != "dual":
        return step * sensor.rings + ring, points, sensor.steps * sensor.rings
    beam = step * sensor.rings + ring
    is_second = np.zeros(len(beam), dtype=bool)
    is_second[1:] = beam[1:] == beam[:-1]
    has_second = np.zeros(len(beam), dtype=bool)
    has_second[:-1] = is_second[1:]
    slot = (2 * step + is_second) * sensor.rings + ring
    lone = points[~is_second & ~has_second]
    again = (2 * step[lone] + 1) * sensor.rings + ring[lone]
    total = 2 * sensor.steps * sensor.rings
    return np.concatenate([slot, again]), np.concatenate([points, lone]), total


def _fill_frame(points, sensor, scan, mode, start_ns):
    """Ring and time of every slot, whether something came back or not."""
    times = np.arange(sensor.steps) / (sensor.rate * sensor.steps)
    rings = np.arange(sensor.rings)
    if sensor.layout == "hesai":
        blocks = np.repeat(times, 2 if mode == "dual" else 1)
        points["ring"] = np.tile(rings, len(blocks))
        stamp = 1e-9 * start_ns + scan.stamp
        points["timestamp"] = np.repeat(stamp + blocks, sensor.rings)
    elif sensor.layout == "ouster":
        points["ring"] = np.repeat(rings, sensor.steps)
        points["t"] = np.tile(np.round(1e9 * times), sensor.rings)


def cloud_message(sensor, scan, mode, start_ns=START_NS):
    """The scan as the sensor_msgs/PointCloud2 that the driver publishes, and its slots' truth."""
    points, truth = driver_points(sensor, scan, mode, start_ns)
    names, formats, offsets, size = _LAYOUTS[sensor.layout]
    height = sensor.rings if sensor.layout == "ouster" else 1
    message = PointCloud2(
        header=Header(stamp=_time(start_ns, scan.stamp), frame_id=sensor.frame_id),
        height=height,
        width=len(points) // height,
        fields=[
            PointField(name=name, offset=offset, datatype=_ROS_TYPES[kind], count=1)
            for name, kind, offset in zip(names, formats, offsets)
        ],
        is_bigendian=False,
        point_step=size,
        row_step=size * (len(points) // height),
        data=points.tobytes(),
        is_dense=sensor.layout != "ouster",
    )
    return message, truth


def _time(start_ns, seconds):
    nanoseconds = start_ns + int(round(1e9 * seconds))
    return genpy.Time(nanoseconds // 1_000_000_000, nanoseconds % 1_000_000_000)


class SequenceWriter:
    """Writes the steps of a sequence into a bag; a context manager.

    The bag gets its name when all has gone well.

    Parameters
    ----------
    path : str
    sensor : Sensor
    mode : str
        Return mode the scans were made in.
    """

    def __init__(self, path, sensor, mode):
        self._path, self._sensor, self._mode = path, sensor, mode
        self._stack = contextlib.ExitStack()

    def __enter__(self):
        part = self._stack.enter_context(replacing(self._path))
        self._bag = self._stack.enter_context(rosbag.Bag(part, "w"))
        return self

    def __exit__(self, *failure):
        return self._stack.__exit__(*failure)

    def add(self, step):
        """Write a Step: /tf during the scan, then the cloud when the revolution is complete.

        Returns
        -------
        (slots,) uint8
            Truth of each point of the message.
        """
        scan, sensor = step.scan, self._sensor
        for share in range(TF_PER_SCAN):
            index = share * sensor.steps // TF_PER_SCAN
            self._write_tf(
                scan.stamp + index / (sensor.rate * sensor.steps),
                step.base_poses[index],
                step.T_base_sensor,
            )
        message, truth = cloud_message(sensor, scan, self._mode)
        end = scan.stamp + 1.0 / sensor.rate
        self._bag.write(sensor.topic, message, _time(START_NS, end))
        return truth

    def close_tf(self, step):
        """Write the last pose once more at the end of the last scan, so that tf covers it all."""
        end = step.scan.stamp + 1.0 / self._sensor.rate
        self._write_tf(end, step.base_poses[-1], step.T_base_sensor)

    def _write_tf(self, seconds, T_world_base, T_base_sensor):
        stamp = _time(START_NS, seconds)
        transforms = [
            _transform(stamp, WORLD_FRAME, BASE_FRAME, T_world_base),
            _transform(stamp, BASE_FRAME, self._sensor.frame_id, T_base_sensor),
        ]
        self._bag.write("/tf", TFMessage(transforms), stamp)


def _transform(stamp, parent, child, matrix):
    message = TransformStamped()
    message.header = Header(stamp=stamp, frame_id=parent)
    message.child_frame_id = child
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = (float(v) for v in matrix[:3, 3])
    rotation.w, rotation.x, rotation.y, rotation.z = quaternion(matrix[:3, :3])
    return message


def quaternion(R):
    """(w, x, y, z) of a rotation matrix, w >= 0."""
    terms = np.array(
        [
            1 + R[0, 0] + R[1, 1] + R[2, 2],
            1 + R[0, 0] - R[1, 1] - R[2, 2],
            1 - R[0, 0] + R[1, 1] - R[2, 2],
            1 - R[0, 0] - R[1, 1] + R[2, 2],
        ]
    )
    size = 0.5 * np.sqrt(np.maximum(terms, 0.0))
    signs = np.array([1.0, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if size[0] > 1e-6:
        return tuple(float(v) for v in size * np.where(signs < 0, -1.0, 1.0))
    largest = int(np.argmax(size[1:]))  # half a turn: signs from the axis itself
    axis = np.array([R[largest, k] + (1.0 if k == largest else 0.0) for k in range(3)])
    axis = axis / np.linalg.norm(axis)
    return (0.0, *(float(v) for v in axis))
