"""Straight edges of drops: where they run, how far they are seen, how far they go on.

A line is an edge where in many columns it lies between the last measured floor and the first beam
that fell through the floor. Not in the thesis.
"""

import math
from dataclasses import dataclass

import numpy as np

from .predicates import Direction

_EDGE = 0.02  # measured floor ends this far before the edge for certain, usually [m]
_PLACE = 0.03  # tolerance of a return's place against an edge, usually [m]
_DEPTH = 0.04  # a return so far below a level floor is none of it [m]
_DEPTH_SLOPE = 0.005  # and so much more per metre: a plane off by 0.3 deg
ACROSS = 0.15  # least cosine between a column and the normal of an edge

_ANGLES, _STEP_DEG = 180, 2.0  # of an edge's normal, coarse search
_FINE_ANGLES, _FINE_STEP_DEG = 10, 0.2  # to either side of the best one
_SLOT = 0.01  # of an edge's distance from the sensor [m]
_FARTHEST = 12.0  # [m]
_MARGIN_WORTH, _MOST_MARGIN = 2.0, 0.5  # columns that a metre of room between floor and drop is
# worth, and the room [m] that is worth no more
_ALIGNED_SHARE = 0.6  # of the columns of the best edge make one along or across a wall the better
_EDGE_COLUMNS = 6  # that make an edge
_MOST_EDGES = 6
_LIKE_NORMALS = 0.9  # cosine between normals of what is one line
_DOUBT_SHARE = 0.8  # of the columns of an edge make another one as likely
_PASSED = 0.1  # floor measured so far beyond an edge shows that it does not go on there [m]
_RESUMED = 0.15  # and floor so near behind it, that it ended before [m]
_PASSED_COLUMNS = 2
_WIDEST_SPAN = 90.0  # between two columns of one edge [deg]
_DRAWN_ON_COLUMNS = 25  # so far an edge of any direction goes on, or by
_DRAWN_ON, _DRAWN_ON_SHARE = 0.3, 0.5  # beyond its seen ends: metres, and of its seen length


@dataclass(frozen=True)
class DropTolerances:
    """What may be floor, and how well returns tell where it ends.

    Attributes
    ----------
    depth : float
        A return so far below the floor beneath the sensor is none of it [m].
    lift : float
        ... if noise does not lift or lower it: by so much times the range [m2].
    widening : float
        Of the places of edges, as by posts.widening_for().
    """

    depth: float = _DEPTH
    lift: float = 0.0
    widening: float = 1.0

    @property
    def edge(self):
        """Measured floor ends this far before the edge for certain [m]."""
        return _EDGE * self.widening

    @property
    def place(self):
        """Of a return's place against an edge [m]."""
        return _PLACE * self.widening

    @property
    def clear(self):
        """Measured floor lies behind an edge if it is so far behind it [m]."""
        return self.edge + self.place

    def is_below(self, planar, height, sensor_height):
        """Which returns (N,), by planar range and height, are none of the floor?"""
        deep, down = -height - _DEPTH_SLOPE * planar, sensor_height - height
        noisy = deep * deep * (planar * planar + down * down) <= self.lift * self.lift
        return (deep > self.depth) & ~noisy


@dataclass(frozen=True)
class Edge:
    """A straight edge: its normal away from the sensor, its distance, and the columns it spans.

    It may run along or across a wall (`aligned`), beyond doubt (`sure`).
    """

    nx: float
    ny: float
    rho: float
    aligned: bool
    sure: bool
    first: int
    count: int

    @property
    def in_doubt(self):
        """Along or across a wall, as others are that may stand for it."""
        return self.aligned and not self.sure

    def across(self, directions):
        """Cosine between directions (..., 2) and the normal."""
        return self.nx * directions[..., 0] + self.ny * directions[..., 1]

    def along(self, direction):
        """Place along the edge where it meets a direction [m]."""
        sideways = self.nx * direction[1] - self.ny * direction[0]
        return self.rho * sideways / self.across(direction)


def find_edges(before, after, sees, directions, walls, place):
    """The edges, each as far as it is seen, and where the drop behind it begins for certain."""
    left, edges = sees.copy(), []
    for _ in range(_MOST_EDGES):
        likely = _likely_edges(before, after, left, directions, walls, place)
        if not likely:
            break
        still = left.copy()
        for line in likely:
            explained, run = _longest_run(line[:3], before, after, still, sees, directions, place)
            left &= ~explained
            if run is not None:
                edge = Edge(*line, *run)
                across = edge.across(directions[explained])
                edges.append((edge, float((after[explained] * across).min())))
    return edges


def _likely_edges(before, after, use, directions, walls, place):
    """The line that lies between floor and drop in most columns, with most room.

    Its normal, its distance, whether it runs along or across a wall, and whether it does so beyond
    doubt. In doubt the others that are as likely come after it; none where no line lies there in
    enough columns.
    """
    use = np.flatnonzero(use)
    if len(use) < _EDGE_COLUMNS:
        return []
    columns = before[use], after[use], directions[use], place
    free = _freely_turned(columns)
    aligned = _candidates(columns, _along_and_across(walls))
    best = _first_best(aligned)
    if best is not None and best.columns >= max(_EDGE_COLUMNS, _ALIGNED_SHARE * free.columns):
        others = [one for one in aligned if one.nx * best.nx + one.ny * best.ny < _LIKE_NORMALS]
        others = [one for one in others if one.columns > _DOUBT_SHARE * best.columns]
        return [(one.nx, one.ny, one.rho, True, len(others) == 0) for one in (best, *others)]
    return [(free.nx, free.ny, free.rho, False, False)] if free.columns >= _EDGE_COLUMNS else []


def _along_and_across(walls):
    return [normal for x, y in walls for normal in ((x, y), (-y, x), (-x, -y), (y, -x))]


def _freely_turned(columns):
    """The best line of any normal: a coarse search, then a fine one about its best."""
    coarse = _candidates(columns, [Direction.from_degrees(_STEP_DEG * k) for k in range(_ANGLES)])
    angle = _STEP_DEG * coarse.index(_first_best(coarse))
    fine = [angle + _FINE_STEP_DEG * k for k in range(-_FINE_ANGLES, _FINE_ANGLES + 1)]
    return _first_best(_candidates(columns, [Direction.from_degrees(deg) for deg in fine]))


@dataclass(frozen=True)
class _Candidate:
    """A line, the columns that agree on it, and its score."""

    nx: float
    ny: float
    rho: float
    columns: int
    score: float


def _candidates(columns, normals):
    return [_candidate(*columns, *normal) for normal in normals]


def _first_best(candidates):
    """The first of highest score."""
    return max(candidates, key=lambda one: one.score, default=None)


def _candidate(before, after, directions, place, nx, ny):
    """The line with a normal that most columns agree on, just before the drop begins."""
    across = nx * directions[:, 0] + ny * directions[:, 1]
    facing = across > ACROSS
    slots = int(_FARTHEST / _SLOT)
    low = _slot((before * across)[facing] - place, slots)
    high = _slot((after * across)[facing] + place, slots) + 1
    change = np.bincount(low, minlength=slots + 2) - np.bincount(high, minlength=slots + 2)
    agree = np.cumsum(change)[:slots]
    count = int(agree.max())
    room = np.flatnonzero(agree == count)
    margin = min(_SLOT * len(room), _MOST_MARGIN)
    rho = room[-1] * _SLOT - place
    return _Candidate(nx, ny, rho, count, count + _MARGIN_WORTH * margin)


def _slot(distance, slots):
    return np.clip(np.floor(distance / _SLOT), 0, slots).astype(np.int64)


def _between(before, after, across, rho, place):
    """Columns that see floor before a line and the drop behind it."""
    with np.errstate(invalid="ignore"):
        agrees = (before * across <= rho + place) & (after * across >= rho - place)
    return agrees & (across > ACROSS)


def _longest_run(edge, before, after, left, sees, directions, place):
    """Columns an edge explains, and (first, count) of the longest run of them, None if short.

    A run breaks where floor is measured beyond the edge, where columns that see a drop do not
    agree, and where the edge is not seen for too long.
    """
    nx, ny, rho = edge
    columns = len(before)
    across = nx * directions[:, 0] + ny * directions[:, 1]
    facing = across > ACROSS
    agrees = _between(before, after, across, rho, place)
    explained = left & agrees
    against = facing & ~agrees & (sees | (before * across > rho + _PASSED)) | ~facing
    runs, at = [], np.flatnonzero(explained)
    for a, b in zip(at, np.roll(at, -1)):
        between = (a + 1 + np.arange((b - a - 1) % columns)) % columns
        joins = len(between) + 1 <= _WIDEST_SPAN * columns / 360.0
        joins &= np.count_nonzero(against[between]) < _PASSED_COLUMNS
        runs.append(joins)
    return explained, _most_columns(at, np.array(runs, bool), columns)


def _most_columns(at, joins, columns):
    """First column and length of the run that holds most of the columns `at`."""
    if len(at) == 0:
        return None
    start = int(np.flatnonzero(~joins)[-1]) + 1 if not joins.all() else 0
    at, joins = np.roll(at, -start), np.roll(joins, -start)
    ends = np.flatnonzero(~joins)
    begins = np.concatenate([[0], ends[:-1] + 1]) if len(ends) > 0 else np.zeros(1, int)
    ends = ends if len(ends) > 0 else np.array([len(at) - 1])
    longest = int((ends - begins).argmax())
    first, last = int(at[begins[longest]]), int(at[ends[longest]])
    if ends[longest] - begins[longest] + 1 < _EDGE_COLUMNS:
        return None
    return first, (last - first) % columns + 1


def drawn_on(edge, taken, floor, sealed, directions, clear):
    """Columns (two lists) into which an edge goes on, until floor is measured right behind it.

    One that may run otherwise goes no farther than to where no drop reaches the wall, either.
    """
    columns = len(directions)
    ends = [edge.first, (edge.first + edge.count - 1) % columns]
    along = [edge.along(directions[c]) for c in ends]
    farthest = _DRAWN_ON + _DRAWN_ON_SHARE * abs(along[1] - along[0])
    drawn = [], []
    for side, last, step, start in zip(drawn, ends, (-1, 1), along):
        for k in range(1, columns):
            c = (last + step * k) % columns
            across = edge.across(directions[c])
            is_sealed = not edge.sure and sealed[c] * across > edge.rho + clear
            if taken[c] or across <= ACROSS or is_sealed:
                break
            far = not edge.aligned and abs(edge.along(directions[c]) - start) > farthest
            _, resumes = floor_behind(edge, c, floor, directions, clear)
            if (far and k > _DRAWN_ON_COLUMNS) or resumes < edge.rho + clear + _RESUMED:
                break
            side.append(c)
    return drawn


def floor_behind(edge, column, floor, directions, clear):
    """Returns of floor behind an edge in a column and its two neighbours: how many, how near.

    The distance is that across the edge, as its own.
    """
    count, nearest = 0, math.inf
    for c in (column - 1, column, column + 1):
        across = edge.across(directions[c % len(directions)])
        if across > 0.0:
            more, planar = floor.beyond(c, (edge.rho + clear) / across)
            count, nearest = count + more, min(nearest, planar * across)
    return count, nearest
