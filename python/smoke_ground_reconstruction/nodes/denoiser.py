"""The denoiser as a rospy node: ``~input`` -> ``~denoised`` and ``~noise``."""

import numpy as np
from sensor_msgs.msg import PointCloud2

from smoke_ground_reconstruction.cfg import DenoiserConfig

from ..params import AgdorParams
from ..reference.agdor_filter import AgdorFilter
from ..reference.label import Label
from ..reference.scan import Scan, ScanView
from ..ros_messages import read_cloud, select_points
from .lazy_node import LazyNode, publish_if_heard, run


class DenoiserNode(LazyNode):
    """Runs :class:`AgdorFilter` of the reference in the place of the nodelet."""

    def __init__(self):
        super().__init__(AgdorParams, DenoiserConfig)
        self._input_sub = None
        self._denoised_pub = self.advertise("~denoised", PointCloud2)
        self._noise_pub = self.advertise("~noise", PointCloud2)
        self.start()

    def start_listening(self):
        """Subscribe to the inputs."""
        self._input_sub = self.subscribe("~input", self._on_cloud)

    def stop_listening(self):
        """Unsubscribe."""
        self._input_sub.unregister()

    def repair(self, config):
        """At least one count must be allowed."""
        if config["max_neighbors"] != 0:
            config["max_neighbors"] = max(config["max_neighbors"], config["min_neighbors"] + 1)

    def _on_cloud(self, msg):
        self.health.input_arrived()
        self.handle_scan(msg.header, lambda timing: self._denoise(msg, timing))

    def _denoise(self, msg, timing):
        timing.received(msg)
        cloud = read_cloud(msg)
        if not cloud.has_ring:
            self.warn_of_derived_rings(msg)
        scan = Scan(ScanView(cloud.xyz, cloud.intensity, cloud.ring))
        timing.finish("organise", len(scan), len(scan))

        labels = AgdorFilter(self.params).classify(scan)
        kept = int(np.count_nonzero(labels == Label.KEPT))
        timing.finish("denoise", len(scan), kept)

        rings = {} if cloud.has_ring else {"ring": cloud.ring}
        for publisher, label in ((self._denoised_pub, Label.KEPT), (self._noise_pub, Label.NOISE)):
            which = labels == label
            publish_if_heard(
                publisher, lambda which=which: select_points(msg, which, rings), timing
            )
        timing.finish("publish", kept, kept)
        return len(scan), kept


def main():
    """Run the node until ROS ends it."""
    run("denoiser", DenoiserNode)
