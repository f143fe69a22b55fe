"""ROS messages from and to NumPy arrays: clouds that come in, results that go out.

The same checks, layouts and markers as the C++ adapters (``include/.../ros``); importable where the
package's messages are built.
"""

import sys
from typing import NamedTuple, Optional

import numpy as np
import rospy
from geometry_msgs.msg import Point, Point32, PolygonStamped, Pose, Quaternion
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from smoke_ground_reconstruction.msg import FloorBoundary

from .reference.sensor_model import rings_from_elevation

_DTYPES = {
    PointField.INT8: "<i1",
    PointField.UINT8: "<u1",
    PointField.INT16: "<i2",
    PointField.UINT16: "<u2",
    PointField.INT32: "<i4",
    PointField.UINT32: "<u4",
    PointField.FLOAT32: "<f4",
    PointField.FLOAT64: "<f8",
}
_TYPE_NAMES = {getattr(PointField, name): name for name in dir(PointField) if name[:3].isupper()}
_DATATYPES = {np.dtype(dtype): datatype for datatype, dtype in _DTYPES.items()}

_SURFACE_FIELDS = (
    ("x", 0, PointField.FLOAT32),
    ("y", 4, PointField.FLOAT32),
    ("z", 8, PointField.FLOAT32),
    ("intensity", 12, PointField.FLOAT32),
    ("ring", 16, PointField.UINT16),
    ("provenance", 18, PointField.UINT8),
    ("confidence", 20, PointField.FLOAT32),
    ("sigma", 24, PointField.FLOAT32),
)
_SURFACE_STEP = 28


class CloudError(ValueError):
    """A PointCloud2 that cannot be read; the text says why and lists its fields."""


class CloudPoints(NamedTuple):
    """The points of a cloud, row by row.

    Attributes
    ----------
    xyz : (N, 3) float32 [m]
    intensity : (N,) float32
    ring : (N,) uint16
    has_ring : bool
        False: the driver sends none, and `ring` was derived from elevation.
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    has_ring: bool


# --- clouds -------------------------------------------------------------------------------------


def describe_fields(msg: PointCloud2) -> str:
    """Name, datatype and offset of each field on one line, for error messages."""
    shown = []
    for field in msg.fields:
        name = _TYPE_NAMES.get(field.datatype, f"type {field.datatype}")
        count = f"[{field.count}]" if field.count > 1 else ""
        shown.append(f"{field.name} {name}{count} @{field.offset}")
    return ", ".join(shown) or "none"


def structured_points(msg: PointCloud2) -> np.ndarray:
    """The points as a structured array (N,) on the message's own bytes, fields by name.

    Raises
    ------
    CloudError
        On sizes that contradict ``row_step``, ``point_step`` or the data, a field outside its point
        or of an unknown datatype, and big-endian data. An empty cloud is valid whatever its fields.
    """
    if msg.width * msg.height == 0:
        return np.zeros(0, _dtype_of(msg.fields))
    return _point_bytes(msg).reshape(-1).view(_dtype_of(msg.fields, msg.point_step))


def read_cloud(msg: PointCloud2) -> CloudPoints:
    """Coordinates, intensity and ring of a cloud, found by name and datatype.

    x, y, z are FLOAT32 or FLOAT64, `intensity` any number, `ring` any integer; a missing `ring` is
    derived from elevation. Raises CloudError as :func:`structured_points`, and on a missing or
    unreadable field (the text lists the fields found).
    """
    points = structured_points(msg)
    if len(points) == 0:
        has_ring = "ring" in (points.dtype.names or ())
        empty = np.zeros(0, np.float32)
        return CloudPoints(empty.reshape(0, 3), empty, np.zeros(0, np.uint16), has_ring)
    xyz = np.column_stack([_column(msg, points, name, "f", "FLOAT32 or FLOAT64") for name in "xyz"])
    xyz = xyz.astype(np.float32)
    intensity = _column(msg, points, "intensity", "fiu", "numbers").astype(np.float32)
    if "ring" not in points.dtype.names:
        return CloudPoints(xyz, intensity, rings_from_elevation(xyz), False)
    ring = _column(msg, points, "ring", "iu", "integers")
    if ring.min() < 0 or ring.max() > 0xFFFF:
        bad = int(np.flatnonzero((ring < 0) | (ring > 0xFFFF))[0])
        raise CloudError(f"ring {ring[bad]} of point {bad} is outside 0..65535")
    return CloudPoints(xyz, intensity, ring.astype(np.uint16), True)


def select_points(msg: PointCloud2, which, appended=None) -> PointCloud2:
    """Some points of a checked cloud: same header, same fields, same order, height 1.

    Parameters
    ----------
    which : (N,) bool
    appended : dict of (N,) arrays, optional
        Fields added after the cloud's own, one value per point of `msg`. CloudError where the cloud
        has a field of that name already.
    """
    which = np.asarray(which, bool)
    parts = [_point_bytes(msg)[which]]
    step = msg.point_step
    cut = PointCloud2(header=msg.header, height=1, is_bigendian=False, is_dense=True)
    cut.fields = list(msg.fields)
    for name, values in (appended or {}).items():
        if any(field.name == name for field in msg.fields):
            raise CloudError(f"the cloud has a field '{name}' already")
        cut.fields.append(PointField(name, step, _DATATYPES[values.dtype], 1))
        kept = np.ascontiguousarray(values[which])
        parts.append(kept.view(np.uint8).reshape(len(kept), kept.itemsize))
        step += values.dtype.itemsize
    return _filled(cut, np.hstack(parts), step)


def scan_message(header, xyz, intensity, ring, t=None) -> PointCloud2:
    """A scan as a cloud: x y z intensity FLOAT32, ring UINT16 and, where given, t FLOAT32 [s]."""
    columns = [("x", xyz[:, 0]), ("y", xyz[:, 1]), ("z", xyz[:, 2]), ("intensity", intensity)]
    columns = [(name, np.asarray(values, np.float32)) for name, values in columns]
    columns.append(("ring", np.asarray(ring, np.uint16)))
    if t is not None:
        columns.append(("t", np.asarray(t, np.float32)))
    layout, offset = [], 0
    for name, values in columns:
        layout.append((name, offset, _DATATYPES[values.dtype]))
        offset += values.dtype.itemsize
    return _packed(header, layout, offset, dict(columns))


# --- results ------------------------------------------------------------------------------------


def surface_message(
    header, xyz, intensity, ring, provenance, confidence, sigma=None
) -> PointCloud2:
    """The floor's points: x y z intensity FLOAT32, ring UINT16, provenance UINT8, confidence and
    sigma FLOAT32; 28 bytes each. Sigma is NaN where none is stated."""
    if sigma is None:
        sigma = np.full(len(xyz), np.nan, np.float32)
    values = {"x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2], "intensity": intensity}
    values.update(ring=ring, provenance=provenance, confidence=confidence, sigma=sigma)
    return _packed(header, _SURFACE_FIELDS, _SURFACE_STEP, values)


def occupancy_message(header, grid, rotation=None, sensor_height=0.0) -> OccupancyGrid:
    """A grid on the floor: its origin is turned and lowered by the mounting.

    Parameters
    ----------
    grid : object
        ``cells`` (height, width) int8, ``resolution`` [m], ``first_column``, ``first_row``.
    rotation : (3, 3), optional
        R_level_sensor.
    sensor_height : float
        Of the sensor above the floor [m].
    """
    cells = np.asarray(grid.cells, np.int8)
    R_sensor_level = np.eye(3) if rotation is None else np.asarray(rotation, np.float64).T
    corner = np.array([grid.first_column, grid.first_row, 0.0]) * grid.resolution
    corner[2] = -sensor_height
    message = OccupancyGrid(header=header)
    message.info.map_load_time = header.stamp
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = cells.shape
    message.info.origin = Pose(Point(*(R_sensor_level @ corner)), _quaternion(R_sensor_level))
    message.data = cells.ravel().tolist()
    return message


def boundary_message(header, boundary, boundary_kind) -> FloorBoundary:
    """The outline (K, 3) [m] with the kind of each vertex (K,) uint8."""
    kinds = np.asarray(boundary_kind, np.uint8).tobytes()
    return FloorBoundary(header=header, points=_points32(boundary), kinds=kinds)


def polygon_message(header, boundary) -> PolygonStamped:
    """The outline (K, 3) [m] without its kinds, for display."""
    message = PolygonStamped(header=header)
    message.polygon.points = _points32(boundary)
    return message


# --- markers: what an operator is shown -----------------------------------------------------------

_LIFETIME = 1.0  # [s]; a floor that is not renewed must not stay in sight
_LINE_WIDTH = 0.06  # [m]
_TEXT_HEIGHT = 0.3  # [m]
_TEXT_LIFT = 1.0  # of a text's middle above the floor [m]
_WALL_SEEN, _WALL_INFERRED, _LIMIT_OF_KNOWLEDGE = 0, 1, 2
_COLORS = {
    _WALL_SEEN: (0.1, 0.8, 0.3),
    _WALL_INFERRED: (1.0, 0.6, 0.0),
    _LIMIT_OF_KNOWLEDGE: (0.9, 0.1, 0.1),
}
_WORDS = {
    _WALL_SEEN: "wall {:.1f} m",
    _WALL_INFERRED: "wall inferred {:.1f} m",
    _LIMIT_OF_KNOWLEDGE: "unknown beyond {:.1f} m",
}
_LOOKS = (("FRONT", 1, 0), ("LEFT", 0, 1), ("BACK", -1, 0), ("RIGHT", 0, -1))


class FloorLimit(NamedTuple):
    """Where a look along the floor leaves the claimed floor."""

    distance: float  #: along the floor from the point below the sensor [m]
    kind: int


def limit_of_floor(level_boundary, boundary_kind, x, y) -> Optional[FloorLimit]:
    """First limit of the floor in the direction (x, y), a unit vector.

    `level_boundary` is (K, 3) in the level frame. None where no floor is claimed in that direction.
    """
    a = np.asarray(level_boundary, np.float64).reshape(-1, 3)
    b = np.roll(a, -1, axis=0)
    kinds = np.asarray(boundary_kind, np.uint8)
    kinds = np.maximum(kinds, np.roll(kinds, -1))  # the less certain end speaks for an edge
    side_a, side_b = x * a[:, 1] - y * a[:, 0], x * b[:, 1] - y * b[:, 0]
    crosses = (side_a > 0) != (side_b > 0)
    a, b, kinds, side_a, side_b = (v[crosses] for v in (a, b, kinds, side_a, side_b))
    along_a, along_b = x * a[:, 0] + y * a[:, 1], x * b[:, 0] + y * b[:, 1]
    distance = along_a + (along_b - along_a) * side_a / (side_a - side_b)
    ahead = distance > 0
    if ahead.sum() % 2 == 0:  # an odd number of crossings: the look begins on claimed floor
        return None
    distance, kinds = distance[ahead], kinds[ahead]
    nearest = int(np.argmin(distance))
    return FloorLimit(float(distance[nearest]), int(kinds[nearest]))


def marker_message(header, boundary, boundary_kind, mounting) -> MarkerArray:
    """The outline coloured by what ends the floor there (green: a wall was seen, orange: a wall is
    inferred, red: nothing is known beyond), and in words how far that is to the four sides.

    `mounting` is a :class:`.reference.scan.Mounting`.
    """
    boundary = np.asarray(boundary, np.float32).reshape(-1, 3)
    kinds = np.asarray(boundary_kind, np.uint8)
    markers = [_outline_marker(header, boundary, kinds, kind) for kind in _COLORS]
    level = mounting.to_level(boundary)
    for number, (name, x, y) in enumerate(_LOOKS):
        limit = limit_of_floor(level, kinds, x, y)
        markers += _look_markers(header, number, name, x, y, limit, mounting)
    markers.append(_legend(header, len(boundary) > 0, mounting))
    return MarkerArray(markers)


def _outline_marker(header, boundary, kinds, kind):
    lines = _marker(header, "outline", kind, Marker.LINE_LIST, _COLORS[kind])
    lines.scale.x = _LINE_WIDTH
    following = np.roll(np.arange(len(boundary)), -1)
    for i in np.flatnonzero(np.maximum(kinds, kinds[following]) == kind):
        lines.points += [Point(*boundary[i].tolist()), Point(*boundary[following[i]].tolist())]
    if not lines.points:
        lines.action = Marker.DELETE
    return lines


def _look_markers(header, number, name, x, y, limit, mounting):
    distance = 1.0 if limit is None else limit.distance
    color = _COLORS[_LIMIT_OF_KNOWLEDGE if limit is None else limit.kind]
    words = "unknown" if limit is None else _WORDS[limit.kind].format(distance)
    line = _marker(header, "look", number, Marker.LINE_STRIP, color)
    line.scale.x = _LINE_WIDTH / 3
    line.points = [
        _on_floor(mounting, 0, 0, 0),
        _on_floor(mounting, x * distance, y * distance, 0),
    ]
    if limit is None:
        line.action = Marker.DELETE
    text = _text(header, "distance", number, color, f"{name}\n{words}")
    text.pose.position = _on_floor(mounting, x * distance, y * distance, _TEXT_LIFT)
    return [line, text]


def _legend(header, claims_floor, mounting):
    color = (1.0, 1.0, 1.0) if claims_floor else _COLORS[_LIMIT_OF_KNOWLEDGE]
    words = "green: wall seen   orange: wall inferred   red: unknown beyond"
    text = _text(header, "legend", 0, color, words if claims_floor else "NO FLOOR KNOWN")
    text.scale.z = _TEXT_HEIGHT * 2 / 3
    text.pose.position = _on_floor(mounting, 0, 0, mounting.sensor_height + _TEXT_LIFT)
    return text


def _text(header, ns, number, color, words):
    marker = _marker(header, ns, number, Marker.TEXT_VIEW_FACING, color)
    marker.scale.z = _TEXT_HEIGHT
    marker.text = words
    return marker


def _marker(header, ns, number, kind, color):
    marker = Marker(header=header, ns=ns, id=number, type=kind, action=Marker.ADD)
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(*color, 1.0)
    marker.lifetime = rospy.Duration.from_sec(_LIFETIME)
    return marker


def _on_floor(mounting, x, y, lift):
    level = np.array([[x, y, lift - mounting.sensor_height]], np.float32)
    return Point(*mounting.to_sensor(level)[0].tolist())


# --- helpers --------------------------------------------------------------------------------------


def _point_bytes(msg):
    """The bytes of a checked cloud's points, uint8 (N, point_step), padding of rows cut off."""
    if msg.width * msg.height == 0:
        return np.zeros((0, msg.point_step), np.uint8)
    _check_sizes(msg)
    _check_fields(msg)
    rows = np.frombuffer(msg.data, np.uint8, msg.height * msg.row_step)
    used = rows.reshape(msg.height, msg.row_step)[:, : msg.width * msg.point_step]
    return np.ascontiguousarray(used).reshape(-1, msg.point_step)


def _dtype_of(fields, point_step=None):
    formats = {}  # the first of two fields of one name
    for field in fields:
        dtype = _DTYPES.get(field.datatype, "V1")
        count = max(field.count, 1)  # some drivers leave it at 0 for a single value
        formats.setdefault(field.name, (dtype if count == 1 else (dtype, count), field.offset))
    if point_step is None:
        return np.dtype([(name, form) for name, (form, _) in formats.items()])
    return _laid_out([(name, offset, form) for name, (form, offset) in formats.items()], point_step)


def _laid_out(columns, step):
    names, offsets, formats = ([column[i] for column in columns] for i in range(3))
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})


def _check_sizes(msg):
    row = msg.width * msg.point_step
    if msg.is_bigendian:
        raise CloudError("big-endian clouds are not read")
    if msg.point_step == 0:
        raise CloudError("point_step is 0")
    if msg.row_step < row:
        raise CloudError(f"row_step {msg.row_step} is less than width * point_step = {row}")
    if len(msg.data) < msg.height * msg.row_step:
        asked = msg.height * msg.row_step
        raise CloudError(f"data holds {len(msg.data)} bytes, height * row_step asks {asked}")


def _check_fields(msg):
    for field in msg.fields:
        if field.datatype not in _DTYPES:
            raise CloudError(f"field '{field.name}' has unknown datatype {field.datatype}")
        size = np.dtype(_DTYPES[field.datatype]).itemsize * max(field.count, 1)
        if field.offset + size > msg.point_step:
            raise CloudError(
                f"field '{field.name}' reaches beyond point_step {msg.point_step}; "
                f"fields: {describe_fields(msg)}"
            )


def _column(msg, points, name, kinds, types):
    names = points.dtype.names or ()
    if name not in names or points[name].ndim != 1 or points.dtype[name].kind not in kinds:
        raise CloudError(f"no single field '{name}' of {types}; fields: {describe_fields(msg)}")
    return points[name]


def _packed(header, layout, step, values):
    """A cloud of the columns in `values`, laid out as (name, offset, datatype)."""
    dtype = _laid_out([(name, offset, _DTYPES[kind]) for name, offset, kind in layout], step)
    points = np.zeros(len(values["x"]), dtype)
    for name, _, _ in layout:
        points[name] = values[name]
    cloud = PointCloud2(header=header, height=1, is_bigendian=False, is_dense=True)
    cloud.fields = [PointField(name, offset, datatype, 1) for name, offset, datatype in layout]
    return _filled(cloud, points, step)


def _filled(cloud, points, step):
    cloud.point_step = step
    cloud.width = len(points)
    cloud.row_step = cloud.width * step
    cloud.data = points.tobytes()
    return cloud


def _points32(boundary):
    return [Point32(*vertex) for vertex in np.asarray(boundary, np.float32).tolist()]


def _quaternion(R):
    """Of a rotation matrix, from its largest component (Shepperd's method)."""
    diagonal = np.diag(R)
    squares = 1 + np.array([diagonal.sum(), *(2 * diagonal - diagonal.sum())])  # 4 w^2, 4 x^2, ...
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    products = np.diag(squares)
    products[0, 1:] = products[1:, 0] = x, y, z
    products[1, 2] = products[2, 1] = R[0, 1] + R[1, 0]
    products[1, 3] = products[3, 1] = R[0, 2] + R[2, 0]
    products[2, 3] = products[3, 2] = R[1, 2] + R[2, 1]
    largest = int(np.argmax(squares))
    w, x, y, z = products[largest] / (2.0 * np.sqrt(squares[largest]))
    return Quaternion(x, y, z, w)


if sys.byteorder != "little":  # the structured dtypes above name their order; the copies would not
    raise ImportError("ros_messages needs a little-endian machine")
