"""Scans and floors in ROS bags, one message at a time: a bag of any length in constant memory."""

import contextlib
import dataclasses
from typing import Any, Dict, Iterable, Iterator, List, Optional, Tuple

import genpy
import numpy as np
import rosbag
from std_msgs.msg import Header

from smoke_ground_reconstruction import ros_messages
from smoke_ground_reconstruction.console import note
from smoke_ground_reconstruction.io import DataError, replacing
from smoke_ground_reconstruction.io.clouds import (
    Floor,
    LidarScan,
    fitted_plane,
    floor_from_fields,
    floor_of_result,
)
from smoke_ground_reconstruction.reference.label import NO_CLUSTER, Label
from smoke_ground_reconstruction.reference.scan import Mounting

CLOUD_TYPE = "sensor_msgs/PointCloud2"
BOUNDARY_TYPE = "smoke_ground_reconstruction/FloorBoundary"
NAMESPACE = "/ground_reconstruction"
SCAN_TOPIC = "/lidar_points"
SURFACE = "reconstructor/ground_surface"
BOUNDARY = "reconstructor/boundary"
WALLS = "segmenter/walls"

# Floors whose other messages are waited for while a bag is read; a recorder may shuffle that many.
_WAITING_FLOORS = 16


class Scans:
    """The scans of one topic of a bag, read one by one.

    Parameters
    ----------
    path : the bag
    topic : topic of the clouds; None: the only sensor_msgs/PointCloud2 topic there is
    index : only this scan, 0 the first; None: all

    Raises
    ------
    DataError : no readable bag, no such topic, more than one to choose from, no such scan.
    """

    def __init__(self, path: str, topic: Optional[str] = None, index: Optional[int] = None):
        self.path = path
        with _opened(path) as bag:
            clouds = _topics(bag, CLOUD_TYPE)
        self.topic = _chosen_topic(path, clouds, topic)
        self._total = clouds[self.topic]
        self._index = index
        self._noted_ring = False
        if index is not None and not 0 <= index < self._total:
            raise DataError(f"{path}: no scan {index}; {self.topic} has 0 to {self._total - 1}")

    def __len__(self) -> int:
        return self._total if self._index is None else 1

    def __iter__(self) -> Iterator[LidarScan]:
        with _opened(self.path) as bag:
            for number, raw in enumerate(bag.read_messages(topics=[self.topic], raw=True)):
                if self._index is None or number == self._index:
                    yield self._scan(number, raw)

    def _scan(self, number: int, raw) -> LidarScan:
        message = _decoded(raw)
        try:
            points = ros_messages.read_cloud(message)
        except ros_messages.CloudError as error:
            raise DataError(f"{self.path}: scan {number} of {self.topic}: {error}") from error
        if not points.has_ring and not self._noted_ring:
            self._noted_ring = True
            note(f"{self.path}: no field 'ring'; told from the points' elevations")
        return LidarScan(
            xyz=points.xyz,
            intensity=points.intensity,
            ring=points.ring,
            t=_relative_time(ros_messages.structured_points(message)),
            stamp_ns=message.header.stamp.to_nsec(),
            frame_id=message.header.frame_id,
            message=message,
            recorded_ns=raw.timestamp.to_nsec(),
        )


class Floors:
    """The floors in a bag, each joined from the messages of one stamp. Read one by one.

    Raises
    ------
    DataError : no readable bag, or no topic of floors in it.
    """

    def __init__(self, path: str, index: Optional[int] = None):
        self.path = path
        with _opened(path) as bag:
            clouds, outlines = _topics(bag, CLOUD_TYPE), _topics(bag, BOUNDARY_TYPE)
        self._topics = {
            SURFACE: _topic_ending(clouds, SURFACE),
            WALLS: _topic_ending(clouds, WALLS),
            BOUNDARY: _topic_ending(outlines, BOUNDARY),
        }
        if self._topics[SURFACE] is None:
            raise DataError(f"{path}: no topic .../{SURFACE}; clouds in it: {_listed(clouds)}")
        self._total = clouds[self._topics[SURFACE]]
        self._index = index
        if index is not None and not 0 <= index < self._total:
            raise DataError(f"{path}: no floor {index}; it has 0 to {self._total - 1}")

    def __len__(self) -> int:
        return self._total if self._index is None else 1

    def __iter__(self) -> Iterator[Floor]:
        for number, group in enumerate(self._groups()):
            if self._index is None or number == self._index:
                yield self._floor(group)

    def _groups(self) -> Iterator[Dict[str, object]]:
        """Messages of one stamp, by the end of their topic; in the order of their first message."""
        kinds = {topic: kind for kind, topic in self._topics.items() if topic is not None}
        waiting: Dict[int, Dict[str, object]] = {}
        with _opened(self.path) as bag:
            for raw in bag.read_messages(topics=list(kinds), raw=True):
                message = _decoded(raw)
                group = waiting.setdefault(message.header.stamp.to_nsec(), {})
                group[kinds[raw.topic]] = message
                first = next(iter(waiting))
                if len(waiting[first]) == len(kinds) or len(waiting) > _WAITING_FLOORS:
                    yield from _with_surface(waiting.pop(first))
        for group in waiting.values():
            yield from _with_surface(group)

    def _floor(self, group: Dict[str, object]) -> Floor:
        surface = group[SURFACE]
        points = ros_messages.structured_points(surface)
        fields = {name: np.ascontiguousarray(points[name]) for name in points.dtype.names}
        floor = floor_from_fields(self.path, fields)
        return dataclasses.replace(
            floor,
            **_outline(group.get(BOUNDARY)),
            floor_plane=fitted_plane(floor.xyz),
            walls=_walls(group.get(WALLS)),
            stamp_ns=surface.header.stamp.to_nsec(),
            frame_id=surface.header.frame_id,
        )


class FloorWriter:
    """Writes the output topics of the three nodelets, one message a scan, stamps kept.

    A context manager; the bag takes its name when all has gone well.
    """

    def __init__(self, path: str):
        self._stack = contextlib.ExitStack()
        self.path = path

    def __enter__(self) -> "FloorWriter":
        part = self._stack.enter_context(replacing(self.path))
        self._bag = self._stack.enter_context(rosbag.Bag(part, "w"))
        return self

    def __exit__(self, *failure) -> None:
        self._stack.__exit__(*failure)

    def add_result(self, scan: LidarScan, result, sensor_height: float) -> None:
        """What the nodelets publish for one scan; `result` as Pipeline.process() returns it."""
        for topic, message in _messages_of_result(scan, result, sensor_height):
            self._write(topic, message, scan)

    def add_floor(self, floor: Floor) -> None:
        """The surface, its outline and the walls of a floor, as far as they are known."""
        header = _header(floor)
        self._write(SURFACE, _surface_message(header, floor), floor)
        self._write(BOUNDARY, _boundary_message(header, floor), floor)
        if floor.walls is not None:
            self._write(WALLS, _bare_walls(header, floor.walls), floor)

    def _write(self, topic: str, message, source) -> None:
        recorded_ns = getattr(source, "recorded_ns", None) or source.stamp_ns
        self._bag.write(f"{NAMESPACE}/{topic}", message, _time(recorded_ns))


def write_scans(path: str, scans: Iterable[LidarScan]) -> None:
    """Writes clouds of x y z intensity FLOAT32, ring UINT16 and, where known, t FLOAT32 [s]."""
    with replacing(path) as part, rosbag.Bag(part, "w") as bag:
        for scan in scans:
            bag.write(SCAN_TOPIC, _scan_message(scan), _time(scan.stamp_ns))


def holds_floors(path: str) -> bool:
    """Does a bag hold floors (rather than scans alone)?"""
    with _opened(path) as bag:
        return _topic_ending(_topics(bag, CLOUD_TYPE), SURFACE) is not None


# --- reading --------------------------------------------------------------------------------------


@contextlib.contextmanager
def _opened(path: str) -> Iterator[rosbag.Bag]:
    try:
        bag = rosbag.Bag(path)
    except rosbag.ROSBagUnindexedException as error:
        raise DataError(
            f"{path}: no index, the recording was cut off; run `rosbag reindex` on it"
        ) from error
    except rosbag.ROSBagException as error:
        raise DataError(f"{path}: not a readable bag ({error})") from error
    with bag:
        yield bag


def _topics(bag: rosbag.Bag, type_name: str) -> Dict[str, int]:
    """Number of messages per topic of a type."""
    topics = bag.get_type_and_topic_info().topics
    return {t: info.message_count for t, info in topics.items() if info.msg_type == type_name}


def _chosen_topic(path: str, clouds: Dict[str, int], topic: Optional[str]) -> str:
    if topic is not None:
        named = topic if topic in clouds else f"/{topic}"
        if named not in clouds:
            raise DataError(f"{path}: no {CLOUD_TYPE} on {topic}; it has {_listed(clouds)}")
        return named
    if not clouds:
        raise DataError(f"{path}: no {CLOUD_TYPE} in it")
    if len(clouds) > 1:
        raise DataError(f"{path}: several topics of clouds, name one by --topic: {_listed(clouds)}")
    return next(iter(clouds))


def _topic_ending(topics: Dict[str, int], ending: str) -> Optional[str]:
    return next((topic for topic in sorted(topics) if topic.endswith(ending)), None)


def _listed(topics: Dict[str, int]) -> str:
    return ", ".join(f"{topic} ({count})" for topic, count in sorted(topics.items())) or "none"


def _decoded(raw):
    message_type, content, _, _, python_type = raw.message
    message = python_type()
    try:
        message.deserialize(content)
    except genpy.DeserializationError as error:
        raise DataError(f"{raw.topic}: a broken {message_type} ({error})") from error
    return message


def _relative_time(points: np.ndarray) -> Optional[np.ndarray]:
    """Seconds since the first point, from whatever field of time the driver has."""
    for name, unit in (("t", 1e-9), ("time", 1.0), ("timestamp", 1.0)):
        if name not in (points.dtype.names or ()) or len(points) == 0:
            continue
        # A t in float is in seconds, as we write it; drivers send it in nanoseconds.
        scale = 1.0 if points[name].dtype.kind == "f" else unit
        seconds = points[name].astype(np.float64) * scale
        return (seconds - seconds.min()).astype(np.float32)
    return None


def _with_surface(group: Dict[str, object]) -> List[Dict[str, object]]:
    return [group] if SURFACE in group else []


def _outline(message) -> Dict[str, np.ndarray]:
    if message is None:
        return {}
    vertices = [(point.x, point.y, point.z) for point in message.points]
    return {
        "boundary": np.array(vertices, np.float32).reshape(-1, 3),
        "boundary_kind": np.frombuffer(bytes(message.kinds), np.uint8).copy(),
    }


def _walls(message) -> Optional[np.ndarray]:
    return None if message is None else ros_messages.read_cloud(message).xyz


# --- writing --------------------------------------------------------------------------------------


def _time(nanoseconds: int) -> genpy.Time:
    return genpy.Time(nanoseconds // 10**9, nanoseconds % 10**9)


def _header(source) -> Header:
    return Header(stamp=_time(source.stamp_ns), frame_id=source.frame_id)


def _scan_message(scan: LidarScan):
    return ros_messages.scan_message(_header(scan), scan.xyz, scan.intensity, scan.ring, scan.t)


def _surface_message(header: Header, floor: Floor):
    return ros_messages.surface_message(
        header,
        floor.xyz,
        floor.intensity,
        floor.ring,
        floor.provenance,
        floor.confidence,
        floor.sigma,
    )


def _boundary_message(header: Header, floor: Floor):
    return ros_messages.boundary_message(header, floor.boundary, floor.boundary_kind)


def _bare_walls(header: Header, walls: np.ndarray):
    nothing = np.zeros(len(walls))
    return ros_messages.scan_message(header, walls, nothing, nothing)


def _messages_of_result(scan: LidarScan, result, sensor_height: float) -> Iterator[Tuple[str, Any]]:
    cloud = _scan_message(scan) if scan.message is None else scan.message
    header = cloud.header
    labels, clusters = result.labels, result.clusters
    is_kept = (labels != Label.INVALID) & (labels != Label.NOISE)
    select = ros_messages.select_points
    # As the nodelets do for a driver that sends no ring, so that all numbers are alike.
    has_ring = any(field.name == "ring" for field in cloud.fields)
    ring = {} if has_ring else {"ring": scan.ring}
    yield "denoiser/denoised", select(cloud, is_kept, ring)
    yield "denoiser/noise", select(cloud, labels == Label.NOISE, ring)
    yield "segmenter/ground", select(cloud, labels == Label.GROUND, ring)
    yield WALLS, select(cloud, clusters != NO_CLUSTER, {**ring, "cluster": clusters})
    floor = floor_of_result(result, scan)
    grid = ros_messages.occupancy_message(header, result.occupancy, sensor_height=sensor_height)
    mounting = Mounting(sensor_height=sensor_height)
    outline, kind = result.boundary, result.boundary_kind
    yield SURFACE, _surface_message(header, floor)
    yield "reconstructor/occupancy", grid
    yield BOUNDARY, _boundary_message(header, floor)
    yield "reconstructor/boundary_polygon", ros_messages.polygon_message(header, outline)
    yield "reconstructor/markers", ros_messages.marker_message(header, outline, kind, mounting)
