"""The full floor of a room from its floor plane, its walls and its drop-offs.

What the thesis names as the limits of its own method (Section 6.2) is what this one is built
against: a boundary per 0.4 deg column instead of one distance per 10 deg segment, a robust plane
instead of lowest wall points, the sensor's own beams cut with floor and boundary instead of evenly
spaced radii, a merge per cell instead of per segment, and what is not known stays unknown.
"""

import math
from dataclasses import dataclass

import numpy as np

from .azimuth_bins import AzimuthBins
from .drop_offs import DropOffs, find_drop_offs
from .floor_model import FloorModel, FloorSource, fit_floor
from .floor_relief import CELL as RELIEF_CELL
from .floor_relief import FLAT, find_relief
from .floor_surface import BoundaryKind, FloorSurface, Provenance
from .label import Label
from .scan import Mounting, Scan, ScanView
from .sensor_model import SensorModel
from .visibility import Visibility, estimate_visibility
from .wall_profile import (
    Profile,
    Returns,
    View,
    ceiling_height,
    column_profile,
    find_lines,
    find_posts,
    line_support,
)

COLUMN_DEG = 0.4
_ON_FLOOR = 0.03  # a return so near to the plane may be floor [m]
_LOWEST_WALL = 0.1  # and one so far above it may be wall [m]
_NEAREST_WALL = 0.2  # planar range [m]
_BELOW_CEILING = 0.05
_WALL_FOOT = 0.05  # returns so near to a wall's line may be its foot [m]
_SOFT_RANGE = 1.5  # smoke's own returns come from nearer [m]
_SOFT_FACTOR = 2.0  # and are at most this many times as strong as the floor's at that range
_PLUMB = 0.3  # floors tilted by less against the vertical are taken as level [deg]
_AT_WALL = 0.008  # the claimed floor ends this far before the wall [m]
_BEYOND = 0.15  # floor measured this far behind the boundary lies behind an opening [m]
_CELL = 0.1  # measured floor wins in cells of this size [m]
_OPENING_CELL = 0.2
_OPENING_POINTS = 3
_OPENING_HEIGHT = 0.012  # floor behind an opening must go on as level as this [m]
_FILL = 0.06  # claimed floor between the rings is drawn this densely [m]
_CONFIDENCE_MEASURED = 0.99
_CONFIDENCE = {
    BoundaryKind.WALL_SEEN: 0.99,
    BoundaryKind.WALL_INFERRED: 0.97,
    BoundaryKind.LIMIT_OF_KNOWLEDGE: 0.96,
}


@dataclass
class RoomBoundaryResult:
    """The floor and what it was made from.

    Attributes
    ----------
    surface : FloorSurface
        Measured points first, in input order; then the beams' own points; then what fills the
        cells between the rings.
    labels : (N,) uint8
        Per input point: ground, wall (the boundary's), noise (soft returns of near smoke), other.
    floor : FloorModel
        In the level frame.
    profile : Profile
        Of the walls, in the upright frame.
    drops : DropOffs
    limit : (columns,) float64
        How far floor is claimed in each column [m].
    visibility : Visibility
    """

    surface: FloorSurface
    labels: np.ndarray
    floor: FloorModel
    profile: Profile
    drops: DropOffs
    limit: np.ndarray
    visibility: Visibility


class RoomBoundary:
    """Keeps the last good floor plane; use one per sensor."""

    def __init__(self):
        self._bins = AzimuthBins(COLUMN_DEG)
        middles = np.radians((np.arange(self._bins.count()) + 0.5) * 360.0 / self._bins.count())
        self._directions = np.column_stack([np.cos(middles), np.sin(middles)])
        self._floor = None

    def reconstruct(
        self, view: ScanView, sensor: SensorModel, mounting: Mounting
    ) -> RoomBoundaryResult:
        """The floor of one scan, from all of its points in the sensor frame.

        It has its own denoising: posts and lines are found among all returns, and smoke's soft
        returns near the sensor are told by their weakness beside the floor's.
        """
        level = Scan(view, mounting)
        valid = np.flatnonzero(level.valid)
        xyz = level.xyz[valid].astype(np.float64)
        floor = fit_floor(xyz, mounting.sensor_height, self._floor)
        if floor.source == FloorSource.MEASURED:
            self._floor = floor
        room = self._look(xyz, view.intensity[valid].astype(np.float64), floor)
        limit = self._limit(room)
        measured = self._measured(room, limit)
        limit = self._through_openings(room, limit, measured)
        surface = self._surface(view, valid, room, limit, measured, sensor, mounting, floor)
        labels = np.full(len(view.xyz), Label.INVALID, np.uint8)
        labels[valid] = self._labels(room, measured)
        return RoomBoundaryResult(
            surface, labels, floor, room.profile, room.drops, limit, room.visibility()
        )

    def _look(self, xyz, intensity, floor):
        """The room in whichever frame stands its walls upright: the level one or the floor's."""
        rooms = [
            _Room(xyz, intensity, floor, rotation, self._bins)
            for rotation in _upright_candidates(floor.plane)
        ]
        room = max(rooms, key=lambda candidate: candidate.posts.count.sum())
        room.find_walls(self._directions)
        return room

    def _limit(self, room):
        """How far each column's floor is claimed, drop-offs apart: the wall, else what is seen."""
        distance = room.profile.distance
        ends_at_wall = distance > 0.0
        return np.where(ends_at_wall, np.maximum(0.0, distance - _AT_WALL), room.seen_floor)

    def _measured(self, room, limit):
        """Returns that are floor: before the boundary, or level with it behind an opening."""
        before = room.planar <= limit[room.column]
        behind = room.planar > limit[room.column] + _BEYOND
        level = room.is_low & ~room.drops.hides(room.column, room.planar)
        measured = level & before
        behind &= level
        if np.any(behind):
            measured |= behind & room.goes_on_level()
        return measured

    def _through_openings(self, room, limit, measured):
        """Limits drawn on to floor measured behind them: it goes on in between."""
        behind = measured & (room.planar > limit[room.column] + _BEYOND)
        return np.maximum(limit, room.farthest(behind, beside=1))

    def _labels(self, room, measured):
        labels = np.full(len(measured), Label.KEPT, np.uint8)
        labels[room.is_soft] = Label.NOISE
        labels[room.is_wall()] = Label.WALL
        labels[measured] = Label.GROUND
        return labels

    def _surface(self, view, valid, room, limit, measured, sensor, mounting, floor):
        kept = valid[measured]
        drawn = np.vstack([self._beams(room, sensor, mounting), self._fill(room, limit)])
        column = self._bins.index(drawn[:, 0], drawn[:, 1])
        planar = np.sqrt(drawn[:, 0] ** 2 + drawn[:, 1] ** 2)
        claimed = (planar <= limit[column]) & ~room.drops.hides(column, planar)
        claimed &= ~np.isin(_cells(drawn, _CELL), _cells(room.xyz[measured], _CELL))
        drawn, column = drawn[claimed], column[claimed]
        drawn[:, 2] += room.relief.at(drawn[:, :2])
        to_sensor = room.rotation.T.dot
        xyz = mounting.to_sensor(np.ascontiguousarray(to_sensor(drawn.T).T, np.float32))
        sure = np.array([_CONFIDENCE[BoundaryKind(k)] for k in range(3)])
        kinds = room.profile.kind[column]
        boundary, kind = self._outline(room, limit, mounting)
        count = len(xyz)
        return FloorSurface(
            np.concatenate([view.xyz[kept], xyz]),
            np.concatenate([view.intensity[kept], np.zeros(count, np.float32)]),
            np.concatenate([view.ring[kept], _nearest_rings(xyz, sensor)]),
            np.repeat(
                np.array([Provenance.MEASURED, Provenance.RECONSTRUCTED], np.uint8),
                [len(kept), count],
            ),
            np.concatenate(
                [np.full(len(kept), _CONFIDENCE_MEASURED, np.float32), sure[kinds].astype("f4")]
            ),
            boundary,
            kind,
            _plane_in_sensor_frame(floor.plane, mounting),
        )

    def _beams(self, room, sensor, mounting):
        """Where the beams of all rings, at all azimuths, meet the floor; upright frame (M, 3)."""
        tangent = sensor.tangent(sensor.rings_by_elevation())
        east, north = (self._directions[:, axis] for axis in (0, 1))
        ones = np.ones((len(tangent), len(east)))
        rays = np.stack([east * ones, north * ones, tangent[:, None] * ones], axis=-1)
        rays = rays.reshape(-1, 3) @ (room.rotation @ mounting.rotation).T
        a, b, c = room.plane
        slope = rays[:, 2] - (a * rays[:, 0] + b * rays[:, 1])
        falls = slope < -1e-3
        return rays[falls] * (c / slope[falls])[:, None]

    def _fill(self, room, limit):
        """Floor between the rings and up to the wall; upright frame (M, 3).

        Columns are left out near the sensor, where they lie closer than need be.
        """
        parts = []
        for c in np.flatnonzero(limit > 0.0):
            stride_4, stride_2 = 4 * _FILL / math.radians(COLUMN_DEG * 16), 2 * _FILL / 0.028
            begin = 0.0 if c % 4 == 0 else (stride_4 if c % 2 == 0 else stride_2)
            radii = np.arange(begin, limit[c], _FILL)
            radii = np.concatenate([radii, [limit[c]]])
            parts.append(radii[:, None] * self._directions[c])
        xy = np.concatenate(parts) if parts else np.zeros((0, 2))
        a, b, c = room.plane
        return np.column_stack([xy, a * xy[:, 0] + b * xy[:, 1] + c])

    def _outline(self, room, limit, mounting):
        """A vertex per column where floor is claimed, and the foot once where none is."""
        radius = np.minimum(limit, room.drops.begin)
        ends_elsewhere = (radius < limit) | (limit > room.profile.distance)
        kind = np.where(ends_elsewhere, BoundaryKind.LIMIT_OF_KNOWLEDGE, room.profile.kind)
        claims = radius > 0.0
        if not claims.any():
            return np.zeros((0, 3), np.float32), np.zeros(0, np.uint8)
        keep = claims | np.roll(claims, 1)
        kind = np.where(claims, kind, BoundaryKind.LIMIT_OF_KNOWLEDGE)
        xy = (radius[:, None] * self._directions)[keep]
        a, b, c = room.plane
        upright = np.column_stack([xy, a * xy[:, 0] + b * xy[:, 1] + c])
        boundary = np.ascontiguousarray((room.rotation.T @ upright.T).T, np.float32)
        return mounting.to_sensor(boundary), kind[keep].astype(np.uint8)


class _Room:
    """The returns of one scan in an upright frame, and what stands in it."""

    def __init__(self, xyz, intensity, floor, rotation, bins):
        self.rotation = rotation
        self.xyz = xyz @ rotation.T
        self.intensity = intensity
        self.plane = _rotated_plane(floor.plane, rotation)
        self.columns = bins.count()
        a, b, c = self.plane
        self.height = self.xyz[:, 2] - (a * self.xyz[:, 0] + b * self.xyz[:, 1] + c)
        self.planar = np.sqrt(self.xyz[:, 0] ** 2 + self.xyz[:, 1] ** 2)
        self.column = bins.index(self.xyz[:, 0], self.xyz[:, 1])
        self.ceiling = ceiling_height(self.height, self.planar)
        self.is_low = np.abs(self.height) < _ON_FLOOR
        self.is_soft = self._soft()
        self.relief = FLAT
        self._find_relief()
        self._can_be_wall = (self.height > _LOWEST_WALL) & ~self.is_low
        self._can_be_wall &= self.height < self.ceiling - _BELOW_CEILING
        self._can_be_wall &= (self.planar > _NEAREST_WALL) & ~self.is_soft
        self.returns = Returns(
            self.column[self._can_be_wall],
            self.planar[self._can_be_wall],
            self.height[self._can_be_wall],
            self.xyz[self._can_be_wall, :2],
        )
        self.posts = find_posts(*vars(self.returns).values())

    def _find_relief(self):
        hard = ~self.is_soft
        self.relief = find_relief(self.xyz[hard, :2], self.height[hard], self.planar[hard])
        cells = np.column_stack([self.relief.cells, self.relief.height])
        raised = cells[cells[:, 2] != 0.0]
        if len(raised) > 0:
            on = np.isin(_cells(self.xyz, RELIEF_CELL), _numbered(raised[:, :2].astype(np.int64)))
            on = np.flatnonzero(on & hard)
            self.is_low[on] = np.abs(self.height[on] - self.relief.at(self.xyz[on, :2])) < _ON_FLOOR

    def _soft(self):
        """Returns of smoke near the sensor: weaker, range apart, than walls are beside the floor.

        Intensity enters as a ratio to the floor's, so the sensor's scale does not matter.
        """
        square = (self.xyz**2).sum(axis=1)
        strength = self.intensity * square
        near_floor = self.is_low & (self.planar < 2.5)
        if not near_floor.any():
            return np.zeros(len(square), bool)
        # The mean: where smoke leaves whole numbers of 0 and 1, a median would be 0.
        gate = _SOFT_FACTOR * np.mean(strength[near_floor])
        return (square < _SOFT_RANGE**2) & (strength < gate) & (self.height > _LOWEST_WALL)

    def find_walls(self, directions):
        """Lines, the profile of the boundary and the drop-offs."""
        off_axis = self.planar > _NEAREST_WALL
        slopes = self.xyz[off_axis, 2] / self.planar[off_axis]
        steepest = np.percentile(slopes, 99.9) if len(slopes) > 0 else 0.0
        self.view = View(self.ceiling, -self.plane[2], steepest)
        self.lines = find_lines(self.posts)
        support = line_support(self.returns, self.lines, directions, self.view)
        self.seen_floor = self.farthest(self.is_low & ~self._at_a_wall())
        ceiling = np.zeros(self.columns)
        if np.isfinite(self.ceiling):
            ceiling = self.farthest(np.abs(self.height - self.ceiling) < _BELOW_CEILING)
        self.profile = column_profile(
            self.posts, support, self.view, np.maximum(self.seen_floor, ceiling)
        )
        self.drops = self._drop_offs()
        if not np.isfinite(self.drops.begin).any():
            # A ceiling seen overhead has a floor beneath, unless floors are known to end here.
            self.seen_floor = np.maximum(self.seen_floor, ceiling - _BEYOND)

    def _at_a_wall(self):
        near = np.zeros(len(self.xyz), bool)
        if len(self.lines.rho) > 0:
            low = np.flatnonzero(self.is_low)
            off = np.abs(self.lines.distances(self.xyz[low, :2])).min(axis=0)
            near[low[off < _WALL_FOOT]] = True
        return near

    def farthest(self, which, beside=2, rank=3):
        """How far some returns are seen in each column or some beside it [m], else 0.

        The third farthest of a column tells. Not all rings fire in each column.
        """
        column, planar = self.column[which], self.planar[which]
        order = np.lexsort((-planar, column))
        begin = np.searchsorted(column[order], np.arange(self.columns))
        enough = np.bincount(column, minlength=self.columns) >= rank
        found = np.zeros(self.columns)
        found[enough] = planar[order][begin[enough] + rank - 1]
        return np.max([np.roll(found, k) for k in range(-beside, beside + 1)], axis=0)

    def _drop_offs(self):
        distance = self.profile.distance[self.column]
        inside = (self.planar < distance + 2 * _BEYOND) | (distance == 0.0)
        floor = self.is_low & ~self._at_a_wall()
        floor &= (self.planar < distance - _WALL_FOOT) | (distance == 0.0)
        return find_drop_offs(
            self.column[inside],
            self.planar[inside],
            self.height[inside],
            floor[inside],
            -self.plane[2],
            self.columns,
        )

    def goes_on_level(self):
        """Is a return's cell as level as the floor? The median of its low returns decides."""
        low = np.flatnonzero(np.abs(self.height) < 5 * _ON_FLOOR)
        cell = _cells(self.xyz, _OPENING_CELL)
        order = low[np.lexsort((self.height[low], cell[low]))]
        cells, begin, count = np.unique(cell[order], return_index=True, return_counts=True)
        median = self.height[order[begin + count // 2]]
        good = (np.abs(median) < _OPENING_HEIGHT) & (count >= _OPENING_POINTS)
        return np.isin(cell, cells[good])

    def is_wall(self):
        """Returns on the line of their column's boundary."""
        line = self.profile.line[self.column]
        known = self._can_be_wall & (line >= 0)
        nx, ny, rho = (values[line[known]] for values in vars(self.lines).values())
        off = np.abs(nx * self.xyz[known, 0] + ny * self.xyz[known, 1] - rho)
        known[known] = off < _WALL_FOOT
        return known

    def visibility(self):
        """The smoke's extinction from the boundary's walls."""
        wall = self.is_wall()
        line, xyz = self.profile.line[self.column[wall]], self.xyz[wall]
        ranges = np.sqrt((xyz**2).sum(axis=1))
        cosine = np.abs(self.lines.nx[line] * xyz[:, 0] + self.lines.ny[line] * xyz[:, 1]) / ranges
        return estimate_visibility(line, ranges, self.intensity[wall], cosine)


def _upright_candidates(plane):
    """Rotations (3, 3) that may stand the walls upright: none, and the one that levels the floor.

    A tilted floor in a plumb building has plumb walls; a tilted sensor sees both tilted alike.
    """
    a, b, _ = plane
    normal = np.array([-a, -b, 1.0]) / math.sqrt(a * a + b * b + 1.0)
    if normal[2] > math.cos(math.radians(_PLUMB)):
        return [np.eye(3)]
    axis = np.array([[0, 0, -normal[0]], [0, 0, -normal[1]], [normal[0], normal[1], 0]])
    return [np.eye(3), np.eye(3) + axis + axis @ axis / (1.0 + normal[2])]


def _rotated_plane(plane, rotation):
    """z = a x + b y + c in a frame turned by a rotation."""
    normal = rotation @ np.array([-plane[0], -plane[1], 1.0])
    return np.array([-normal[0] / normal[2], -normal[1] / normal[2], plane[2] / normal[2]])


def _plane_in_sensor_frame(plane, mounting):
    return _rotated_plane(plane, mounting.rotation.T)


def _nearest_rings(xyz, sensor):
    """The rings (uint16) next in elevation to points in the sensor frame."""
    rings = sensor.rings_by_elevation()
    if len(rings) == 0:
        return np.zeros(len(xyz), np.uint16)
    tangent = sensor.tangent(rings)
    planar = np.sqrt(xyz[:, 0].astype(np.float64) ** 2 + xyz[:, 1].astype(np.float64) ** 2)
    of_points = xyz[:, 2] / np.maximum(planar, 1e-6)
    return rings[np.searchsorted(0.5 * (tangent[1:] + tangent[:-1]), of_points)]


def _cells(xyz, size):
    """One number per cell (N,) of a grid aligned to the sensor."""
    return _numbered(np.floor(xyz[:, :2] / size).astype(np.int64))


def _numbered(cell):
    return cell[:, 0] * 1000003 + cell[:, 1]
