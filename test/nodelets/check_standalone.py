#!/usr/bin/env python3
"""The three nodelets in one process without a manager; a denoiser that is always on."""

import os
import sys

import numpy as np
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from chain_client import ChainTestCase, wait_until
from cloud_layouts import cloud_of

from box_room import HEIGHT, box_room
from smoke_ground_reconstruction.ros_messages import structured_points

ROOM = box_room()


def room_cloud(header):
    return cloud_of("hesai_ros2", header, *ROOM)


class StandaloneTest(ChainTestCase):
    def test_floor_comes_out(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)
        (cloud,) = self.ask(room_cloud, floor)
        points = structured_points(cloud)
        self.assertGreater(len(points), 1000)
        np.testing.assert_allclose(points["z"], -HEIGHT, atol=0.02)

    def test_buffers_are_shared(self):
        timings = self.listen("denoiser/timing", "segmenter/timing", "reconstructor/timing")
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor, *timings)
        denoiser, segmenter, reconstructor = self.ask(room_cloud, *timings)
        self.assertEqual(segmenter.input_buffers[0], denoiser.output_buffers[0])
        self.assertEqual(reconstructor.input_buffers[1:], segmenter.output_buffers)

    def test_what_is_always_on_works_unheard(self):
        timing = self.listen("denoiser/timing")
        wait_until(lambda: self.cloud_pub.get_num_connections() == 1, "the denoiser to listen")
        self.wake(room_cloud, timing)
        (message,) = self.ask(room_cloud, timing)
        self.assertEqual(message.points_in[0], len(ROOM[0]))
        self.assertEqual(list(message.output_buffers), [0, 0])


if __name__ == "__main__":
    rospy.init_node("check_standalone")
    rostest.rosrun("smoke_ground_reconstruction", "standalone", StandaloneTest, sys.argv)
