"""The floor of a room, completed: how far it is claimed, its points and its outline.

Thesis: Algorithm 3 draws evenly spaced radii; here the sensor's own beams are cut with the floor,
and what lies between them is filled.
"""

import math
from dataclasses import dataclass

import numpy as np

from .cells import cell_keys
from .confidence import drawn_confidence, measured_confidence
from .floor_surface import BoundaryKind, FloorSurface, Provenance
from .room import BEYOND, rotated_plane

COLUMN_DEG = 0.4
_AT_WALL = 0.008  # the claimed floor ends this far before the wall [m]
_CELL = 0.1  # measured floor wins in cells of this size [m]
_FILL = 0.06  # claimed floor between the rings is drawn this densely [m]


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
        [m]
    """

    xyz: np.ndarray
    column: np.ndarray
    planar: np.ndarray


def claim_floor(room):
    """How far the floor of a room is claimed, and which returns are floor."""
    distance = room.profile.distance
    open_end = np.maximum(room.seen_floor, room.drops.floor_to)
    limit = np.where(distance > 0.0, np.maximum(0.0, distance - _AT_WALL), open_end)
    measured = _measured(room, limit)
    # Drawn on to floor measured behind an opening: it goes on in between.
    behind = measured & (room.planar > limit[room.column] + BEYOND)
    return FloorClaim(np.maximum(limit, room.farthest(behind, beside=1)), measured)


def _measured(room, limit):
    """Returns that are floor: before the boundary, or level with it behind an opening."""
    before = (room.planar <= limit[room.column]) & (room.past_wall() <= -_AT_WALL)
    behind = room.planar > limit[room.column] + BEYOND
    level = room.is_low & ~room.drops.hides(room.column, room.planar)
    measured = level & before
    behind &= level
    if np.any(behind):
        measured |= behind & room.goes_on_level()
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
    fill = _fill(room, claim.limit, directions)
    drawn = np.vstack([_beams(room, directions, sensor, mounting), fill])
    column = bins.index(drawn[:, 0], drawn[:, 1])
    planar = np.sqrt(drawn[:, 0] ** 2 + drawn[:, 1] ** 2)
    claimed = (planar <= claim.limit[column]) & ~room.drops.hides(column, planar)
    claimed &= ~np.isin(cell_keys(drawn, _CELL), cell_keys(room.xyz[claim.measured], _CELL))
    drawn = drawn[claimed]
    drawn[:, 2] += room.relief.at(drawn[:, :2])
    return DrawnFloor(drawn, column[claimed], planar[claimed])


def _beams(room, directions, sensor, mounting):
    """Where the beams of all rings, at all azimuths, meet the floor; upright frame (M, 3)."""
    tangent = sensor.tangent(sensor.rings_by_elevation())
    east, north = (directions[:, axis] for axis in (0, 1))
    ones = np.ones((len(tangent), len(east)))
    rays = np.stack([east * ones, north * ones, tangent[:, None] * ones], axis=-1)
    rays = rays.reshape(-1, 3) @ (room.rotation @ mounting.rotation).T
    a, b, c = room.plane
    slope = rays[:, 2] - (a * rays[:, 0] + b * rays[:, 1])
    falls = slope < -1e-3
    return rays[falls] * (c / slope[falls])[:, None]


def _fill(room, limit, directions):
    """Floor between the rings and up to the wall; upright frame (M, 3).

    Columns are left out near the sensor, where they lie closer than need be.
    """
    parts = []
    for c in np.flatnonzero(limit > 0.0):
        stride_4, stride_2 = 4 * _FILL / math.radians(COLUMN_DEG * 16), 2 * _FILL / 0.028
        begin = 0.0 if c % 4 == 0 else (stride_4 if c % 2 == 0 else stride_2)
        radii = np.arange(begin, limit[c], _FILL)
        radii = np.concatenate([radii, [limit[c]]])
        parts.append(radii[:, None] * directions[c])
    xy = np.concatenate(parts) if parts else np.zeros((0, 2))
    a, b, c = room.plane
    return np.column_stack([xy, a * xy[:, 0] + b * xy[:, 1] + c])


def merge(view, valid, room, claim, drawn, outline, sensor, mounting, plane):
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
    plane : (3,) float64
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
        np.concatenate([view.ring[kept], _nearest_rings(xyz, sensor)]),
        np.repeat(provenance, [len(kept), count]),
        np.concatenate(confidence),
        *outline,
        rotated_plane(plane, mounting.rotation.T),
    )


def outline_of(room, claim, directions, mounting):
    """A vertex per column where floor is claimed, and the foot once where none is.

    Returns boundary (K, 3) float32 in the sensor frame and boundary_kind (K,) uint8.
    """
    limit = claim.limit
    radius = np.minimum(limit, room.drops.begin)
    ends_elsewhere = (radius < limit) | (limit > room.profile.distance)
    kind = np.where(ends_elsewhere, BoundaryKind.LIMIT_OF_KNOWLEDGE, room.profile.kind)
    claims = radius > 0.0
    if not claims.any():
        return np.zeros((0, 3), np.float32), np.zeros(0, np.uint8)
    keep = claims | np.roll(claims, 1)
    kind = np.where(claims, kind, BoundaryKind.LIMIT_OF_KNOWLEDGE)
    xy = (radius[:, None] * directions)[keep]
    a, b, c = room.plane
    upright = np.column_stack([xy, a * xy[:, 0] + b * xy[:, 1] + c])
    return _in_sensor_frame(upright, room, mounting), kind[keep].astype(np.uint8)


def _in_sensor_frame(upright, room, mounting):
    level = np.ascontiguousarray((room.rotation.T @ upright.T).T, np.float32)
    return mounting.to_sensor(level)


def _nearest_rings(xyz, sensor):
    """The rings (uint16) next in elevation to points in the sensor frame."""
    rings = sensor.rings_by_elevation()
    if len(rings) == 0:
        return np.zeros(len(xyz), np.uint16)
    tangent = sensor.tangent(rings)
    planar = np.sqrt(xyz[:, 0].astype(np.float64) ** 2 + xyz[:, 1].astype(np.float64) ** 2)
    of_points = xyz[:, 2] / np.maximum(planar, 1e-6)
    return rings[np.searchsorted(0.5 * (tangent[1:] + tangent[:-1]), of_points)]
