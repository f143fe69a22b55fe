#!/usr/bin/env python3
"""A driver in the manager of the chain: nothing is copied, lost or kept on the way."""

import io
import os
import sys
import tempfile
import unittest

import dynamic_reconfigure.client
import rospy
import rostest
from std_msgs.msg import Header

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from chain_client import NS
from cloud_layouts import cloud_of

from box_room import box_room
from smoke_ground_reconstruction import latency

PLAN = {"warm_up": 10, "compare": 20, "count": 100, "rate": 20.0}  # a busy machine bears it
RUNS = 3  # the best of these counts


class RateTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.TemporaryDirectory()
        cls.scans = []
        for seed in (1, 2, 3):
            cloud = cloud_of("hesai_ros2", Header(frame_id="lidar"), *box_room(seed=seed))
            wire = io.BytesIO()
            cloud.serialize(wire)
            cls.scans.append(os.path.join(cls.work.name, f"{seed}.msg"))
            with open(cls.scans[-1], "wb") as file:
                file.write(wire.getvalue())

    @classmethod
    def tearDownClass(cls):
        cls.work.cleanup()

    def test_polar_segments(self):
        stages = self.check("polar_segments")
        self.assertEqual(set(stages), {"denoiser", "segmenter", "reconstructor"})

    def test_room_boundary(self):
        self.assertEqual(set(self.check("room_boundary")), {"reconstructor"})

    def check(self, method):
        client = dynamic_reconfigure.client.Client(f"{NS}/reconstructor", timeout=30)
        client.update_configuration({"method": method})
        client.close()
        for _ in range(RUNS):
            log = latency.probe(self.scans, PLAN)
            if latency.load(log, PLAN["count"]).dropped == 0:
                break
        stages = {entry["stage"]: {t["seq"]: t for t in entry["scans"]} for entry in log["stages"]}
        load = latency.load(log, PLAN["count"])
        self.assertEqual((load.played, load.dropped, load.twice), (PLAN["count"], 0, 0))
        grown = load.resident_mb[-1] - load.resident_mb[1]
        self.assertLess(grown, 2.0, load.resident_mb)  # [MB]; 100 scans are 37 MB
        hops = latency.hops(log)
        self.assertEqual(len(hops.whole), PLAN["compare"])
        for name, times in hops.parts.items():
            self.assertGreaterEqual(min(times), 0.0, name)
        compared = [scan for scan in log["scans"] if scan["pipeline_ms"] > 0.0]
        for scan in compared:
            self.assertEqual(*self.buffers(scan, stages))
        return stages

    def buffers(self, scan, stages):
        """Where the scan's messages were received, and where they were handed over."""
        came, went = [], [scan["buffer"]]
        for name in ("denoiser", "segmenter", "reconstructor"):
            if name not in stages:
                continue
            timing = stages[name][scan["seq"]]
            came += timing["input_buffers"]
            if name == "reconstructor" and len(timing["input_buffers"]) == 3:
                went.insert(-2, scan["buffer"])
            went += [buffer for buffer in timing["output_buffers"] if buffer]
        return [*came, scan["floor_buffer"]], went


if __name__ == "__main__":
    rospy.init_node("check_rate")
    rostest.rosrun("smoke_ground_reconstruction", "rate", RateTest, sys.argv)
