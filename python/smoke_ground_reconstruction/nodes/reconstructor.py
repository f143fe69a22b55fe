"""The reconstructor as a rospy node: raw scan, ``~ground`` and ``~walls`` of one stamp -> floor."""

import message_filters
import rospy
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from smoke_ground_reconstruction.cfg import ReconstructorConfig
from smoke_ground_reconstruction.msg import FloorBoundary

from ..params import ReconstructorParams, divides_circle
from ..reference.label import Label
from ..reference.occupancy import rasterize
from ..reference.polar_segments import PolarSegments
from ..reference.room_boundary import RoomBoundary
from ..reference.scan import ScanView
from ..reference.sensor_model import SensorModel
from ..ros_messages import (
    boundary_message,
    marker_message,
    occupancy_message,
    polygon_message,
    read_cloud,
    surface_message,
)
from .lazy_node import BUFFER_SIZE, LazyNode, publish_if_heard
from .mounting_source import MountingSource

_SYNC_QUEUE_SIZE = 40  # raw scans wait here for the stages before: seconds, if those are slow


class ReconstructorNode(LazyNode):
    """Runs the reference's method of reconstruction in the place of the nodelet."""

    def __init__(self):
        super().__init__(ReconstructorParams, ReconstructorConfig)
        self._subscribers = []
        self._mounting = MountingSource()
        self._rings = rospy.get_param("~sensor_beams/rings", None)  # [elevation, offset] each
        self._sensors = {}  # by frame_id
        self._rooms = {}  # RoomBoundary by frame_id
        self._surface_pub = self.advertise("~ground_surface", PointCloud2)
        self._occupancy_pub = self.advertise("~occupancy", OccupancyGrid)
        self._boundary_pub = self.advertise("~boundary", FloorBoundary)
        self._polygon_pub = self.advertise("~boundary_polygon", PolygonStamped)
        self._markers_pub = self.advertise("~markers", MarkerArray)
        self.start()

    def start_listening(self):
        """Subscribe to the inputs."""
        self._subscribers = [
            message_filters.Subscriber(
                topic,
                PointCloud2,
                queue_size=_SYNC_QUEUE_SIZE,
                buff_size=BUFFER_SIZE,
                tcp_nodelay=True,
            )
            for topic in ("~input", "~ground", "~walls")
        ]
        self._subscribers[0].registerCallback(lambda _: self.health.input_arrived())
        synchronizer = message_filters.TimeSynchronizer(self._subscribers, _SYNC_QUEUE_SIZE)
        synchronizer.registerCallback(self._on_scan)

    def stop_listening(self):
        """Unsubscribe."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def repair(self, config):
        """Segments must divide the circle."""
        config["segment_angle_deg"] = nearest_divisor_of_360(config["segment_angle_deg"])

    def _on_scan(self, raw, ground, walls):
        self.handle_scan(raw.header, lambda timing: self._reconstruct(raw, ground, walls, timing))

    def _reconstruct(self, raw, ground, walls, timing):
        params = self.params
        for cloud, topic in ((raw, "~input"), (ground, "~ground"), (walls, "~walls")):
            timing.received(cloud)
            _check_frame(raw, cloud, topic)
        scan, ground_view, walls_view = (_view_of(cloud) for cloud in (raw, ground, walls))
        mounting = self._mounting.at(raw.header, params.sensor_height)
        sensor = self._observe(raw.header.frame_id, scan)
        timing.finish("organise", len(scan.xyz), len(scan.xyz))

        if params.method == "room_boundary":
            rooms = self._rooms.setdefault(raw.header.frame_id, RoomBoundary())
            room = rooms.reconstruct(scan, sensor, mounting)
            surface, points_in = room.surface, len(scan.xyz)
            walls_view = scan.select(room.labels == Label.WALL)
        else:
            surface = PolarSegments(params).reconstruct(ground_view, walls_view, sensor, mounting)
            points_in = len(ground_view.xyz) + len(walls_view.xyz)
        timing.finish("reconstruct", points_in, len(surface))

        self._publish_floor(raw.header, surface, mounting, timing)
        publish_if_heard(
            self._occupancy_pub,
            lambda: occupancy_message(
                raw.header,
                rasterize(surface, walls_view, mounting, params.occupancy_resolution),
                mounting.rotation,
                mounting.sensor_height,
            ),
        )
        timing.finish("publish", len(surface), len(surface))
        return len(scan.xyz), len(surface)

    def _publish_floor(self, header, surface, mounting, timing):
        outline = (header, surface.boundary, surface.boundary_kind)
        arrays = (surface.xyz, surface.intensity, surface.ring, surface.provenance)
        timing.published(
            publish_if_heard(
                self._surface_pub, lambda: surface_message(header, *arrays, surface.confidence)
            )
        )
        publish_if_heard(self._boundary_pub, lambda: boundary_message(*outline))
        publish_if_heard(self._polygon_pub, lambda: polygon_message(*outline[:2]))
        publish_if_heard(self._markers_pub, lambda: marker_message(*outline, mounting))

    def _observe(self, frame_id, scan):
        if frame_id not in self._sensors:
            self._sensors[frame_id] = self._make_sensor()
        self._sensors[frame_id].observe(scan)
        return self._sensors[frame_id]

    def _make_sensor(self):
        if self._rings is None:
            return SensorModel()
        return SensorModel.from_elevations([elevation for elevation, _ in self._rings])


def nearest_divisor_of_360(width_deg: float) -> float:
    """The angle next to `width_deg` that divides 360 into 4 to 36,000 bins."""
    if not width_deg > 0.0 or divides_circle(width_deg):
        return width_deg
    return 360.0 / min(max(round(360.0 / width_deg), 4), 36000)


def _view_of(msg):
    cloud = read_cloud(msg)
    return ScanView(cloud.xyz, cloud.intensity, cloud.ring)


def _check_frame(raw, part, topic):
    if part.header.frame_id != raw.header.frame_id:
        raise ValueError(
            f"{topic} is in frame '{part.header.frame_id}', ~input in '{raw.header.frame_id}'"
        )


def main():
    """Run the node until ROS ends it."""
    rospy.init_node("reconstructor")
    ReconstructorNode()
    rospy.spin()
