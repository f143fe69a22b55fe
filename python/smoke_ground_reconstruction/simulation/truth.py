"""The scene's true floor as cells, by the project's yardstick."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from . import cache, geometry
from .scan import expect, heading, pose_matrix
from .world import Truth, risers, world_of

COLUMN_DEG = 0.4
KNOWABLE_PROBABILITY = 0.05
RIM = 0.3
MARGIN = 0.3
_SUBSTEP = 0.02  # floor is sampled this densely [m]
_EDGE_STEP = 0.01  # and so densely along its edges,
_EDGE_INSET = 0.001  # this far to either side [m]
_SIGHT_TOLERANCE = 0.005  # [m]
_MAPS = (
    "visible_floor",
    "out_of_sight",
    "under_sensor",
    "hole",
    "hole_rim",
    "edge_crossing",
    "wall",
)


@dataclass(frozen=True)
class FloorTruth:
    """Truth about each cell of a grid in the level sensor-centred frame.

    That frame has its origin at the sensor, z along the world's vertical, and x where the sensor's
    x axis points in plan. Cell (row, column) spans x from origin[0] + column * cell and y from
    origin[1] + row * cell; cell borders are whole multiples of `cell`. All maps are (ny, nx).

    Attributes
    ----------
    origin : (2,) float64
        Corner of cell (0, 0) [m].
    cell : float
        [m]
    visible_floor : bool
        Some floor in the cell lies in line of sight, furniture and people removed, walls kept.
    out_of_sight : bool
        True floor, none of it in line of sight.
    under_sensor : bool
        The disc that the lowest beam leaves out, plus a cell.
    hole : bool
        Some of the cell lies over a drop.
    hole_rim : bool
        Some of the cell's floor lies within RIM of a drop.
    edge_crossing : bool
        The edge of a step runs through the cell: no height score there.
    wall : bool
        A wall or pillar runs through the cell.
    knowable : bool
        Visible floor that can be known: with a probability of at least KNOWABLE_PROBABILITY some
        beam of its azimuth column (COLUMN_DEG) detects a wall, or some beam detects the cell.
    floor_z : float64
        Mean height of the cell's floor against the sensor's origin [m]; NaN without floor.
    """

    origin: np.ndarray
    cell: float
    visible_floor: np.ndarray
    out_of_sight: np.ndarray
    under_sensor: np.ndarray
    hole: np.ndarray
    hole_rim: np.ndarray
    edge_crossing: np.ndarray
    wall: np.ndarray
    knowable: np.ndarray
    floor_z: np.ndarray

    @property
    def shape(self):
        """(ny, nx)"""
        return self.visible_floor.shape

    def cells_of(self, points):
        """Flat cell index (M,) of level points (M, 2 or more); -1 beyond the grid."""
        return _Grid(self.origin, self.cell, self.shape).cells_of(points)


def floor_truth(scene, sensor, pose=0, cell=0.2, smoke=None, seed=0):
    """The true floor around a pose.

    Parameters
    ----------
    scene : Scene
    sensor : Sensor
    pose : str, int, Pose
    cell : float
        [m]
    smoke : Smoke, optional
        What `knowable` is asked of, with the pattern of `seed`; None: clear air.

    Returns
    -------
    FloorTruth
    """
    pose = scene.pose(pose)
    if not cell > 0:
        raise ValueError(f"cell must be above 0, not {cell!r}")
    key = {"scene": scene.digest, "sensor": sensor.digest, "pose": pose, "cell": cell}
    found = cache.arrays("floor", key, lambda: _geometry(scene, sensor, pose, cell))
    knowable_key = {**key, "smoke": smoke, "seed": seed}
    compute = lambda: {"knowable": _knowable(scene, sensor, pose, smoke, seed, found)}  # noqa: E731
    knowable = cache.arrays("knowable", knowable_key, compute)["knowable"]
    found = {**found, "cell": float(found["cell"])}
    return FloorTruth(knowable=knowable, **found)


def to_level(scene, pose, points):
    """World to level sensor-centred frame, in plan: (M, 2) [m]."""
    return _Frame(pose_matrix(scene, pose)).to_level(points)


class _Grid:
    """Cells of a FloorTruth before it is one."""

    def __init__(self, origin, cell, shape):
        self.origin, self.cell, self.shape = np.asarray(origin), float(cell), tuple(shape)

    @classmethod
    def around(cls, points, cell):
        low = np.floor((points.min(axis=0) - MARGIN) / cell)
        high = np.ceil((points.max(axis=0) + MARGIN) / cell)
        columns, rows = (high - low).astype(int)
        return cls(low * cell, cell, (rows, columns))

    def cells_of(self, points):
        column, row = np.floor((np.asarray(points)[:, :2] - self.origin) / self.cell).astype(int).T
        inside = (column >= 0) & (column < self.shape[1]) & (row >= 0) & (row < self.shape[0])
        return np.where(inside, row * self.shape[1] + column, -1)

    def mark(self, points):
        """Map of the cells that hold at least one of the points (M, 2)."""
        marked = np.zeros(self.shape, dtype=bool)
        cells = self.cells_of(points)
        marked.ravel()[cells[cells >= 0]] = True
        return marked

    def samples(self):
        """Points (M, 2) on a regular raster in all cells."""
        per_cell = max(1, int(round(self.cell / _SUBSTEP)))
        step = self.cell / per_cell
        y, x = (step * (np.arange(count * per_cell) + 0.5) for count in self.shape)
        return np.column_stack([axis.ravel() for axis in np.meshgrid(x, y)]) + self.origin

    def mean(self, points, values):
        """Mean value per cell, NaN where no point lies."""
        cells = self.cells_of(points)
        count = np.bincount(cells, minlength=self.shape[0] * self.shape[1])
        total = np.bincount(cells, weights=values, minlength=len(count))
        with np.errstate(invalid="ignore"):
            return (total / np.where(count > 0, count, np.nan)).reshape(self.shape)


class _Frame:
    """World to level sensor-centred frame and back, in plan."""

    def __init__(self, matrix):
        self.position = matrix[:3, 3]
        self.heading_deg = np.degrees(heading(matrix))

    def to_level(self, points):
        return geometry.place(points - self.position[:2], (0.0, 0.0), -self.heading_deg)

    def to_world(self, points):
        return geometry.place(points, self.position[:2], self.heading_deg)


def _geometry(scene, sensor, pose, cell):
    frame = _Frame(pose_matrix(scene, pose))
    grid = _Grid.around(frame.to_level(scene.outline), cell)
    beside = _beside_edges([scene.outline] + scene.pillars + [p.polygon for p in scene.patches])
    samples = np.vstack([frame.to_world(grid.samples()), beside])
    is_floor = scene.is_floor(samples)
    is_hole = scene.is_drop(samples) & geometry.contains(scene.outline, samples)
    floor = samples[is_floor]
    sees = in_sight(scene, frame.position, floor)
    visible, any_floor = grid.mark(frame.to_level(floor[sees])), grid.mark(frame.to_level(floor))
    rim = floor[_distance_to_drops(scene, floor) < RIM]
    steps = [(r.start, r.end) for r in risers(scene) if not r.is_drop]
    centre_x, centre_y = _centres(grid)
    return {
        "origin": grid.origin,
        "cell": np.float64(cell),
        "visible_floor": visible,
        "out_of_sight": any_floor & ~visible,
        "under_sensor": np.hypot(centre_x, centre_y) <= _blind_radius(sensor, pose) + cell,
        "hole": grid.mark(frame.to_level(samples[is_hole])),
        "hole_rim": grid.mark(frame.to_level(rim)),
        "edge_crossing": grid.mark(frame.to_level(_along(steps))),
        "wall": grid.mark(frame.to_level(_wall_samples(scene))),
        "floor_z": _floor_z(scene, frame, grid, floor, sees, visible),
    }


def _floor_z(scene, frame, grid, floor, sees, visible):
    """Mean over what is seen of a cell; over all of its floor where nothing is."""
    below = scene.floor_z(floor) - frame.position[2]
    level = frame.to_level(floor)
    seen = grid.mean(level[sees], below[sees])
    return np.where(visible, seen, grid.mean(level, below))


def in_sight(scene, position, points):
    """Which floor points (M, 2) are seen from a position (3,) in the world; furniture removed."""
    targets = np.column_stack([points, scene.floor_z(points)])
    towards = targets - position
    distance = np.linalg.norm(towards, axis=1)
    builder = world_of(scene, with_furniture=False)
    ranges = builder.world.cast_from(position, towards / distance[:, None])
    return ranges > distance - _SIGHT_TOLERANCE


def _blind_radius(sensor, pose):
    depression = -float(sensor.elevation_deg.min())
    return pose.height / np.tan(np.radians(depression)) if depression > 0 else np.inf


def _centres(grid):
    x = grid.origin[0] + grid.cell * (np.arange(grid.shape[1]) + 0.5)
    y = grid.origin[1] + grid.cell * (np.arange(grid.shape[0]) + 0.5)
    return np.meshgrid(x, y)


def _along(segments):
    """Points every _EDGE_STEP along segments, _EDGE_INSET to either side (M, 2)."""
    found = [np.empty((0, 2))]
    for start, end in segments:
        length = float(np.linalg.norm(end - start))
        inset = min(0.5, _EDGE_INSET / length)  # a corner itself belongs to no side
        share = np.linspace(inset, 1.0 - inset, max(2, int(length / _EDGE_STEP)))[:, None]
        normal = np.array([start[1] - end[1], end[0] - start[0]]) / length
        line = start + share * (end - start)
        found += [line + _EDGE_INSET * normal, line - _EDGE_INSET * normal]
    return np.vstack(found)


def _beside_edges(polygons):
    return _along([edge for polygon in polygons for edge in geometry.edges(polygon)])


def _wall_samples(scene):
    """Points along all walls but where a window or gate reaches down to the floor."""
    samples = _beside_edges([scene.outline] + scene.pillars)
    sides = geometry.edges(scene.outline)
    for opening in scene.openings:
        start, end = sides[opening.edge]
        unit = (end - start) / np.linalg.norm(end - start)
        ends = start + opening.start * unit, start + opening.end * unit
        is_open = geometry.distance_to_segment(*ends, samples) < 2 * _EDGE_INSET
        samples = samples[~is_open] if opening.bottom <= 0.1 else samples
    return samples


def _distance_to_drops(scene, points):
    nearest = np.full(len(points), np.inf)
    for patch in scene.patches:
        if patch.is_drop:
            nearest = np.minimum(nearest, geometry.distance_to_edges(patch.polygon, points))
    return nearest


@lru_cache(maxsize=1)
def _expected(scene, sensor, pose, smoke, seed):
    """expect() of the last scan asked for: one scan is asked for in cells of several sizes."""
    return expect(scene, sensor, pose, smoke, seed)


def _knowable(scene, sensor, pose, smoke, seed, found):
    grid = _Grid(found["origin"], float(found["cell"]), found["visible_floor"].shape)
    frame = _Frame(pose_matrix(scene, pose))
    beams = _expected(scene, sensor, pose, smoke, seed)
    met = np.isfinite(beams["range"])
    level = np.zeros((len(met), 2))
    level[met] = frame.to_level(beams["position"][met, :2])
    floor, wall = beams["truth"] == Truth.FLOOR, beams["truth"] == Truth.WALL
    cell_known = _detects(
        grid.cells_of(level[floor]), beams["probability"][floor], grid.shape[0] * grid.shape[1]
    ).reshape(grid.shape)
    columns = int(round(360.0 / COLUMN_DEG))
    column_known = _detects(_column(level[wall]), beams["probability"][wall], columns)
    centre_x, centre_y = _centres(grid)
    of_cell = _column(np.column_stack([centre_x.ravel(), centre_y.ravel()]))
    return found["visible_floor"] & (cell_known | column_known[of_cell].reshape(grid.shape))


def _column(points):
    azimuth = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360.0
    return np.minimum(azimuth / COLUMN_DEG, 360.0 / COLUMN_DEG - 1).astype(int)


def _detects(group, probability, count):
    """Per group: is the chance that one of its beams detects at least KNOWABLE_PROBABILITY?"""
    return detection_by_group(group, probability, count) >= KNOWABLE_PROBABILITY


def detection_by_group(group, probability, count):
    """Chance (count,) that at least one beam of a group detects; group -1 is left out."""
    inside = group >= 0
    missed = np.log1p(-np.minimum(probability[inside], 1.0 - 1e-15))
    return -np.expm1(np.bincount(group[inside], weights=missed, minlength=count))
