"""From a scene to the facets that beams meet."""

from enum import IntEnum
from functools import lru_cache

import numpy as np

from .._core import simulation as _simulation
from . import geometry
from .scene import plane_z

_FAR = 20.0  # the ground outside reaches this far beyond the room [m]
_SAME_HEIGHT = 1e-9


class Truth(IntEnum):
    """What a simulated point comes from."""

    NONE = 0
    FLOOR = 1
    WALL = 2
    CEILING = 3
    FURNITURE = 4
    PERSON = 5
    ROBOT = 6
    SMOKE = 7
    GLASS = 8
    DROP = 9  # ground that is not the room's floor: pit bottom, stairs, outside


class WorldBuilder:
    """Adds facets by material to the meshes of one compiled World."""

    def __init__(self):
        self.world = _simulation.World()
        self._materials = {}

    def material(self, reflectivity, truth):
        """Index of a material; equal ones share it."""
        key = (float(reflectivity), int(truth))
        if key not in self._materials:
            self._materials[key] = self.world.add_material(*key)
        return self._materials[key]

    def truths(self):
        """Truth class of each material, by index."""
        return [truth for _, truth in sorted(self._materials, key=self._materials.get)]

    def add(self, mesh, loops, reflectivity, truth):
        """Add one facet of loops (N, 3)."""
        mesh.add_facet(loops, self.material(reflectivity, truth))

    def build(self):
        """Sort the meshes that stand still; the world is then ready for rays."""
        for mesh in (self.world.solid, self.world.glass, self.world.portal):
            mesh.build()


def build_world(scene, with_furniture=True):
    """The compiled World of a scene at rest: no people, no robot.

    Parameters
    ----------
    with_furniture : bool
        False keeps walls and floor alone, as the truth about the floor asks.
    """
    builder = WorldBuilder()
    _add_floor(builder, scene)
    _add_walls(builder, scene)
    if scene.openings:
        _add_outside(builder, scene)
    for item in scene.objects:
        if with_furniture or item.is_wall:
            truth = Truth.WALL if item.is_wall else Truth.FURNITURE
            for prism in item.prisms:
                for face in prism.faces():
                    builder.add(builder.world.solid, face, prism.reflectivity, truth)
    builder.build()
    return builder


def set_people(builder, scene, time):
    """Put the people where they are at a time [s], with the velocity they have then."""
    builder.world.clear_movers()
    for person in scene.people:
        position, velocity = person.motion(time)
        mesh = _simulation.FacetMesh()
        start = position - velocity * time  # where the mesh would have been at time 0
        floor_z = float(scene.floor_z([position])[0])
        for prism in person.prisms:
            for face in prism.placed(start, 0.0, floor_z).faces():
                builder.add(mesh, face, prism.reflectivity, Truth.PERSON)
        mesh.build()
        builder.world.add_mover(mesh, [velocity[0], velocity[1], 0.0])


def set_robot(builder, scene, height, forward_yaw_deg):
    """Hang the robot's body under the sensor: its frame has x forward, z up from the floor."""
    mesh = _simulation.FacetMesh()
    for prism in scene.robot:
        placed = prism.placed((0.0, 0.0), forward_yaw_deg, -height)
        for face in placed.faces():
            builder.add(mesh, face, prism.reflectivity, Truth.ROBOT)
    mesh.build()
    builder.world.body = mesh


@lru_cache(maxsize=64)
def _built(scene, with_furniture):
    return build_world(scene.value, with_furniture)


class _ByDigest:
    """Lets lru_cache tell scenes apart by their file's content."""

    def __init__(self, value):
        self.value = value

    def __hash__(self):
        return hash(self.value.digest)

    def __eq__(self, other):
        return self.value.digest == other.value.digest


def world_of(scene, with_furniture=True):
    """build_world(), kept for scenes already seen."""
    return _built(_ByDigest(scene), with_furniture)


def lowest_z(scene):
    """A height below every floor, for the walls to begin at [m]."""
    heights = [plane_z(scene.plane, scene.outline).min()]
    heights += [plane_z(patch.plane, patch.polygon).min() for patch in scene.patches]
    if scene.openings:
        heights.append(scene.outside.ground)
    return float(min(heights)) - 0.1


def lift(polygon, plane):
    """Vertices (N, 3) of a polygon (N, 2) laid onto a plane."""
    return np.column_stack([polygon, plane_z(plane, polygon)])


def _add_floor(builder, scene):
    solid = builder.world.solid
    loops = [scene.outline] + scene.pillars + [patch.polygon for patch in scene.patches]
    reflectivity = scene.reflectivity["floor"]
    base = [lift(loop, scene.plane) for loop in loops]
    builder.add(solid, base, reflectivity, Truth.FLOOR)
    for patch in scene.patches:
        truth = Truth.DROP if patch.is_drop else Truth.FLOOR
        builder.add(solid, [lift(patch.polygon, patch.plane)], reflectivity, truth)
    for riser in risers(scene):
        truth = Truth.DROP if riser.is_drop else Truth.WALL
        for face in riser.faces():
            builder.add(solid, [face], scene.reflectivity["wall"] * 0.5, truth)


class Riser:
    """The upright face between two levels of floor along the segment start-end (2,), (2,)."""

    def __init__(self, start, end, inner_z, outer_z, is_drop):
        self.start, self.end = start, end
        self.inner_z, self.outer_z = inner_z, outer_z  # heights at start and end
        self.is_drop = is_drop

    def faces(self):
        """Corners (3 or 4, 3) of its faces: one, or two where the levels cross on the way."""
        step = self.inner_z - self.outer_z
        if step[0] * step[1] >= 0.0:
            return [self._face(self.start, self.end, self.inner_z, self.outer_z)]
        share = step[0] / (step[0] - step[1])
        middle = self.start + share * (self.end - self.start)
        z = self.inner_z[0] + share * (self.inner_z[1] - self.inner_z[0])
        (first_in, last_in), (first_out, last_out) = self.inner_z, self.outer_z
        return [
            self._face(self.start, middle, (first_in, z), (first_out, z)),
            self._face(middle, self.end, (z, last_in), (z, last_out)),
        ]

    @staticmethod
    def _face(start, end, inner_z, outer_z):
        points = [
            (*start, inner_z[0]),
            (*end, inner_z[1]),
            (*end, outer_z[1]),
            (*start, outer_z[0]),
        ]
        moved = [np.abs(np.subtract(p, points[i - 1])).max() for i, p in enumerate(points)]
        return np.array([p for p, way in zip(points, moved) if way > _SAME_HEIGHT])


def risers(scene):
    """The risers along all edges of the scene's patches, each once."""
    found = []
    for i, patch in enumerate(scene.patches):
        for start, end in geometry.edges(patch.polygon):
            riser = _riser_at(scene, i, start, end)
            if riser is not None:
                found.append(riser)
    return found


def _riser_at(scene, index, start, end):
    patch = scene.patches[index]
    along = end - start
    outward = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    beyond = (0.5 * (start + end) + 1e-4 * outward)[None]
    if not geometry.contains(scene.outline, beyond)[0]:
        return None  # the wall stands there
    neighbour = next(
        (k for k, other in enumerate(scene.patches) if geometry.contains(other.polygon, beyond)[0]),
        None,
    )
    if neighbour is not None and neighbour < index:
        return None  # already made from the other side
    other_plane = scene.plane if neighbour is None else scene.patches[neighbour].plane
    ends = np.array([start, end])
    inner, outer = plane_z(patch.plane, ends), plane_z(other_plane, ends)
    if np.max(np.abs(inner - outer)) <= _SAME_HEIGHT:
        return None
    is_drop = patch.is_drop or (neighbour is not None and scene.patches[neighbour].is_drop)
    return Riser(start, end, inner, outer, is_drop)


def _upright(start, end, bottom, top):
    return np.array([(*start, bottom), (*end, bottom), (*end, top), (*start, top)])


def _add_walls(builder, scene):
    solid = builder.world.solid
    low, reflectivity = lowest_z(scene), scene.reflectivity["wall"]
    for i, (start, end) in enumerate(geometry.edges(scene.outline)):
        panes = [_opening_loop(o, start, end) for o in scene.openings if o.edge == i]
        wall = _upright(start, end, low, scene.ceiling)
        builder.add(solid, [wall] + panes, reflectivity, Truth.WALL)
    for polygon in scene.pillars:
        for start, end in geometry.edges(polygon):
            builder.add(solid, [_upright(start, end, low, scene.ceiling)], reflectivity, Truth.WALL)
    ceiling = [lift(scene.outline, (0.0, 0.0, scene.ceiling))]
    builder.add(solid, ceiling, scene.reflectivity["ceiling"], Truth.CEILING)


def _opening_loop(opening, start, end):
    unit = (end - start) / np.linalg.norm(end - start)
    return _upright(
        start + opening.start * unit, start + opening.end * unit, opening.bottom, opening.top
    )


def _add_outside(builder, scene):
    sides = geometry.edges(scene.outline)
    for opening in scene.openings:
        pane = [_opening_loop(opening, *sides[opening.edge])]
        builder.add(builder.world.portal, pane, scene.reflectivity["glass"], Truth.GLASS)
        if opening.has_glass:
            builder.add(builder.world.glass, pane, scene.reflectivity["glass"], Truth.GLASS)
    low, high = scene.outline.min(axis=0), scene.outline.max(axis=0)
    ground = (0.0, 0.0, scene.outside.ground)
    around = geometry.rectangle(*(high - low + 2 * _FAR), at=0.5 * (low + high))
    loops = [lift(around, ground), lift(scene.outline, ground)]
    builder.add(builder.world.solid, loops, scene.outside.reflectivity, Truth.DROP)
    facade = geometry.rectangle(*(high - low + 2 * scene.outside.facade), at=0.5 * (low + high))
    for start, end in geometry.edges(facade):
        face = _upright(start, end, scene.outside.ground, scene.ceiling + 3.0)
        builder.add(builder.world.solid, [face], scene.reflectivity["wall"], Truth.WALL)
