"""Where the floor ends at a drop: a pit, a ledge, stairs that descend.

A return from below the floor proves that its beam met no floor where it crossed the floor's plane.
The floor ends before the first such crossing of a column and goes on only where it is measured
again beyond the last. Not in the thesis.
"""

from dataclasses import dataclass

import numpy as np

_DEPTH = 0.1  # a return this far below the floor is none of it [m]
_NEIGHBORS = 2  # columns to either side that share what they see
_WITNESSES = 2  # returns that make a drop
_WIDEST_GAP = 12  # columns between two that see a drop, which then see it too
_FLOOR_AGAIN = 3  # measured returns of floor beyond a drop
_EDGE = 0.02  # measured floor ends this far before the edge for certain [m]
_BEYOND_EDGE = 0.3  # floor measured so far beyond an edge shows that the drop ended [m]
_WIDEST_SPREAD = 25  # columns to either side of a drop that may belong to it


@dataclass(frozen=True)
class DropOffs:
    """Per column, planar ranges [m]; the floor between `begin` and `end` is not to be claimed.

    Attributes
    ----------
    begin, end : (columns,) float64
        Both infinite where no drop is seen; `end` infinite where no floor is measured beyond.
    """

    begin: np.ndarray
    end: np.ndarray

    def hides(self, column, planar):
        """Does a place (N,) lie over a drop, or beyond one without floor measured again?"""
        return (planar > self.begin[column]) & (planar < self.end[column])


def find_drop_offs(column, planar, height, is_floor, sensor_height, columns):
    """Drops of all columns.

    Parameters
    ----------
    column, planar, height : (N,)
        Azimuth column, planar range and height above the floor of each return [m].
    is_floor : (N,) bool
        Measured floor; feet of walls must not be among it.
    sensor_height : float
        Height of the sensor above the floor [m].
    columns : int
        Their number.
    """
    below = height < -_DEPTH
    crossing = planar[below] * (sensor_height / (sensor_height - height[below]))
    first, last = _witnessed(column[below], crossing, columns)
    first, last = _joined(first, last)
    begin, end = np.full(columns, np.inf), np.full(columns, np.inf)
    for c in np.flatnonzero(np.isfinite(first)):
        around = _around(column, c, columns) & is_floor
        before = planar[around & (planar < first[c])]
        again = np.sort(planar[around & (planar > last[c])])
        begin[c] = max(0.0, before.max() - _EDGE) if len(before) > 0 else 0.0
        if len(again) >= _FLOOR_AGAIN:
            end[c] = again[0]
    _spread(begin, end, _farthest(column[is_floor], planar[is_floor], columns))
    return DropOffs(begin, end)


def _farthest(column, planar, columns):
    """How far floor is measured in each column and its neighbours [m]."""
    own = np.zeros(columns)
    np.maximum.at(own, column, planar)
    return np.max([np.roll(own, k) for k in range(-_NEIGHBORS, _NEIGHBORS + 1)], axis=0)


def _spread(begin, end, farthest):
    """A drop goes on sideways until floor is measured well beyond its edge."""
    seen = np.isfinite(begin)
    for step in (1, -1):
        for c in np.flatnonzero(seen):
            edge = begin[c]
            for k in range(1, _WIDEST_SPREAD + 1):
                at = (c + step * k) % len(begin)
                if seen[at] or farthest[at] > edge + _BEYOND_EDGE:
                    break
                edge = max(edge, farthest[at] - _EDGE)
                begin[at] = min(begin[at], edge)


def _around(column, centre, columns):
    away = np.abs(column - centre)
    return np.minimum(away, columns - away) <= _NEIGHBORS


def _witnessed(column, crossing, columns):
    """Second nearest and second farthest crossing of each column and its neighbours."""
    first, last = np.full(columns, np.inf), np.full(columns, -np.inf)
    for c in range(columns) if len(column) > 0 else ():
        near = np.sort(crossing[_around(column, c, columns)])
        if len(near) >= _WITNESSES:
            first[c], last[c] = near[_WITNESSES - 1], near[-_WITNESSES]
    return first, np.maximum(first, last) if len(column) > 0 else last


def _joined(first, last):
    """Columns between two that see a drop see the wider of both."""
    seen = np.flatnonzero(np.isfinite(first))
    first, last = first.copy(), last.copy()
    for a, b in zip(seen, np.roll(seen, -1)):
        gap = (b - a - 1) % len(first)
        if 0 < gap <= _WIDEST_GAP:
            between = (a + 1 + np.arange(gap)) % len(first)
            first[between] = min(first[a], first[b])
            last[between] = max(last[a], last[b])
    return first, last
