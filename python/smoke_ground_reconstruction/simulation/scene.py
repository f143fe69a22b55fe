"""Rooms from YAML files: walls, floor, furniture, people, robot, smoke source and poses.

World frame: x and y as in the file, z up, all lengths in metres. Keys and their meaning stand in
`config/scenes/README.md`.
"""

import hashlib
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import files, furniture, geometry
from .errors import SceneError
from .keys import read_yaml

WALL_CLEARANCE = 0.10
"""A sensor nearer to a wall's surface than this [m] counts as standing in it."""


@dataclass(frozen=True)
class Pose:
    """Where the sensor stands: `at` (x, y) and `height` above the floor there, angles in degrees.

    `yaw_deg` turns the sensor frame's x axis from the world's x axis; pitch is nose down.
    """

    name: str
    at: tuple
    height: float
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0


@dataclass(frozen=True)
class Patch:
    """A part of the floor at another height: z = a x + b y + c over `polygon`."""

    name: str
    polygon: np.ndarray
    plane: tuple
    is_drop: bool


@dataclass(frozen=True)
class Opening:
    """A window or an open gate in outline edge `edge`, from `start` to `end` along it [m]."""

    edge: int
    start: float
    end: float
    bottom: float
    top: float
    has_glass: bool


@dataclass(frozen=True)
class Item:
    """A piece of furniture, or of the building (`is_wall`), already in its place."""

    label: str
    prisms: tuple
    is_wall: bool


@dataclass(frozen=True)
class Person:
    """Walks to and fro along `path` (N, 2) at `speed` [m/s]."""

    prisms: tuple
    path: np.ndarray
    speed: float

    def motion(self, time):
        """Position (2,) and velocity (2,) at a time [s]."""
        legs = np.diff(self.path, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        total = float(lengths.sum())
        if self.speed == 0.0 or total == 0.0:
            return self.path[0], np.zeros(2)
        done = (self.speed * time) % (2 * total)
        forward = done <= total
        along = done if forward else 2 * total - done
        leg = min(int(np.searchsorted(np.cumsum(lengths), along)), len(legs) - 1)
        unit = legs[leg] / lengths[leg]
        position = self.path[leg] + unit * (along - float(lengths[:leg].sum()))
        return position, unit * (self.speed if forward else -self.speed)


@dataclass(frozen=True)
class Drive:
    """The robot's way for sequences: `points` (N, 2) at `speed` [m/s], sensor `height` [m]."""

    points: np.ndarray
    speed: float
    height: float


@dataclass(frozen=True)
class Outside:
    """What lies beyond windows and gates: ground at z `ground`, facades at `facade` [m]."""

    ground: float
    facade: float
    reflectivity: float


@dataclass(eq=False)
class Scene:
    """A room and everything in it; see load_scene()."""

    name: str
    title: str
    file: str
    digest: str
    bounded: bool
    outline: np.ndarray
    ceiling: float
    reflectivity: dict
    plane: tuple
    patches: list
    pillars: list
    openings: list
    outside: Outside
    objects: list = field(default_factory=list)
    people: list = field(default_factory=list)
    robot: list = field(default_factory=list)
    smoke: dict = field(default_factory=dict)
    poses: list = field(default_factory=list)
    drive: Drive = None

    def floor_z(self, points):
        """Height of the ground (floor or drop) at (M, 2); (M,) [m]."""
        points = np.asarray(points, dtype=float)
        z = plane_z(self.plane, points)
        for patch in self.patches:
            inside = geometry.contains(patch.polygon, points)
            z[inside] = plane_z(patch.plane, points[inside])
        return z

    def is_floor(self, points):
        """Which of (M, 2) lie on the floor polygon: in the room, no pillar, no drop; bool (M,)."""
        inside = geometry.contains(self.outline, points)
        for polygon in self.pillars:
            inside &= ~geometry.contains(polygon, points)
        return inside & ~self.is_drop(points)

    def is_drop(self, points):
        """Which of (M, 2) lie over a hole, stairs or another drop; bool (M,)."""
        over = np.zeros(len(points), dtype=bool)
        for patch in self.patches:
            if patch.is_drop:
                over |= geometry.contains(patch.polygon, points)
        return over

    def error(self, key, message):
        """A SceneError that names the scene's file and the key."""
        return SceneError(f"{self.file}: {key}: {message}")

    def pose(self, which):
        """A Pose by name, index, or as it is.

        Raises
        ------
        SceneError
            If there is no such pose; the message lists those there are.
        """
        if isinstance(which, Pose):
            return which
        if isinstance(which, int) and 0 <= which < len(self.poses):
            return self.poses[which]
        for pose in self.poses:
            if pose.name == which:
                return pose
        known = ", ".join(pose.name for pose in self.poses)
        raise self.error("poses", f"no pose {which!r} (known: {known})")


def plane_z(plane, points):
    """z = a x + b y + c at (M, 2); (M,)."""
    points = np.asarray(points, dtype=float)
    return plane[0] * points[:, 0] + plane[1] * points[:, 1] + plane[2]


def scene_names():
    """Names of the scenes in `config/scenes`, sorted."""
    return files.names("scenes")


def load_scene(name):
    """Read and check a scene.

    Parameters
    ----------
    name : str or Path
        A name in `config/scenes`, or a path that ends in .yaml.

    Raises
    ------
    SceneError
        One line that names the file and the key.
    """
    path = files.resolve(name, "scenes", "scene")
    keys = read_yaml(path)
    room, floor = keys.mapping("room"), keys.mapping("floor")
    outline = geometry.counter_clockwise(_polygon(room, "outline"))
    scene = Scene(
        name=Path(path).stem,
        title=keys.text("title", Path(path).stem),
        file=str(path),
        digest=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
        bounded=keys.flag("bounded"),
        outline=outline,
        ceiling=room.number("ceiling", 2.6, 0.5, 50.0),
        reflectivity=_reflectivity(room, floor),
        plane=floor.numbers("plane", 3, (0.0, 0.0, 0.0)),
        patches=[_patch(item, outline) for item in floor.mappings("patches")],
        pillars=[_pillar(item, outline) for item in room.mappings("pillars")],
        openings=[_opening(item, outline) for item in room.mappings("openings")],
        outside=_outside(keys.mapping("outside")),
    )
    room.finish()
    floor.finish()
    _read_contents(keys, scene)
    keys.finish()
    return scene


def _read_contents(keys, scene):
    scene.objects = [_object(item, scene) for item in keys.mappings("objects")]
    scene.people = [_person(item, scene) for item in keys.mappings("people")]
    scene.robot = [prism for item in keys.mappings("robot") for prism in _robot_part(item)]
    scene.smoke = _smoke(keys.mapping("smoke"))
    scene.poses = [_pose(item, scene) for item in keys.mappings("poses")]
    if not scene.poses:
        raise keys.error("poses", "a scene needs at least one pose")
    if keys.has("drive"):
        scene.drive = _drive(keys.mapping("drive"), scene)


def _reflectivity(room, floor):
    return {
        "floor": floor.number("reflectivity", 0.05, 0.001, 1.0),
        "wall": room.number("wall_reflectivity", 0.6, 0.001, 1.0),
        "ceiling": room.number("ceiling_reflectivity", 0.7, 0.001, 1.0),
        "glass": room.number("glass_reflectivity", 0.3, 0.001, 1.0),
    }


def _polygon(keys, key):
    """Vertices (N, 2) of a polygon whose items are [x, y] or arcs; not crossing itself."""
    pieces = []
    for i, item in enumerate(keys.points(key)):
        if isinstance(item, dict):
            pieces.append(_arc(type(keys)(item, keys.file, f"{keys.path}.{key}[{i}]")))
        else:
            pieces.append(np.array([item], dtype=float))
    polygon = np.vstack(pieces) if pieces else np.empty((0, 2))
    repeated = np.all(np.abs(polygon - np.roll(polygon, 1, axis=0)) < 1e-9, axis=1)
    polygon = polygon[~repeated]
    if len(polygon) < 3:
        raise keys.error(key, "needs at least three different vertices")
    crossing = geometry.crossing_edges(polygon)
    if crossing is not None:
        raise keys.error(key, f"edges {crossing[0]} and {crossing[1]} cross or touch each other")
    return polygon


def _arc(keys):
    inner = keys.mapping("arc")
    vertices = geometry.arc(
        inner.numbers("centre", 2),
        inner.number("radius", low=0.01),
        inner.number("from_deg"),
        inner.number("to_deg"),
        int(inner.number("segments", 32, 2, 720)),
    )
    inner.finish()
    keys.finish()
    return vertices


def _require_in_room(keys, key, outline, points):
    outside = ~geometry.contains(outline, points)
    outside &= geometry.distance_to_edges(outline, points) > 1e-6
    if np.any(outside):
        x, y = np.asarray(points)[np.flatnonzero(outside)[0]]
        raise keys.error(key, f"({x:g}, {y:g}) lies outside the room")


def _patch(keys, outline):
    polygon = geometry.counter_clockwise(_polygon(keys, "polygon"))
    _require_in_room(keys, "polygon", outline, polygon)
    if keys.has("z") == keys.has("plane"):
        raise keys.error("z", "give either z or plane")
    plane = (0.0, 0.0, keys.number("z")) if keys.has("z") else keys.numbers("plane", 3)
    patch = Patch(keys.text("name", "patch"), polygon, plane, keys.flag("drop", False))
    keys.finish()
    return patch


def _pillar(keys, outline):
    polygon = geometry.counter_clockwise(_polygon(keys, "polygon"))
    _require_in_room(keys, "polygon", outline, polygon)
    keys.finish()
    return polygon


def _opening(keys, outline):
    edge = keys.number("edge", low=0, high=len(outline) - 1)
    if edge != int(edge):
        raise keys.error("edge", "must be a whole number")
    length = float(np.linalg.norm(outline[(int(edge) + 1) % len(outline)] - outline[int(edge)]))
    start = keys.number("from", 0.0, 0.0, length)
    end = keys.number("to", length, 0.0, length)
    bottom = keys.number("bottom", 0.0)
    top = keys.number("top", 2.1)
    if end <= start or top <= bottom:
        raise keys.error("to", "an opening must be wider and higher than nothing")
    opening = Opening(int(edge), start, end, bottom, top, keys.flag("glass", False))
    keys.finish()
    return opening


def _outside(keys):
    outside = Outside(
        keys.number("ground", -0.1),
        keys.number("facade", 8.0, 0.5, 50.0),
        keys.number("reflectivity", 0.2, 0.001, 1.0),
    )
    keys.finish()
    return outside


def _object(keys, scene):
    kind = keys.text("type", choices=sorted(furniture.PIECES))
    reflectivity = keys.number("reflectivity", 0.3, 0.001, 1.0)
    at = keys.numbers("at", 2)
    _require_in_room(keys, "at", scene.outline, [at])
    yaw_deg = keys.number("yaw_deg", 0.0)
    label = keys.text("name", kind)
    is_wall = keys.flag("wall", False)
    prisms = furniture.PIECES[kind](keys, reflectivity)
    keys.finish()
    floor_z = float(scene.floor_z([at])[0])
    placed = tuple(prism.placed(at, yaw_deg, floor_z) for prism in prisms)
    return Item(f"{keys.path} ({label})", placed, is_wall)


def _person(keys, scene):
    path = np.array(keys.points("path"), dtype=float).reshape(-1, 2)
    _require_in_room(keys, "path", scene.outline, path)
    speed = keys.number("speed", 1.0, 0.0, 5.0)
    prisms = furniture.person(keys, keys.number("reflectivity", 0.3, 0.001, 1.0))
    keys.finish()
    if len(path) == 0:
        raise keys.error("path", "needs at least one point")
    return Person(tuple(prisms), path, speed if len(path) > 1 else 0.0)


def _robot_part(keys):
    kind = keys.text("type", choices=("box", "cylinder"))
    reflectivity = keys.number("reflectivity", 0.5, 0.001, 1.0)
    at = keys.numbers("at", 2, (0.0, 0.0))
    prisms = furniture.PIECES[kind](keys, reflectivity)
    keys.finish()
    return [prism.placed(at, 0.0, 0.0) for prism in prisms]


def _smoke(keys):
    """Smoke parameters that belong to the room: its source and its layering."""
    found = {}
    if keys.has("source"):
        source = keys.mapping("source")
        found["plume_centre"] = source.numbers("at", 3)
        found["plume_radius"] = source.number("radius", 0.8, 0.05, 10.0)
        found["plume_gain"] = source.number("gain", 2.0, 0.0, 20.0)
        source.finish()
    if keys.has("layer"):
        layer = keys.mapping("layer")
        found["layer_height"] = layer.number("height", 1.0)
        found["layer_thickness"] = layer.number("thickness", 0.4, 0.01, 10.0)
        found["below_layer"] = layer.number("below", 0.3, 0.0, 10.0)
        layer.finish()
    keys.finish()
    return found


def _pose(keys, scene):
    pose = Pose(
        name=keys.text("name"),
        at=keys.numbers("at", 2),
        height=keys.number("height", 0.7, 0.02, 20.0),
        yaw_deg=keys.number("yaw_deg", 0.0),
        pitch_deg=keys.number("pitch_deg", 0.0, -89.0, 89.0),
        roll_deg=keys.number("roll_deg", 0.0, -89.0, 89.0),
    )
    keys.finish()
    problem = sensor_problem(scene, pose.at, pose.height)
    if problem is not None:
        raise keys.error("at", problem)
    return pose


def _drive(keys, scene):
    points = np.array(keys.points("points"), dtype=float).reshape(-1, 2)
    height = keys.number("height", 0.7, 0.02, 20.0)
    speed = keys.number("speed", 0.5, 0.01, 5.0)
    keys.finish()
    if len(points) < 2:
        raise keys.error("points", "needs at least two points")
    for i, point in enumerate(points):
        problem = sensor_problem(scene, point, height)
        if problem is not None:
            raise keys.error(f"points[{i}]", problem)
    return Drive(points, speed, height)


def sensor_problem(scene, at, height):
    """What is wrong with a sensor at (x, y) and height above the floor; None if nothing is."""
    if not geometry.contains(scene.outline, [at])[0]:
        return "the sensor stands outside the room"
    for polygon in [scene.outline] + scene.pillars:
        near = geometry.distance_to_edges(polygon, [at])[0] < WALL_CLEARANCE
        in_pillar = polygon is not scene.outline and geometry.contains(polygon, [at])[0]
        if near or in_pillar:
            return "the sensor stands in a wall"
    if scene.is_drop([at])[0]:
        return "the sensor stands over a hole"
    position = np.array([at[0], at[1], float(scene.floor_z([at])[0]) + height])
    if position[2] >= scene.ceiling or not math.isfinite(position[2]):
        return "the sensor stands above the ceiling"
    for item in scene.objects:
        if any(prism.contains(position) for prism in item.prisms):
            return f"the sensor stands inside {item.label}"
    return None
