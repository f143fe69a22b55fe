#!/usr/bin/env python3
"""A sensor mounted tilted and turned: tf tells vertical, forward and height at the stamp."""

import math
import os
import sys

import numpy as np
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TransformStamped

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from chain_client import ChainTestCase, values_of
from cloud_layouts import cloud_of

from box_room import HALF_LENGTH, HALF_WIDTH, HEIGHT, box_room
from smoke_ground_reconstruction.ros_messages import structured_points

# The sensor looks 8 deg down (about +y), after a turn of 90 deg about the vertical.
PITCH, YAW = math.radians(8.0), math.radians(90.0)
R_base_sensor = np.array(
    [
        [math.cos(YAW), -math.sin(YAW), 0],
        [math.sin(YAW), math.cos(YAW), 0],
        [0, 0, 1],
    ]
) @ np.array(
    [
        [math.cos(PITCH), 0, math.sin(PITCH)],
        [0, 1, 0],
        [-math.sin(PITCH), 0, math.cos(PITCH)],
    ]
)
XYZ, INTENSITY, RING = box_room()  # in a frame that is level, +x forward
# box_room's rings are cones about the vertical; a tilted sensor's rays are the same rays turned.
TILTED = (XYZ.astype(np.float64) @ R_base_sensor).astype(np.float32)


def tilted_cloud(header):
    return cloud_of("hesai_ros2", header, TILTED, INTENSITY, RING)


def transform(frame_id):
    message = TransformStamped()
    message.header.frame_id = "base_footprint"
    message.child_frame_id = frame_id
    message.transform.translation.z = HEIGHT
    # Quaternion of the turn times that of the pitch.
    cy, sy, cp, sp = math.cos(YAW / 2), math.sin(YAW / 2), math.cos(PITCH / 2), math.sin(PITCH / 2)
    rotation = message.transform.rotation
    rotation.w, rotation.x, rotation.y, rotation.z = cy * cp, -sy * sp, cy * sp, sy * cp
    return message


class TransformTest(ChainTestCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.broadcaster = tf2_ros.StaticTransformBroadcaster()
        cls.broadcaster.sendTransform(transform("lidar"))

    def test_floor_is_level_in_the_base(self):
        floor, boundary, markers, occupancy = self.listen(
            "reconstructor/ground_surface",
            "reconstructor/boundary",
            "reconstructor/markers",
            "reconstructor/occupancy",
        )
        self.wake(tilted_cloud, floor, boundary, markers, occupancy)
        cloud, outline, array, grid = self.ask(tilted_cloud, floor, boundary, markers, occupancy)
        self.assertEqual(cloud.header.frame_id, "lidar")  # still in the sensor's frame
        points = structured_points(cloud)
        self.assertGreater(len(points), 1000)
        base = np.column_stack([points[n] for n in "xyz"]) @ R_base_sensor.T + [0, 0, HEIGHT]
        np.testing.assert_allclose(base[:, 2], 0.0, atol=0.02)
        self.assertLess(np.abs(base[:, 0]).max(), HALF_LENGTH + 0.01)
        self.assertLess(np.abs(base[:, 1]).max(), HALF_WIDTH + 0.01)

        vertices = np.array([(p.x, p.y, p.z) for p in outline.points])
        heights = (vertices @ R_base_sensor.T)[:, 2] + HEIGHT
        np.testing.assert_allclose(heights, 0.0, atol=0.02)

        # As in the level room: 3.3 m ahead, 2.4 m to the left, seen from the base.
        texts = dict(m.text.split("\n") for m in array.markers if m.ns == "distance")
        self.assertRegex(texts["FRONT"], r"^unknown beyond 3\.[23] m$")
        self.assertRegex(texts["LEFT"], r"^unknown beyond 2\.4 m$")

        corner = grid.info.origin.position
        height = (R_base_sensor @ [corner.x, corner.y, corner.z])[2] + HEIGHT
        self.assertAlmostEqual(height, 0.0, places=5)

    def test_without_a_transform_nothing_comes_out(self):
        floor, ground = self.listen("reconstructor/ground_surface", "segmenter/ground")
        self.wake(tilted_cloud, floor)
        stamp = self.publish(tilted_cloud, frame_id="unknown_frame")
        status = self.diagnostics.wait(
            "segmenter", lambda s: s.level == DiagnosticStatus.WARN, "a warning"
        )
        self.assertIn("no transform from 'unknown_frame' to 'base_footprint'", status.message)
        self.assertIn("no transform", values_of(status)["last drop"])
        self.ask(tilted_cloud, floor)  # what came after it went through
        self.assertFalse(ground.has(stamp) or floor.has(stamp))

    def test_a_transform_that_comes_later_is_used(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(tilted_cloud, floor)
        self.publish(tilted_cloud, frame_id="late_frame")
        self.diagnostics.wait("segmenter", lambda s: "late_frame" in s.message, "a warning")
        self.broadcaster.sendTransform([transform("lidar"), transform("late_frame")])

        def late_cloud(header):
            header.frame_id = "late_frame"
            return tilted_cloud(header)

        self.wake(late_cloud, floor)


if __name__ == "__main__":
    rospy.init_node("check_transform")
    rostest.rosrun("smoke_ground_reconstruction", "transform", TransformTest, sys.argv)
