#!/usr/bin/env python3
"""The three nodelets in one manager: data, headers, shared buffers, laziness, bad input, tuning."""

import os
import sys
import time

import dynamic_reconfigure.client
import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from chain_client import NS, ChainTestCase, values_of, wait_until
from cloud_layouts import LAYOUTS, cloud_of

from box_room import HALF_LENGTH, HALF_WIDTH, HEIGHT, box_room
from smoke_ground_reconstruction import Params, Pipeline
from smoke_ground_reconstruction.ros_messages import read_cloud, structured_points

PACKAGE = "smoke_ground_reconstruction"
ROOM_YAML = os.path.join(os.path.dirname(os.path.realpath(__file__)), "room.yaml")
ROOM = box_room()


def room_cloud(header, layout="hesai_ros2", **options):
    return cloud_of(layout, header, *ROOM, **options)


def floorless_cloud(header):
    xyz, intensity, ring = ROOM
    above = ~(xyz[:, 2] < -HEIGHT + 0.01)
    return cloud_of("hesai_ros2", header, xyz[above], intensity[above], ring[above])


def texts_of(array):
    """What the markers say of each side."""
    return dict(m.text.split("\n") for m in array.markers if m.ns == "distance")


def expected(scan=ROOM):
    return Pipeline(Params.from_yaml(ROOM_YAML)).process(*scan)


class ChainTest(ChainTestCase):
    def test_every_output_comes_once_with_the_header_whole(self):
        topics = [
            "denoiser/denoised",
            "denoiser/noise",
            "segmenter/ground",
            "segmenter/walls",
            "reconstructor/ground_surface",
            "reconstructor/occupancy",
            "reconstructor/boundary",
            "reconstructor/boundary_polygon",
            "reconstructor/markers",
            "reconstructor/timing",
        ]
        listeners = self.listen(*topics)
        self.wake(room_cloud, *listeners)
        for _ in range(3):
            stamp = self.publish(room_cloud)
            for listener in listeners:
                message = listener.wait(stamp)  # found by all of its nanoseconds
                header = (message.markers[0] if hasattr(message, "markers") else message).header
                self.assertEqual(header.frame_id, "lidar")
        self.ask(room_cloud, *listeners)  # what came twice would have come by now
        for listener in listeners:
            self.assertEqual({len(messages) for messages in listener.by_stamp.values()}, {1})

    def test_floor_is_that_of_the_room_and_of_the_pipeline(self):
        listeners = self.listen("reconstructor/ground_surface", "reconstructor/boundary")
        self.wake(room_cloud, *listeners)
        surface_msg, boundary_msg = self.ask(room_cloud, *listeners)
        surface = structured_points(surface_msg)
        result = expected()

        self.assertEqual(surface.dtype.names[-3:], ("provenance", "confidence", "sigma"))
        self.assertGreater(len(surface), 1000)
        np.testing.assert_allclose(surface["z"], -HEIGHT, atol=0.02)
        self.assertLess(np.abs(surface["x"]).max(), HALF_LENGTH + 0.01)
        self.assertLess(np.abs(surface["y"]).max(), HALF_WIDTH + 0.01)

        xyz = np.column_stack([surface[name] for name in "xyz"])
        np.testing.assert_array_equal(xyz, result.surface)
        for name in ("intensity", "ring", "provenance", "confidence"):
            np.testing.assert_array_equal(surface[name], getattr(result, name))
        vertices = np.array([(p.x, p.y, p.z) for p in boundary_msg.points], np.float32)
        np.testing.assert_array_equal(vertices, result.boundary)
        kinds = np.frombuffer(boundary_msg.kinds, np.uint8)
        np.testing.assert_array_equal(kinds, result.boundary_kind)

    def test_clouds_in_between_are_those_of_the_pipeline(self):
        topics = ("denoiser/denoised", "denoiser/noise", "segmenter/ground", "segmenter/walls")
        listeners = self.listen(*topics)
        self.wake(room_cloud, *listeners)
        clouds = self.ask(room_cloud, *listeners)
        result = expected()
        labels, clusters = result.labels, result.clusters
        in_cluster = clusters != 0xFFFFFFFF
        masks = (np.isin(labels, (1, 3, 4)), labels == 2, labels == 3, in_cluster)
        for cloud, mask in zip(clouds, masks):
            self.assertGreater(mask.sum(), 50)
            points = structured_points(cloud)
            np.testing.assert_array_equal(points["x"], ROOM[0][mask, 0])
            # Every field of the driver survives: its timestamps number the points.
            np.testing.assert_array_equal(points["timestamp"], np.flatnonzero(mask) + 1)
        walls = structured_points(clouds[3])
        self.assertEqual(walls.dtype["cluster"], np.uint32)
        np.testing.assert_array_equal(walls["cluster"], clusters[in_cluster])

    def test_other_nodelets_of_the_manager_read_clouds(self):
        topics = ("denoiser/denoised", "reader/denoised", "reader/noise", "segmenter/ground")
        listeners = self.listen(*topics)
        self.wake(room_cloud, *listeners)
        denoised, *read, _ = self.ask(room_cloud, *listeners)
        numbers = [structured_points(cloud)["timestamp"] for cloud in read]
        np.testing.assert_array_equal(
            np.sort(np.concatenate(numbers)), structured_points(denoised)["timestamp"]
        )

    def test_occupancy_lies_on_the_floor(self):
        (listener,) = [self.listen("reconstructor/occupancy")]
        self.wake(room_cloud, listener)
        (grid,) = self.ask(room_cloud, listener)
        origin = grid.info.origin
        self.assertAlmostEqual(origin.position.z, -HEIGHT)
        self.assertEqual(origin.orientation.w, 1.0)
        cells = np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
        result = expected()
        np.testing.assert_array_equal(cells, result.occupancy.cells)

        def cell_at(x, y):
            column = int((x - origin.position.x) / grid.info.resolution)
            return cells[int((y - origin.position.y) / grid.info.resolution), column]

        self.assertEqual(cell_at(1.53, 0.03), 0)
        self.assertEqual(cell_at(HALF_LENGTH, 0.03), 100)

    def test_markers_say_how_far_the_walls_are(self):
        listener = self.listen("reconstructor/markers")
        self.wake(room_cloud, listener)
        (clear,) = self.ask(room_cloud, listener)
        # Rings 2 deg apart reach 0.7 m / tan(10 deg) = 3.97 m ahead and 2.81 m (14 deg) to the
        # left. A pair labels its first point, so the last labelled are one ring nearer: 12 and
        # 16 deg, 3.3 and 2.4 m. From there to the wall nothing was measured.
        self.assertEqual(texts_of(clear)["FRONT"], "unknown beyond 3.3 m")
        self.assertEqual(texts_of(clear)["LEFT"], "unknown beyond 2.4 m")
        self.assertTrue(all(marker.lifetime.to_sec() > 0 for marker in clear.markers))

        # Without the floor's returns the floor is drawn up to the walls, 4 and 3 m away.
        (smoky,) = self.ask(floorless_cloud, listener)
        self.assertEqual(texts_of(smoky)["FRONT"], "wall 4.0 m")
        self.assertEqual(texts_of(smoky)["RIGHT"], "wall 3.0 m")

    def test_the_next_nodelet_gets_the_same_buffer(self):
        topics = ("denoiser/timing", "segmenter/timing", "reconstructor/timing")
        timings = self.listen(*topics)
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor, *timings)
        denoiser, segmenter, reconstructor = self.ask(room_cloud, *timings)
        denoised, noise = denoiser.output_buffers
        ground, walls = segmenter.output_buffers
        self.assertTrue(all((denoised, ground, walls)))
        self.assertEqual(noise, 0)  # nobody listens to it, so it is not made
        self.assertEqual(list(segmenter.input_buffers), [denoised])
        self.assertEqual(
            list(reconstructor.input_buffers), [denoiser.input_buffers[0], ground, walls]
        )

    def test_timing_tells_when_a_scan_goes_from_hand_to_hand(self):
        topics = ("denoiser/timing", "segmenter/timing", "reconstructor/timing")
        timings = self.listen(*topics)
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor, *timings)
        sent = time.monotonic_ns()  # the clock of all processes of this machine
        denoiser, segmenter, reconstructor = self.ask(room_cloud, *timings)
        come = time.monotonic_ns()
        self.assertEqual(denoiser.handed_over[1], 0)  # nobody listens to the noise
        (surface,) = reconstructor.handed_over
        ground, walls = segmenter.handed_over
        moments = [sent, denoiser.begun, denoiser.handed_over[0], segmenter.begun, ground, walls]
        moments += [reconstructor.begun, surface, come]
        self.assertEqual(moments, sorted(moments))
        worked = sum(denoiser.milliseconds[:2]) * 1e6  # all but the publishing
        self.assertGreaterEqual(denoiser.handed_over[0] - denoiser.begun, int(worked))

    def test_timing_counts_points(self):
        listener = self.listen("segmenter/timing")
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor, listener)
        (timing,) = self.ask(room_cloud, listener)
        self.assertEqual(timing.stages, ["organise", "segment", "cluster", "publish"])
        self.assertEqual(len(timing.milliseconds), 4)
        self.assertTrue(all(ms >= 0 for ms in timing.milliseconds))
        result = expected()
        self.assertEqual(timing.points_in[0], int(np.isin(result.labels, (1, 3, 4)).sum()))
        clustered = int((result.clusters != 0xFFFFFFFF).sum())
        self.assertEqual(timing.points_out[2], clustered)
        self.assertEqual(timing.points_out[3], int((result.labels == 3).sum()) + clustered)

    def test_lazy_chain_sleeps_until_the_floor_is_wanted(self):
        self.listen("denoiser/timing", "segmenter/timing", "reconstructor/timing")
        wait_until(lambda: self.cloud_pub.get_num_connections() == 0, "the chain to sleep")
        for node in ("denoiser", "segmenter", "reconstructor"):
            status = self.diagnostics.wait(node, lambda s: "idle" in s.message, "idle")
            self.assertEqual(status.level, DiagnosticStatus.OK)
        self.assertEqual(self.cloud_pub.get_num_connections(), 0)

        floor = self.listen("reconstructor/ground_surface")
        wait_until(lambda: self.cloud_pub.get_num_connections() == 1, "the manager to listen")
        self.wake(room_cloud, floor)
        floor.close()
        wait_until(lambda: self.cloud_pub.get_num_connections() == 0, "the chain to sleep again")

    def test_diagnostics_tell_rate_points_and_time(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)

        def runs(status):
            self.ask(room_cloud, floor)
            return status.message == "running"

        status = self.diagnostics.wait("denoiser", runs, "running")
        values = values_of(status)
        self.assertEqual(values["points in"], str(len(ROOM[0])))
        self.assertEqual(
            values["points kept"], str(int(np.isin(expected().labels, (1, 3, 4)).sum()))
        )
        self.assertGreater(float(values["input rate [Hz]"]), 0)
        self.assertGreater(float(values["last processing time [ms]"]), 0)
        self.assertIn("scans dropped", values)
        self.assertIn("last drop", values)

    def test_every_layout_gives_the_same_floor(self):
        floor, walls = self.listen("reconstructor/ground_surface", "segmenter/walls")
        self.wake(room_cloud, floor, walls)
        reference, _ = self.ask(room_cloud, floor, walls)
        for layout in LAYOUTS:
            cloud, cut = self.ask(
                lambda header, name=layout: room_cloud(header, name), floor, walls
            )
            self.assertEqual(cloud.data, reference.data, layout)
            fields = [field.name for field in cut.fields]
            self.assertEqual(fields[-1], "cluster", layout)
            self.assertIn("ring", fields, layout)  # made from elevation where there is none
        for padding in (0, 7):  # organised in rows of 450, with and without padding
            cloud, _ = self.ask(
                lambda header, p=padding: room_cloud(header, rows=32, padding=p), floor, walls
            )
            self.assertEqual(cloud.data, reference.data)

    def test_bad_clouds_are_reported_and_survived(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)

        def without(name):
            def make(header):
                cloud = room_cloud(header)
                cloud.fields = [field for field in cloud.fields if field.name != name]
                return cloud

            return make

        def changed(**changes):
            def make(header):
                cloud = room_cloud(header)
                for name, value in changes.items():
                    setattr(cloud, name, value)
                return cloud

            return make

        def beyond(header):
            cloud = room_cloud(header)
            cloud.fields[0].offset = 4_000_000_000
            return cloud

        def string_typed(header):
            cloud = room_cloud(header)
            cloud.fields[2].datatype = 77
            return cloud

        listing = "intensity FLOAT32 @12, ring UINT16 @16, timestamp FLOAT64 @18"
        cases = (
            (
                without("x"),
                f"'x' of FLOAT32 or FLOAT64; fields: y FLOAT32 @4, z FLOAT32 @8, {listing}",
            ),
            (without("intensity"), "no single field 'intensity'"),
            (changed(data=b"short"), "data holds 5 bytes"),
            (changed(row_step=13), "row_step 13"),
            (changed(point_step=0), "point_step is 0"),
            (changed(width=2**32 - 1, height=2**32 - 1), "row_step"),
            (changed(is_bigendian=True), "big-endian"),
            (beyond, "field 'x' reaches beyond point_step 26"),
            (string_typed, "unknown datatype 77"),
        )
        for make, reason in cases:
            self.publish(make)
            status = self.diagnostics.wait(
                "denoiser", lambda s, r=reason: r in values_of(s)["last drop"], reason
            )
            self.assertIn(reason, values_of(status)["last drop"])
            self.ask(room_cloud, floor)  # it lives

    def test_a_fault_is_told_once(self):
        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)
        self.check_told_once(room_cloud)

    def test_empty_and_worthless_clouds_give_empty_outputs(self):
        topics = (
            "denoiser/denoised",
            "segmenter/walls",
            "reconstructor/ground_surface",
            "reconstructor/boundary",
        )
        listeners = self.listen(*topics)
        self.wake(room_cloud, *listeners)
        zeros = (np.zeros((5, 3), np.float32), np.ones(5, np.float32), np.zeros(5, np.uint16))
        holes = (np.full((5, 3), np.nan, np.float32), *zeros[1:])
        nothing = tuple(array[:0] for array in zeros)
        for scan in (zeros, holes, nothing):
            answers = self.ask(
                lambda header, s=scan: cloud_of("hesai_ros2", header, *s), *listeners
            )
            self.assertEqual([cloud.width for cloud in answers[:3]], [0, 0, 0])
            self.assertEqual(len(answers[3].points), 0)
            self.assertEqual(
                [f.name for f in answers[0].fields],
                [name for name, _, _ in LAYOUTS["hesai_ros2"][0]],
            )

    def test_a_change_of_parameters_shows_in_the_next_scan(self):
        noise = self.listen("denoiser/noise")
        self.wake(room_cloud, noise)
        client = dynamic_reconfigure.client.Client(f"{NS}/denoiser", timeout=30)
        (before,) = self.ask(room_cloud, noise)
        self.assertGreater(before.width, 100)
        try:
            for threshold in (0.0, 25.0, 0.0):
                client.update_configuration({"intensity_threshold": threshold})
                (after,) = self.ask(room_cloud, noise)
                self.assertEqual(after.width, 0 if threshold == 0.0 else before.width)
        finally:
            client.update_configuration({"intensity_threshold": 25.0})
            client.close()

    def test_room_boundary_takes_the_raw_scan_alone(self):
        listeners = self.listen("reconstructor/ground_surface", "reconstructor/occupancy")
        self.wake(room_cloud, *listeners)
        client = dynamic_reconfigure.client.Client(f"{NS}/reconstructor", timeout=30)
        try:
            client.update_configuration({"method": "room_boundary"})
            for node in ("denoiser", "segmenter"):
                self.diagnostics.wait(node, lambda s: "idle" in s.message, "idle")
            surface, occupancy = self.ask(room_cloud, *listeners)
            params = Params.from_yaml(ROOM_YAML)
            params.reconstructor.method = "room_boundary"
            result = Pipeline(params).process(*ROOM)
            points = structured_points(surface)
            xyz = np.column_stack([points[name] for name in "xyz"])
            # The nodelet has learned the rings from scans of other tests, too.
            np.testing.assert_allclose(xyz, result.surface, rtol=0.0, atol=1e-6)
            cells = np.array(occupancy.data, np.int8)
            np.testing.assert_array_equal(cells, result.occupancy.cells.ravel())
            status = self.diagnostics.wait(
                "reconstructor", lambda s: "sensor height measured [m]" in values_of(s), "height"
            )
            measured = float(values_of(status)["sensor height measured [m]"])
            self.assertAlmostEqual(measured, HEIGHT, delta=0.01)
        finally:
            client.update_configuration({"method": "polar_segments"})
            client.close()
        self.wake(room_cloud, *listeners)  # the other nodelets work again

    def test_a_change_of_parameters_does_not_wait_for_the_scan(self):
        timing, noise = self.listen("denoiser/timing", "denoiser/noise")
        self.wake(room_cloud, noise, timing)
        client = dynamic_reconfigure.client.Client(f"{NS}/denoiser", timeout=30)
        scan = box_room(step_deg=0.1)  # 115,200 points, all of them candidates: slow
        calls = []
        try:
            client.update_configuration(
                {"engine": "kdtree", "alpha": 1.0, "intensity_threshold": 255.0, "max_neighbors": 0}
            )
            stamp = self.publish(lambda header: cloud_of("hesai_ros2", header, *scan))
            while not timing.has(stamp):  # changes before, while and after it is worked on
                begin = time.monotonic()
                client.update_configuration({"min_neighbors": 100 + len(calls) % 2})
                calls.append(time.monotonic() - begin)
            milliseconds = sum(timing.wait(stamp).milliseconds)
            self.assertGreater(len(calls), 1)
            self.assertLess(max(calls) * 1e3, milliseconds / 2)
        finally:
            client.update_configuration(vars(Params().denoiser))
            client.close()

    def test_a_slow_stage_does_not_starve_the_floor(self):
        """Scans come faster than they are worked on: floors of the newest go on coming."""
        floor, timing = self.listen("reconstructor/ground_surface", "denoiser/timing")
        self.wake(room_cloud, floor, timing)
        client = dynamic_reconfigure.client.Client(f"{NS}/denoiser", timeout=30)
        scan = box_room(step_deg=0.4)
        floors, published = len(floor.by_stamp), 0
        try:
            client.update_configuration(
                {"engine": "kdtree", "alpha": 1.0, "intensity_threshold": 255.0, "max_neighbors": 0}
            )
            while len(floor.by_stamp) < floors + 3:
                self.publish(lambda header: cloud_of("hesai_ros2", header, *scan))
                published += 1
                rospy.rostime.wallsleep(0.1)  # the rate of a LiDAR
                self.assertLess(published, 600, "no floors of a slow chain")
        finally:
            client.update_configuration(vars(Params().denoiser))
            client.close()
        self.assertLess(len(timing.by_stamp), published)  # it was too slow for all of them

    def test_bad_parameters_are_repaired(self):
        surface = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, surface)
        client = dynamic_reconfigure.client.Client(f"{NS}/reconstructor", timeout=30)
        try:
            # 7 deg do not divide 360: the next angle that does is 360 / 51.
            config = client.update_configuration({"segment_angle_deg": 7.0})
            self.assertAlmostEqual(config["segment_angle_deg"], 360.0 / 51.0)
            # An unknown name leaves the set as it was.
            config = client.update_configuration({"wall_distance": "guess"})
            self.assertEqual(config["wall_distance"], "range")
            config = client.update_configuration({"horizontal_resolution_deg": 9.0})
            self.assertAlmostEqual(config["horizontal_resolution_deg"], 0.4)
            self.ask(room_cloud, surface)
        finally:
            client.update_configuration(vars(Params.from_yaml(ROOM_YAML).reconstructor))
            client.close()

    def test_recorded_scan_gives_the_floor_of_the_pipeline(self):
        root = os.path.join(os.path.dirname(os.path.realpath(__file__)), "../..")
        scans = os.environ.get("SMOKE_GROUND_SCANS", os.path.join(root, "../shared/data/scans"))
        path = os.path.join(scans, "nebula_qt128_room/frame00_strongest.npz")
        if not os.path.exists(path):
            self.skipTest(f"no recorded scan at {path}; set SMOKE_GROUND_SCANS")
        with np.load(path) as data:
            xyz = np.column_stack([data[name] for name in "xyz"])
            scan = (xyz, data["intensity"], data["ring"])

        def make(header):
            return cloud_of("hesai_ros2", header, *scan)

        floor = self.listen("reconstructor/ground_surface")
        self.wake(room_cloud, floor)
        # Of a frame of its own: the beams are learned by frame.
        (surface_msg,) = self.ask(make, floor, frame_id="recorded")
        result = expected(scan)
        cloud = read_cloud(surface_msg)
        self.assertGreater(len(cloud.xyz), 1000)
        np.testing.assert_array_equal(cloud.xyz, result.surface)
        np.testing.assert_array_equal(cloud.ring, result.ring)


if __name__ == "__main__":
    rospy.init_node("check_chain")
    rostest.rosrun(PACKAGE, "chain", ChainTest, sys.argv)
