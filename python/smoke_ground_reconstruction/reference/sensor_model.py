"""The order of a LiDAR's rings by elevation, whatever the driver's numbering."""

import math

import numpy as np

from .predicates import is_return, planar_range

_DEGREE = math.pi / 180.0
_RING_GAP = 0.15 * _DEGREE  # beams of known sensors are at least 0.33 deg apart
_WIDEST_RING = 1.0 * _DEGREE  # wider: beams ran together
_ELEVATION_STEP = 0.5 * _DEGREE  # where beams cannot be told apart
_MOST_RINGS = 256


class SensorModel:
    """Ring elevations, seeded from a beam table or learned from the scans themselves.

    Ring 0 is the lowest beam of a QT128 and the highest of an Ouster, and a QT128's last 32 rings
    interleave with others, so "lowest ring" (Algorithm 5 line 17) is decided by elevation.
    """

    NO_RANK = 0xFFFF  #: rank of a ring never seen

    def __init__(self):
        self._tangent = np.zeros(0)
        self._points = np.zeros(0, np.int64)  # behind the median; 0: never seen
        self._rings = np.zeros(0, np.uint16)
        self._rank = np.zeros(0, np.uint16)

    @classmethod
    def from_elevations(cls, elevation_deg) -> "SensorModel":
        """Known beams: ``elevation_deg[ring]`` about the sensor's xy plane; never overruled.

        Raises ValueError on an elevation not within +-90 deg, or above 65535 beams.
        """
        sensor = cls()
        angles = np.asarray(elevation_deg, np.float64)
        if len(angles) > cls.NO_RANK:
            raise ValueError(f"the number of beams must be at most 65535, is {len(angles)}")
        for angle in angles[~(np.abs(angles) < 90.0)]:
            raise ValueError(f"the elevation of a beam must be within -90 and 90 deg, is {angle}")
        sensor._tangent = np.array([math.tan(a * _DEGREE) for a in angles])
        sensor._points = np.full(len(angles), np.iinfo(np.int64).max)
        sensor._order_rings()
        return sensor

    def observe(self, view) -> None:
        """Learn the elevation of each ring in a scan.

        It is the lower median of z / planar range of the ring's points. A ring keeps the median of
        the scan that showed most points of it, so that a smoky scan with three returns does not
        overrule a clear one. Invalid points and points on the vertical axis tell nothing.

        `view` is a ScanView: the sensor frame, not the level one.
        """
        xyz, ring = view.xyz, view.ring.astype(np.int64)
        is_off_axis = (xyz[:, 0] != 0.0) | (xyz[:, 1] != 0.0)
        tells = is_return(xyz) & is_off_axis & (ring != self.NO_RANK)
        xyz, ring = xyz[tells], ring[tells]
        if len(ring) == 0:
            return
        tangent = xyz[:, 2].astype(np.float64) / planar_range(xyz)
        by_ring = np.lexsort((tangent, ring))
        rings, begin, count = np.unique(ring[by_ring], return_index=True, return_counts=True)
        median = tangent[by_ring][begin + (count - 1) // 2]
        self._grow(rings[-1] + 1)
        better = count > self._points[rings]
        self._tangent[rings[better]] = median[better]
        self._points[rings[better]] = count[better]
        self._order_rings()

    def rank(self, ring):
        """Place of each ring in elevation order, 0 the lowest; NO_RANK for a ring never seen."""
        ring = np.asarray(ring, np.int64)
        known = ring < len(self._rank)
        rank = np.full(ring.shape, self.NO_RANK, np.uint16)
        rank[known] = self._rank[ring[known]]
        return rank

    def rings_by_elevation(self):
        """Ring numbers (uint16), lowest beam first; equal elevations by ring number."""
        return self._rings

    def tangent(self, ring):
        """Tangent of the elevation of rings that have a rank."""
        return self._tangent[ring]

    def _grow(self, rings: int) -> None:
        missing = max(0, rings - len(self._points))
        self._tangent = np.pad(self._tangent, (0, missing))
        self._points = np.pad(self._points, (0, missing))

    def _order_rings(self) -> None:
        seen = np.flatnonzero(self._points > 0)
        self._rings = seen[np.lexsort((seen, self._tangent[seen]))].astype(np.uint16)
        self._rank = np.full(len(self._points), self.NO_RANK, np.uint16)
        self._rank[self._rings] = np.arange(len(self._rings))


def rings_from_elevation(xyz):
    """Ring numbers, uint16 (N,), for a cloud whose driver sends none.

    Points are grouped by elevation, ring 0 the lowest, a new ring wherever two neighbouring
    elevations are more than 0.15 deg apart. Where the beams cannot be told apart (more than 256
    groups, or a group wider than 1 deg), elevation is cut into steps of 0.5 deg instead. Invalid
    points get ring 0. `xyz` is float32 (N, 3), in the sensor frame.
    """
    xyz = np.asarray(xyz, np.float32).reshape(-1, 3)
    rings = np.zeros(len(xyz), np.uint16)
    valid = is_return(xyz)
    if valid.any():
        elevation = np.arctan2(xyz[valid, 2].astype(np.float64), planar_range(xyz[valid]))
        groups = _split_at_gaps(elevation)
        rings[valid] = _cut_into_steps(elevation) if groups is None else groups
    return rings


def _split_at_gaps(elevation):
    """Rings split at gaps; None where the beams cannot be told apart."""
    order = np.argsort(elevation, kind="stable")
    ascending = elevation[order]
    ring = np.concatenate([[0], np.cumsum(np.diff(ascending) > _RING_GAP)])
    begin = ascending[np.searchsorted(ring, ring)]  # of each point's group
    if ring[-1] >= _MOST_RINGS or np.any(ascending - begin > _WIDEST_RING):
        return None
    rings = np.empty(len(ring), np.uint16)
    rings[order] = ring
    return rings


def _cut_into_steps(elevation):
    return np.floor((elevation - elevation.min()) / _ELEVATION_STEP).astype(np.uint16)
