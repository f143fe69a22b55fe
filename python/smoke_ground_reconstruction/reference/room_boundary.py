"""The full floor of a room from its floor plane, its walls and its drop-offs.

What the thesis names as the limits of its own method (Section 6.2) is what this one is built
against: a boundary per 0.4 deg column instead of one distance per 10 deg segment, a robust plane
instead of lowest wall points, the sensor's own beams cut with floor and boundary instead of evenly
spaced radii, a merge per cell instead of per segment, and what is not known stays unknown.
"""

from dataclasses import dataclass

import numpy as np

from ..params import RoomBoundaryParams
from .azimuth_bins import AzimuthBins
from .drop_offs import DropOffs
from .floor_completion import (
    COLUMN_DEG,
    DrawnFloor,
    FloorClaim,
    claim_floor,
    draw_floor,
    merge,
    outline_of,
)
from .floor_model import FloorModel, FloorSource, fit_floor
from .floor_surface import FloorSurface
from .label import Label
from .predicates import Direction
from .room import Room, upright_candidates
from .scan import Mounting, Scan, ScanView
from .sensor_model import SensorModel
from .visibility import Visibility, VisibilityEstimator
from .wall_profile import Profile

_WEDGE_COLUMNS = 15  # of a wedge that tells which frame is upright
_WEDGES = 12  # one in so many does
_WEDGE_RETURNS = 500  # in posts, at least, tell


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
    room : Room
    claim : FloorClaim
    drawn : DrawnFloor
        What the surface was made from, in the upright frame.
    """

    surface: FloorSurface
    labels: np.ndarray
    floor: FloorModel
    profile: Profile
    drops: DropOffs
    limit: np.ndarray
    visibility: Visibility
    room: Room
    claim: FloorClaim
    drawn: DrawnFloor


class RoomBoundary:
    """Keeps the last good floor plane and how bright walls are; use one per sensor.

    ``params``, a RoomBoundaryParams, may change from scan to scan.
    """

    def __init__(self, params=None):
        self.params = params or RoomBoundaryParams()
        self._bins = AzimuthBins(COLUMN_DEG)
        count = self._bins.count()
        middles = [Direction.from_degrees((i + 0.5) * 360.0 / count) for i in range(count)]
        self._directions = np.array(middles)
        self._floor = None
        self._visibility = VisibilityEstimator()

    def reconstruct(
        self, view: ScanView, sensor: SensorModel, mounting: Mounting
    ) -> RoomBoundaryResult:
        """The floor of one scan, from all of its points in the sensor frame.

        It has its own denoising: posts and lines are found among all returns, and smoke's soft
        returns near the sensor are told by their weakness beside the floor's.
        """
        level = Scan(view, mounting)
        valid = np.flatnonzero(level.valid)
        xyz = level.xyz[valid]
        floor, room = self._find_floor(xyz, view.intensity[valid].astype(np.float64), mounting)
        room.find_walls(self._directions)
        claim = claim_floor(room)
        drawn = draw_floor(room, claim, self._directions, self._bins, sensor, mounting)
        outline = outline_of(room, claim, self._directions, mounting)
        surface = merge(view, valid, room, claim, drawn, outline, sensor, mounting, floor)
        labels = np.full(len(view.xyz), Label.INVALID, np.uint8)
        labels[valid] = _labels(room, claim.measured)
        visibility = room.visibility(self._visibility)
        return RoomBoundaryResult(
            surface,
            labels,
            floor,
            room.profile,
            room.drops,
            claim.limit,
            visibility,
            room,
            claim,
            drawn,
        )

    def _find_floor(self, xyz, intensity, mounting):
        """A floor that gives no return (wet, black) leaves the feet of walls as the lowest there
        is. They are left out then; if no floor is found beside them, what was known before has to
        do."""

        def fit(points):
            points = points.astype(np.float64)
            return fit_floor(points, mounting.sensor_height, self._floor, self.params)

        floor = fit(xyz)
        room = self._look(xyz, intensity, floor)
        is_first = True
        while floor.source == FloorSource.MEASURED and room.stands_on_walls():
            floor = fit(xyz[~room.is_at_post()] if is_first else xyz[:0])
            room = self._look(xyz, intensity, floor)
            is_first = False
        if floor.source == FloorSource.MEASURED:
            self._floor = floor
        return floor, room

    def _look(self, xyz, intensity, floor):
        """The room in whichever frame stands its walls upright: the level one or the floor's. Some
        wedges of it tell, if enough of their returns stand in posts."""

        def rooms(which, rotations):
            points = xyz[which], intensity[which]
            return [Room(*points, floor, turn, self._bins, self.params) for turn in rotations]

        def standing(room):
            return room.posts.count.sum()

        frames = upright_candidates(floor.plane)
        everything = slice(None)
        if len(frames) == 1:
            return rooms(everything, frames)[0]
        column = self._bins.index(*xyz[:, :2].astype(np.float64).T)
        found = rooms(column // _WEDGE_COLUMNS % _WEDGES == 0, frames)
        if max(standing(room) for room in found) < _WEDGE_RETURNS:
            return max(rooms(everything, frames), key=standing)
        upright = max(found, key=standing)
        return rooms(everything, [upright.rotation])[0]


def _labels(room, measured):
    labels = np.full(len(measured), Label.KEPT, np.uint8)
    labels[room.is_soft] = Label.NOISE
    labels[room.is_wall()] = Label.WALL
    labels[measured] = Label.GROUND
    return labels
