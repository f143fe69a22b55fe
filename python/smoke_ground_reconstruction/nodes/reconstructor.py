"""The reconstructor as a rospy node: raw scan, and what its method needs besides -> floor."""

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
from .findings import findings_of, height_warning
from .lazy_node import BUFFER_SIZE, LazyNode, publish_if_heard, run
from .mounting_source import MountingSource

_RAW_ALONE = ("~input",)
_RAW_GROUND_WALLS = ("~input", "~ground", "~walls")
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

    def inputs_of(self, params):
        """`room_boundary` denoises and segments by itself: the raw scan is all it takes."""
        return _RAW_ALONE if params.method == "room_boundary" else _RAW_GROUND_WALLS

    def start_listening(self):
        """Subscribe to the inputs."""
        topics = self.inputs_of(self.params)
        if topics == _RAW_ALONE:
            self._subscribers = [self.subscribe("~input", self._on_raw)]
            return
        self._subscribers = [
            message_filters.Subscriber(
                topic,
                PointCloud2,
                queue_size=_SYNC_QUEUE_SIZE,
                buff_size=BUFFER_SIZE,
                tcp_nodelay=True,
            )
            for topic in topics
        ]
        self._subscribers[0].registerCallback(lambda _: self.health.input_arrived())
        synchronizer = message_filters.TimeSynchronizer(self._subscribers, _SYNC_QUEUE_SIZE)
        synchronizer.registerCallback(self._on_parts)

    def stop_listening(self):
        """Unsubscribe."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def repair(self, config):
        """Segments must divide the circle."""
        config["segment_angle_deg"] = nearest_divisor_of_360(config["segment_angle_deg"])

    # The inputs tell the method, not the parameters: those may change while a scan is under way.

    def _on_raw(self, raw):
        self.health.input_arrived()
        self.handle_scan(raw.header, lambda timing: self._find_room(raw, timing))

    def _on_parts(self, raw, ground, walls):
        self.handle_scan(raw.header, lambda timing: self._fill_segments(raw, ground, walls, timing))

    def _find_room(self, raw, timing):
        timing.received(raw)
        scan, sensor, mounting = self._organise(raw, timing)
        method = self._rooms.setdefault(raw.header.frame_id, RoomBoundary())
        method.params = self.params
        room = method.reconstruct(scan, sensor, mounting)
        timing.finish("reconstruct", len(scan.xyz), len(room.surface))
        timing.told(room.visibility)
        given = (mounting.sensor_height, self._mounting.height_is_from)
        warning = height_warning(room.floor, *given)
        self.health.tell(findings_of(room, *given), warning)
        if warning:
            self.warn(warning)
        walls = scan.select(room.labels == Label.WALL)
        self._publish_floor(raw.header, room.surface, walls, mounting, timing)
        return len(scan.xyz), len(room.surface)

    def _fill_segments(self, raw, ground, walls, timing):
        self.health.tell({})
        for cloud, topic in ((raw, "~input"), (ground, "~ground"), (walls, "~walls")):
            timing.received(cloud)
            _check_frame(raw, cloud, topic)
        ground_view, walls_view = _view_of(ground), _view_of(walls)
        scan, sensor, mounting = self._organise(raw, timing)
        method = PolarSegments(self.params)
        surface = method.reconstruct(ground_view, walls_view, sensor, mounting)
        points_in = len(ground_view.xyz) + len(walls_view.xyz)
        timing.finish("reconstruct", points_in, len(surface))
        self._publish_floor(raw.header, surface, walls_view, mounting, timing)
        return len(scan.xyz), len(surface)

    def _organise(self, raw, timing):
        scan = _view_of(raw)
        mounting = self._mounting.at(raw.header, self.params.sensor_height)
        sensor = self._observe(raw.header.frame_id, scan)
        timing.finish("organise", len(scan.xyz), len(scan.xyz))
        return scan, sensor, mounting

    def _publish_floor(self, header, surface, walls, mounting, timing):
        outline = (header, surface.boundary, surface.boundary_kind)
        arrays = (surface.xyz, surface.intensity, surface.ring, surface.provenance)
        certainty = (surface.confidence, surface.sigma)
        publish_if_heard(
            self._surface_pub, lambda: surface_message(header, *arrays, *certainty), timing
        )
        publish_if_heard(self._boundary_pub, lambda: boundary_message(*outline))
        publish_if_heard(self._polygon_pub, lambda: polygon_message(*outline[:2]))
        publish_if_heard(self._markers_pub, lambda: marker_message(*outline, mounting))
        resolution = self.params.occupancy_resolution
        publish_if_heard(
            self._occupancy_pub,
            lambda: occupancy_message(
                header,
                rasterize(surface, walls, mounting, resolution),
                mounting.rotation,
                mounting.sensor_height,
            ),
        )
        timing.finish("publish", len(surface), len(surface))

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
    run("reconstructor", ReconstructorNode)
