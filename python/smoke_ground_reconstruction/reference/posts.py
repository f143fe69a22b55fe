"""Vertical posts in single azimuth columns, and the ceiling above them."""

import math
from dataclasses import dataclass

import numpy as np

from .ordered import ordered_sum
from .sample import sample

POST_SHARE = 0.6  # of the returns around that belong to a post: smoke is spread wider
POST_POINTS = 4
POST_EXTENT = 0.12  # least height of a post [m]
_NEAR = 0.06  # planar range between a post and the returns where it stands [m]
_HALF = 25.0  # a post's returns lie this near to each other in planar range [mm]
_AROUND = 120.0  # what lies this near counts as around [mm]
_TOLD_BY = 3  # one column in so many tells the spread of walls
_FEWEST_TELLING, _FEWEST_COLUMNS = 8, 10  # returns in it, and columns that tell
_TIGHTEST = 20  # one in so many sees nothing but wall
_USUAL_SPREAD = 0.025  # up to which walls are found by the usual widths [m]
_WIDEST = 3.0  # times these
_ON_LINE = 0.015  # a post so little behind a line is part of its wall, usually [m]
_ON_LINE_SPREADS = 1.75  # so many spreads: three sigma of the mean of a post's six returns

_CEILING_LOWEST, _CEILING_HIGHEST = 1.6, 12.0  # above the floor [m]
_SLOTS_PER_METRE, _SLOTS = 50.0, 520
_METRE = 50  # slots
_LOOKED_AT = 12000  # returns among which the ceiling is sought, at least
_CEILING_POINTS = 100
_CEILING_SHARE = 0.2
_CEILING_WIDTH, _WIDE_COLUMNS = 0.5, 0.25  # it is so wide [m] in a share of its columns


@dataclass(frozen=True)
class Posts:
    """Vertical structures in single columns, ordered by column and distance.

    Attributes
    ----------
    column, count : (P,) int64
    distance, low, high, x, y : (P,) float64
        Planar range, heights of its lowest and highest return above the floor, mean place [m].
    """

    column: np.ndarray
    count: np.ndarray
    distance: np.ndarray
    low: np.ndarray
    high: np.ndarray
    x: np.ndarray
    y: np.ndarray

    def are_at(self, columns, column, planar, beside=0):
        """(N,) bool: is there a post at a planar range (N,) [m] in a column (N,) of `columns`, or
        in those `beside` it?"""
        counts = np.bincount(self.column, minlength=columns)
        place = np.arange(len(self.column)) - (np.cumsum(counts) - counts)[self.column]
        distances = np.full((columns, counts.max()), np.inf)
        distances[self.column, place] = self.distance
        found = np.zeros(len(column), bool)
        for offset in range(-beside, beside + 1):
            there = distances[(column + offset) % columns]
            found |= (np.abs(planar[:, None] - there) <= _NEAR).any(axis=1)
        return found


def ceiling_height(height, planar, column):
    """Height of the ceiling above the floor [m]; infinite where none is seen.

    The level that holds a large share of what is above: the strongest slot of heights, each return
    weighted by its range (near ones are dense). A column shows a ceiling at several ranges, but of
    a wall only one ring hits a level: so a sensor that looks no higher than the walls sees none.
    Some thousand returns stand for all, if they show one.
    """
    some = sample(len(height), _LOOKED_AT)
    found = _ceiling_among(height[some], planar[some], column[some])
    # A ceiling of which little is seen.
    return found if math.isfinite(found) else _ceiling_among(height, planar, column)


def _ceiling_among(height, planar, column):
    slot = np.floor((height - _CEILING_LOWEST) * _SLOTS_PER_METRE)
    high = (slot >= 0.0) & (slot < _SLOTS)
    height, planar, column, slot = (values[high] for values in (height, planar, column, slot))
    if len(height) < _CEILING_POINTS:
        return math.inf
    votes = np.bincount(slot.astype(np.int64) + 1, planar, _SLOTS + 2)
    around = (votes[:-2] + votes[1:-1]) + votes[2:]
    at = int(around.argmax())
    if around[at] < _CEILING_SHARE * ordered_sum(votes[max(0, at - _METRE) + 1 :]):
        return math.inf
    near = np.abs(slot - at) < 2.0
    count = np.count_nonzero(near)
    if count < _CEILING_POINTS or not _is_wide(column[near], planar[near]):
        return math.inf
    return ordered_sum(height[near]) / count


def _is_wide(column, planar):
    """Do a share of the columns show a level over some width?"""
    nearest, farthest = np.full(column.max() + 1, np.inf), np.zeros(column.max() + 1)
    np.minimum.at(nearest, column, planar)
    np.maximum.at(farthest, column, planar)
    wide = np.count_nonzero(farthest - nearest >= _CEILING_WIDTH)
    return wide >= _WIDE_COLUMNS * np.count_nonzero(farthest)


def spread_of_walls(column, planar):
    """How far walls' returns stray, 0.7 to 0.9 sigma of normal noise [m]; 0 where too few
    columns tell.

    A column is as wide as the narrowest half of its returns (N,) that can be wall, and a twentieth
    of the columns see nothing but wall.
    """
    key = np.sort(_keys(column, planar))
    widths = []
    for of_column in np.split(key, np.flatnonzero(np.diff(key // 200000)) + 1):
        half = len(of_column) // 2
        if len(of_column) >= _FEWEST_TELLING and of_column[0] // 200000 % _TOLD_BY == 0:
            widths.append((of_column[half:] - of_column[: len(of_column) - half]).min())
    if len(widths) < _FEWEST_COLUMNS:
        return 0.0
    return float(np.sort(widths)[len(widths) // _TIGHTEST]) * 0.001


def widening_for(spread):
    """How many times as wide as usual the places of walls are taken to be, where their returns
    stray by so much [m]."""
    return min(max(1.0, spread / _USUAL_SPREAD), _WIDEST)


def on_line_for(spread):
    """How little behind a line a post is part of its wall [m], where returns stray by so much."""
    return max(_ON_LINE, _ON_LINE_SPREADS * spread)


def _keys(column, planar):
    return column * 200000 + np.floor(planar * 1000.0).astype(np.int64)


def find_posts(column, planar, height, xy, widening=1.0):
    """Posts among returns that can be wall; all arrays (N,), `xy` (N, 2).

    Planar ranges are compared in whole millimetres.
    """
    near, around = int(_HALF * widening), int(_AROUND * widening)
    key = _keys(column, planar)
    order = np.argsort(key, kind="stable")
    key = key[order]
    within = _count_within(key, near)
    dense = (within >= POST_POINTS) & (within >= POST_SHARE * _count_within(key, around))
    key, order = key[dense], order[dense]
    group = np.cumsum(np.diff(key, prepend=key[:1]) > near)
    count = np.bincount(group)
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, group, height[order])
    np.maximum.at(high, group, height[order])
    first = np.searchsorted(group, np.arange(len(count)))
    keep = (count >= POST_POINTS) & (high - low >= POST_EXTENT)
    x, y, distance = (
        (np.bincount(group, values[order]) / count)[keep] for values in (*xy.T, planar)
    )
    return Posts(column[order[first]][keep], count[keep], distance, low[keep], high[keep], x, y)


def _count_within(key, half):
    return np.searchsorted(key, key + half, "right") - np.searchsorted(key, key - half, "left")
