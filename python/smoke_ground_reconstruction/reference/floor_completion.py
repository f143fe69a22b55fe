"""The floor of a room, completed: how far it is claimed, its points and its outline.

Thesis: Algorithm 3 draws evenly spaced radii; here the sensor's own beams are cut with the floor,
and what lies between them is filled.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from .cells import cell_keys
from .confidence import drawn_confidence, measured_confidence
from .floor_surface import BoundaryKind, FloorSurface, Provenance
from .room import BEYOND, rotated_plane
from .scan import rotated

COLUMN_DEG = 0.4
_AT_WALL = 0.008  # the claimed floor ends this far before the wall [m]
_FILL = 0.6  # claimed floor between the rings is drawn this densely, in cells
_COLUMN = 0.00698  # width of a column at 1 m [m]
_FLATTEST = -1e-3  # beams that fall by less against the floor never meet it
_NO_RING = -1


@dataclass(frozen=True)
class FloorClaim:
    """What of the floor is claimed.

    Attributes
    ----------
    limit : (columns,) float64
        How far in each column, drop-offs apart [m].
    measured : (N,) bool
        Per return of the room: is it floor?
    """

    limit: np.ndarray
    measured: np.ndarray


@dataclass(frozen=True)
class DrawnFloor:
    """Points of the floor that were not measured, in the room's upright frame.

    Attributes
    ----------
    xyz : (M, 3) float64
        [m], on plane and relief.
    column : (M,) int64
    planar : (M,) float64
        To single precision [m].
    ring : (M,) int64
        Of the beam that a point lies on; -1 of fill.
    """

    xyz: np.ndarray
    column: np.ndarray
    planar: np.ndarray
    ring: np.ndarray


def claim_floor(room):
    """How far the floor of a room is claimed, and which returns are floor."""
    distance = room.profile.distance
    # What stands stands on a floor.
    open_end = np.maximum(np.maximum(room.seen_floor, room.drops.floor_to), room.standing_low)
    limit = np.where(distance > 0.0, np.maximum(0.0, distance - _AT_WALL), open_end)
    limit = np.minimum(limit, room.certain_floor)
    measured = _measured(room, limit)
    # Drawn on to floor measured behind an opening: it goes on in between.
    behind = measured & (room.planar > limit[room.column] + BEYOND)
    limit = np.maximum(limit, room.farthest(behind, beside=1))
    return FloorClaim(np.minimum(limit, room.params.max_range), measured)


def _measured(room, limit):
    """Returns that are floor: before the boundary; else, as their cell is, behind an opening or
    where nothing is known to bound the floor."""
    before = (room.planar <= limit[room.column]) & (room.past_wall() <= -_AT_WALL)
    level = room.is_low & ~room.drops.hides(room.column, room.planar)
    is_open = room.profile.distance[room.column] == 0.0
    behind = ~is_open & (room.planar > limit[room.column] + BEYOND)
    measured = level & before
    # The foot of a house over the way is no floor of this one.
    beyond = behind & ~room.at_wall
    measured |= level & beyond & room.goes_on_level()
    # Behind single posts, mostly of furniture, floor need not be as level as through an opening.
    is_vague = is_open | (beyond & (room.profile.line[room.column] < 0))
    measured |= level & is_vague & room.is_floor_cell()
    return measured


def draw_floor(room, claim, directions, bins, sensor, mounting):
    """Claimed floor where none was measured: the beams' own points, then the fill.

    Parameters
    ----------
    room : Room
    claim : FloorClaim
    directions : (columns, 2) float64
        Of the columns' middles.
    bins : AzimuthBins
        The columns.
    sensor : SensorModel
    mounting : Mounting
    """
    beams = _beams(room, claim, directions, bins, sensor, mounting)
    fill = _fill(room, claim, directions)
    drawn = DrawnFloor(*(np.concatenate(parts) for parts in zip(beams, fill)))
    claimed = ~room.drops.hides(drawn.column, drawn.planar)
    cell = room.params.cell_size
    claimed &= ~np.isin(cell_keys(drawn.xyz, cell), cell_keys(room.xyz[claim.measured], cell))
    drawn = DrawnFloor(*(values[claimed] for values in vars(drawn).values()))
    drawn = replace(drawn, planar=drawn.planar.astype(np.float32).astype(np.float64))
    raised = drawn.xyz[:, 2] + room.relief.at(drawn.xyz[:, :2])
    drawn.xyz[:, 2] = raised.astype(np.float32)
    return drawn


def _beams(room, claim, directions, bins, sensor, mounting):
    """Where the beams of all rings, at all azimuths, meet the claimed floor: as DrawnFloor."""
    rings = sensor.rings_by_elevation()
    tangent = np.repeat(sensor.tangent(rings), len(directions))
    ring = np.repeat(rings.astype(np.int64), len(directions))
    east, north = np.tile(directions, (len(rings), 1)).T
    turn = room.rotation_from_sensor(mounting)
    x, y, z = ((row[0] * east + row[1] * north) + row[2] * tangent for row in turn)
    a, b, c = room.plane
    slope = z - (a * x + b * y)
    falls = slope < _FLATTEST
    along = c / slope[falls]
    xyz = np.column_stack([along * x[falls], along * y[falls], along * z[falls]])
    xyz = xyz.astype(np.float32).astype(np.float64)
    planar = np.sqrt(xyz[:, 0] * xyz[:, 0] + xyz[:, 1] * xyz[:, 1])
    column = bins.index(xyz[:, 0], xyz[:, 1])
    near = planar <= claim.limit[column]
    return xyz[near], column[near], planar[near], ring[falls][near]


def _fill(room, claim, directions):
    """Floor between the rings and up to the boundary: as DrawnFloor.

    Columns are left out near the sensor, where they lie closer than need be.
    """
    column, planar = [], []
    spacing = _FILL * room.params.cell_size
    for c in np.flatnonzero(claim.limit > 0.0):
        begin = _fill_begin(int(c), spacing)
        limit = claim.limit[c]
        count = max(0, math.ceil((limit - begin) / spacing))
        radii = np.minimum(begin + np.arange(count) * spacing, limit)
        planar.append(np.append(radii, limit))
        column.append(np.full(count + 1, c))
    column = np.concatenate([np.zeros(0, np.int64), *column])
    planar = np.concatenate([np.zeros(0), *planar])
    x, y = planar * directions[column, 0], planar * directions[column, 1]
    a, b, c = room.plane
    xyz = np.column_stack([x, y, (a * x + b * y) + c]).astype(np.float32).astype(np.float64)
    return xyz, column, planar, np.full(len(column), _NO_RING)


def _fill_begin(column, spacing):
    """Planar range [m] from which on a column is filled: every 16th from the first step on, those
    between them from where their neighbours are farther apart than a step."""
    step = 16
    while column % step != 0:
        step //= 2
    return spacing if step == 16 else spacing / (2 * step * _COLUMN)


def merge(view, valid, room, claim, drawn, outline, sensor, mounting, floor):
    """The surface: measured points in input order, then the drawn ones.

    Parameters
    ----------
    view : ScanView
        The scan, of which the points `valid` (int64) are the room's returns.
    room, claim, drawn
    outline : tuple
        Of :func:`outline_of`.
    sensor : SensorModel
    mounting : Mounting
    floor : FloorModel
        In the level frame.
    """
    kept = valid[claim.measured]
    xyz = _in_sensor_frame(drawn.xyz, room, mounting)
    count = len(xyz)
    provenance = np.array([Provenance.MEASURED, Provenance.RECONSTRUCTED], np.uint8)
    confidence = measured_confidence(room, claim), drawn_confidence(room, claim, drawn)
    return FloorSurface(
        np.concatenate([view.xyz[kept], xyz]),
        np.concatenate([view.intensity[kept], np.zeros(count, np.float32)]),
        np.concatenate([view.ring[kept], _rings(xyz, drawn, sensor)]),
        np.repeat(provenance, [len(kept), count]),
        np.concatenate(confidence),
        *outline,
        rotated_plane(floor.plane, mounting.rotation.T),
        np.concatenate([_measured_sigma(room, claim, floor), _drawn_sigma(room, drawn, floor)]),
    )


def _measured_sigma(room, claim, floor):
    """Of the measured points' heights [m], float32."""
    x, y, z = room.xyz[claim.measured].T
    sine = np.abs(z) / np.sqrt((x * x + y * y) + z * z)
    return floor.measured_sigma(sine).astype(np.float32)


def _drawn_sigma(room, drawn, floor):
    """Of the drawn points' heights: the plane's, its unevenness and the relief's [m], float32."""
    x, y, _ = rotated(room.rotation.T, drawn.xyz.astype(np.float32)).astype(np.float64).T
    relief = room.relief.sigma(drawn.xyz[:, :2], room.flatness())
    plane = floor.sigma(x, y)
    return np.sqrt(plane * plane + relief * relief).astype(np.float32)


def outline_of(room, claim, directions, mounting):
    """A vertex per column where floor is claimed, and the foot once where none is.

    Returns boundary (K, 3) float32 in the sensor frame and boundary_kind (K,) uint8.
    """
    limit = claim.limit
    radius = np.minimum(limit, room.drops.begin)
    distance = room.profile.distance
    ends_at_wall = (radius >= np.maximum(0.0, distance - _AT_WALL)) & (radius <= distance)
    kind = np.where(ends_at_wall, room.profile.kind, BoundaryKind.LIMIT_OF_KNOWLEDGE)
    claims = radius > 0.0
    if not claims.any():
        return np.zeros((0, 3), np.float32), np.zeros(0, np.uint8)
    keep = claims | np.roll(claims, 1)
    kind = np.where(claims, kind, BoundaryKind.LIMIT_OF_KNOWLEDGE)
    xy = (radius[:, None] * directions)[keep]
    a, b, c = room.plane
    upright = np.column_stack([xy, (a * xy[:, 0] + b * xy[:, 1]) + c])
    return _in_sensor_frame(upright, room, mounting), kind[keep].astype(np.uint8)


def _in_sensor_frame(upright, room, mounting):
    level = rotated(room.rotation.T, upright.astype(np.float32))
    return mounting.to_sensor(level)


def _rings(xyz, drawn, sensor):
    """Each beam's own ring; for fill, in the sensor frame, the ring next in elevation. uint16."""
    rings = sensor.rings_by_elevation()
    if len(rings) == 0:
        return np.zeros(len(xyz), np.uint16)
    tangent = sensor.tangent(rings)
    x, y, z = xyz.astype(np.float64).T
    of_points = z / np.maximum(np.sqrt(x * x + y * y), 1e-6)
    nearest = rings[np.searchsorted(0.5 * (tangent[1:] + tangent[:-1]), of_points)]
    return np.where(drawn.ring == _NO_RING, nearest, drawn.ring).astype(np.uint16)
