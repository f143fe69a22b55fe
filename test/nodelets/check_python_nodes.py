#!/usr/bin/env python3
"""The rospy nodes in the places of two nodelets: the same answers, laziness and tuning."""

import os
import sys

import dynamic_reconfigure.client
import numpy as np
import rospy
import rostest

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from chain_client import NS, ChainTestCase, values_of, wait_until
from cloud_layouts import cloud_of

from box_room import HEIGHT, box_room
from smoke_ground_reconstruction import Params, Pipeline
from smoke_ground_reconstruction.ros_messages import structured_points

PACKAGE = "smoke_ground_reconstruction"
ROOM_YAML = os.path.join(os.path.dirname(os.path.realpath(__file__)), "room.yaml")
ROOM = box_room()
ABOVE = ~(ROOM[0][:, 2] < -HEIGHT + 0.01)  # all but the floor's returns


def room_cloud(header):
    return cloud_of("hesai_ros2", header, *ROOM)


def floorless_cloud(header):
    return cloud_of("rslidar_xyzi", header, *(array[ABOVE] for array in ROOM))


def expected():
    """The compiled pipeline's answer, which the nodelets give."""
    return Pipeline(Params.from_yaml(ROOM_YAML), engine="cpp").process(*ROOM)


class PythonNodesTest(ChainTestCase):
    def test_denoiser_gives_the_labels_of_the_nodelet(self):
        listeners = self.listen("denoiser/denoised", "denoiser/noise")
        self.wake(room_cloud, *listeners)
        denoised, noise = self.ask(room_cloud, *listeners)
        labels = expected().labels
        for cloud, mask in ((denoised, np.isin(labels, (1, 3, 4))), (noise, labels == 2)):
            self.assertGreater(mask.sum(), 50)
            points = structured_points(cloud)
            np.testing.assert_array_equal(points["timestamp"], np.flatnonzero(mask) + 1)
            np.testing.assert_array_equal(points["x"], ROOM[0][mask, 0])

    def test_reconstructor_gives_the_floor_of_the_nodelet(self):
        topics = (
            "reconstructor/ground_surface",
            "reconstructor/boundary",
            "reconstructor/occupancy",
            "reconstructor/boundary_polygon",
        )
        listeners = self.listen(*topics)
        self.wake(room_cloud, *listeners)
        surface_msg, boundary, occupancy, polygon = self.ask(room_cloud, *listeners)
        result = expected()
        surface = structured_points(surface_msg)
        xyz = np.column_stack([surface[name] for name in "xyz"])
        np.testing.assert_allclose(xyz, result.surface, atol=1e-5)
        for name in ("intensity", "ring", "provenance"):
            np.testing.assert_array_equal(surface[name], getattr(result, name))
        np.testing.assert_allclose(surface["confidence"], result.confidence, rtol=1e-5)
        vertices = np.array([(p.x, p.y, p.z) for p in boundary.points])
        np.testing.assert_allclose(vertices, result.boundary, atol=1e-5)
        np.testing.assert_array_equal(np.frombuffer(boundary.kinds, np.uint8), result.boundary_kind)
        self.assertEqual(len(polygon.polygon.points), len(boundary.points))
        cells = np.array(occupancy.data, np.int8)
        np.testing.assert_array_equal(cells, result.occupancy.cells.ravel())
        self.assertAlmostEqual(occupancy.info.origin.position.z, -HEIGHT)

    def test_markers_say_how_far_the_walls_are(self):
        listener = self.listen("reconstructor/markers")
        self.wake(floorless_cloud, listener)
        (array,) = self.ask(floorless_cloud, listener)
        texts = dict(m.text.split("\n") for m in array.markers if m.ns == "distance")
        self.assertEqual(texts["FRONT"], "wall 4.0 m")
        self.assertEqual(texts["RIGHT"], "wall 3.0 m")

    def test_chain_sleeps_until_the_floor_is_wanted(self):
        timings = self.listen("denoiser/timing", "reconstructor/timing")
        wait_until(lambda: self.cloud_pub.get_num_connections() == 0, "the chain to sleep")
        for node in ("denoiser", "reconstructor"):
            self.diagnostics.wait(node, lambda s: "idle" in s.message, "idle")
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)
        denoiser, reconstructor = self.ask(room_cloud, *timings)
        moments = [denoiser.begun, denoiser.handed_over[0]]
        moments += [reconstructor.begun, reconstructor.handed_over[0]]
        self.assertEqual(moments, sorted(moments))
        self.assertEqual(denoiser.stages, ["organise", "denoise", "publish"])
        self.assertEqual(reconstructor.points_out[-1], floor.wait(reconstructor.header.stamp).width)
        floor.close()
        wait_until(lambda: self.cloud_pub.get_num_connections() == 0, "the chain to sleep again")

    def test_bad_cloud_is_reported_and_survived(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)

        def without_x(header):
            cloud = room_cloud(header)
            del cloud.fields[0]
            return cloud

        self.publish(without_x)
        reason = "'x' of FLOAT32 or FLOAT64; fields: y FLOAT32 @4"
        self.diagnostics.wait("denoiser", lambda s: reason in values_of(s)["last drop"], reason)
        self.ask(room_cloud, floor)

    def test_a_fault_is_told_once(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)
        self.check_told_once(room_cloud)

    def test_a_change_of_parameters_shows_in_the_next_scan(self):
        noise = self.listen("denoiser/noise")
        self.wake(room_cloud, noise)
        client = dynamic_reconfigure.client.Client(f"{NS}/denoiser", timeout=30)
        try:
            client.update_configuration({"intensity_threshold": 0.0})
            (after,) = self.ask(room_cloud, noise)
            self.assertEqual(after.width, 0)
            config = client.update_configuration({"min_neighbors": 7000, "max_neighbors": 10})
            self.assertEqual(config["max_neighbors"], 7001)  # repaired
            config = client.update_configuration({"engine": "guess"})
            self.assertEqual(config["engine"], "window")  # refused: as it was
        finally:
            client.update_configuration(vars(Params().denoiser))
            client.close()

    def test_room_boundary_takes_the_raw_scan_alone(self):
        listeners = self.listen("reconstructor/ground_surface", "reconstructor/occupancy")
        client = dynamic_reconfigure.client.Client(f"{NS}/reconstructor", timeout=30)
        try:
            client.update_configuration({"method": "room_boundary"})
            self.wake(floorless_cloud, *listeners)
            for node in ("denoiser", "segmenter"):
                self.diagnostics.wait(node, lambda s: "idle" in s.message, "idle")
            surface, occupancy = self.ask(floorless_cloud, *listeners)
            scan = [array[ABOVE] for array in ROOM]
            params = Params.from_yaml(ROOM_YAML)
            params.reconstructor.method = "room_boundary"
            result = Pipeline(params, engine="python").process(*scan)
            points = structured_points(surface)
            xyz = np.column_stack([points[name] for name in "xyz"])
            np.testing.assert_allclose(xyz, result.surface, atol=1e-5)
            cells = np.array(occupancy.data, np.int8)
            np.testing.assert_array_equal(cells, result.occupancy.cells.ravel())
        finally:
            client.update_configuration({"method": "polar_segments"})
            client.close()
        self.wake(room_cloud, *listeners)  # the other nodes work again


if __name__ == "__main__":
    rospy.init_node("check_python_nodes")
    rostest.rosrun(PACKAGE, "python_nodes", PythonNodesTest, sys.argv)
