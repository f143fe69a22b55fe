"""How the sensor stands when a scan is taken: from tf where ~base_frame is set, else level."""

import math
import time

import numpy as np
import rospy
import tf2_ros

from ..reference.predicates import Direction
from ..reference.scan import Mounting


class MountingSource:
    """Private parameters, read once: ~base_frame (level, +x forward; "" for none), ~base_height [m]
    of its origin above the floor, ~tf_timeout [s], ~forward_yaw_deg (without base_frame alone)."""

    def __init__(self):
        self._base_frame = rospy.get_param("~base_frame", "")
        self._base_height = rospy.get_param("~base_height", 0.0)
        self._tf_timeout = rospy.get_param("~tf_timeout", 0.1)
        self._forward_yaw_deg = rospy.get_param("~forward_yaw_deg", 0.0)
        if not self._base_frame:
            return
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)
        if self._forward_yaw_deg != 0.0:
            rospy.logwarn(
                f"{rospy.get_name()}: forward_yaw_deg is ignored: "
                f"base_frame '{self._base_frame}' tells forward"
            )

    def at(self, header, sensor_height: float) -> Mounting:
        """The mounting at the header's stamp; `sensor_height` [m] holds where tf does not tell it.

        Raises RuntimeError without a transform at the stamp, after ~tf_timeout of wall time.
        """
        if not self._base_frame:
            return level_mounting(self._forward_yaw_deg, sensor_height)
        transform = self._wait_for_transform(header)
        return mounting_from(transform.transform, self._base_height)

    @property
    def height_is_from(self) -> str:
        """What tells the sensor's height: "sensor_height", or tf and the frame."""
        return f"tf from '{self._base_frame}'" if self._base_frame else "sensor_height"

    def _wait_for_transform(self, header):
        deadline = time.monotonic() + self._tf_timeout
        while True:
            try:
                return self._buffer.lookup_transform(
                    self._base_frame, header.frame_id, header.stamp
                )
            except tf2_ros.TransformException as reason:
                if time.monotonic() > deadline:
                    raise RuntimeError(
                        f"no transform from '{header.frame_id}' to '{self._base_frame}' "
                        f"at the scan's stamp: {reason}"
                    ) from None
            time.sleep(0.002)


def level_mounting(forward_yaw_deg: float, sensor_height: float) -> Mounting:
    """Of a level sensor whose robot drives towards an azimuth of the sensor frame [deg]."""
    if forward_yaw_deg == 0.0:
        return Mounting(sensor_height=sensor_height)
    cosine, sine = Direction.from_degrees(forward_yaw_deg)
    rotation = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]
    return Mounting(rotation=np.array(rotation), sensor_height=sensor_height)


def mounting_from(transform, base_height: float) -> Mounting:
    """From T_base_sensor, base being level, +x forward, its origin `base_height` above the floor.

    Raises RuntimeError where the sensor would not be above the floor.
    """
    q = transform.rotation
    x, y, z, w = np.array([q.x, q.y, q.z, q.w]) / math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    height = transform.translation.z + base_height
    if not height > 0.0:
        raise RuntimeError(
            f"tf puts the sensor {height:f} m above the floor; check base_frame and base_height"
        )
    return Mounting(rotation=rotation, sensor_height=height)
