"""Where the floor ends at a drop: a pit, a ledge, stairs that descend.

A return from below the floor proves that its beam met no floor where it crossed the floor's plane.
The floor ends before the first such crossing of a column and goes on only where it is measured
again beyond the last. Edges are straight more often than not: a line that runs between the last
measured floor and the first crossing of many columns tells where the floor ends in all of them,
and in the columns among them that show neither. Not in the thesis.
"""

import math
from dataclasses import dataclass

import numpy as np

_DEPTH, _DEPTH_SLOPE = 0.04, 0.015  # a return so far below the floor is none of it [m], and per m
_NEIGHBORS = 2  # columns to either side that share what they see
_WITNESSES = 2  # returns that make a drop
_WIDEST_GAP = 12  # columns between two that see a drop, which then see it too
_FLOOR_AGAIN = 3  # measured returns of floor beyond a drop
_EDGE = 0.02  # measured floor ends this far before the edge for certain [m]
_FAR_EDGE = 0.03  # and begins so far behind the first return beyond a drop [m]
_BEYOND_EDGE = 0.3  # floor measured so far beyond an edge shows that the drop ended [m]
_WIDEST_SPREAD = 25  # columns to either side of a drop that may belong to it

_ANGLES = 180  # of an edge's normal, coarse search
_FINE_ANGLES, _FINE_STEP_DEG = 10, 0.2  # to either side of the best one
_SLOT = 0.01  # of an edge's distance from the sensor [m]
_FARTHEST = 12.0  # [m]
_TOLERANCE = 0.03  # of a return's place against an edge [m]
_MARGIN_WORTH, _MOST_MARGIN = 2.0, 0.5  # columns that a metre of room between floor and drop is
# worth, and the room [m] that is worth no more
_ALIGNED_SHARE = 0.4  # of the columns of the best edge make one along or across a wall the better
_ACROSS = 0.15  # least cosine between a column and the normal of an edge
_EDGE_COLUMNS = 6  # that make an edge
_MOST_EDGES = 6
_LIKE_NORMALS = 0.9  # cosine between normals of what is one line
_DOUBT_SHARE = 0.8  # of the columns of an edge make another one as likely
_PASSED = 0.1  # floor measured so far beyond an edge shows that it does not go on there [m]
_RESUMED = 0.15  # and floor so near behind it, that it ended before [m]
_PASSED_COLUMNS = 2
_WIDEST_SPAN = 90.0  # between two columns of one edge [deg]
_CLEAR = _EDGE + _TOLERANCE  # measured floor lies behind an edge if it is so far behind it [m]
_CLOSE = 0.3  # and tells where the edge is if it is so near before it [m]
_DRAWN_ON, _DRAWN_ON_SHARE = 0.3, 0.5  # beyond its seen ends: metres, and of its seen length


@dataclass(frozen=True)
class DropOffs:
    """Per column, planar ranges [m]; the floor between `begin` and `end` is not to be claimed.

    Attributes
    ----------
    begin, end : (columns,) float64
        Both infinite where no drop is seen; `end` infinite where no floor is measured beyond.
    floor_to : (columns,) float64
        How far there is floor for certain because a straight edge ends it; 0 where none does.
    """

    begin: np.ndarray
    end: np.ndarray
    floor_to: np.ndarray

    def hides(self, column, planar):
        """Does a place (N,) lie over a drop, or beyond one without floor measured again?"""
        return (planar > self.begin[column]) & (planar < self.end[column])


def find_drop_offs(column, planar, height, is_floor, sensor_height, directions, walls=()):
    """Drops of all columns.

    Parameters
    ----------
    column, planar, height : (N,)
        Azimuth column, planar range and height above the floor of each return [m].
    is_floor : (N,) bool
        Measured floor; feet of walls must not be among it.
    sensor_height : float
        Height of the sensor above the floor [m].
    directions : (columns, 2) float64
        Cosine and sine of the columns' middles.
    walls : (W, 2) float64
        Normals of the room's walls: edges along or across them are preferred, and only these tell
        of floor that was not measured.
    """
    columns = len(directions)
    below = height < -(_DEPTH + _DEPTH_SLOPE * planar)
    crossing = planar[below] * (sensor_height / (sensor_height - height[below]))
    floor = _Floor(column[is_floor], planar[is_floor], columns)
    begin, end = np.full(columns, np.inf), np.full(columns, np.inf)
    floor_to = np.zeros(columns)
    if not below.any():
        return DropOffs(begin, end, floor_to)
    own = np.full(columns, np.inf)
    np.minimum.at(own, column[below], crossing)
    own = np.minimum(own, np.minimum(np.roll(own, 1), np.roll(own, -1)))
    first, last = _joined(*_witnessed(column[below], crossing, columns))
    _single_columns(first, last, floor, begin, end)
    alone = _along_edges(own, first, floor, directions, walls, begin, end, floor_to)
    _spread(begin, alone, floor.farthest())
    return DropOffs(begin, end, floor_to)


class _Floor:
    """Measured floor by column, nearest first."""

    def __init__(self, column, planar, columns):
        order = np.lexsort((planar, column))
        self.columns = columns
        self._planar = planar[order]
        self._begin = np.searchsorted(column[order], np.arange(columns + 1))

    def of(self, column):
        """Planar ranges in a column, ascending."""
        column %= self.columns
        return self._planar[self._begin[column] : self._begin[column + 1]]

    def last_before(self, column, distance):
        """The farthest floor of a column nearer than a distance; 0 where there is none."""
        ranges = self.of(column)
        at = np.searchsorted(ranges, distance)
        return float(ranges[at - 1]) if at > 0 else 0.0

    def beyond(self, column, distance):
        """How many returns of a column lie beyond a distance, and the nearest of them."""
        ranges = self.of(column)
        at = np.searchsorted(ranges, distance, "right")
        return len(ranges) - at, float(ranges[at]) if at < len(ranges) else math.inf

    def last_around(self, column, distance):
        """The same of a column and its two neighbours: not all rings fire in each column."""
        return max(self.last_before(column + k, distance) for k in (-1, 0, 1))

    def farthest(self):
        """How far floor is measured in each column and its neighbours [m]."""
        own = np.array([self.last_before(c, math.inf) for c in range(self.columns)])
        return np.max([np.roll(own, k) for k in range(-_NEIGHBORS, _NEIGHBORS + 1)], axis=0)


def _witnessed(column, crossing, columns):
    """Second nearest and second farthest crossing of each column and its neighbours."""
    order = np.lexsort((crossing, column))
    column, crossing = column[order], crossing[order]
    begin = np.searchsorted(column, np.arange(columns + 1))
    first, last = np.full(columns, np.inf), np.full(columns, -np.inf)
    for c in range(columns):
        around = [(c + k) % columns for k in range(-_NEIGHBORS, _NEIGHBORS + 1)]
        near = np.sort(np.concatenate([crossing[begin[k] : begin[k + 1]] for k in around]))
        if len(near) >= _WITNESSES:
            first[c], last[c] = near[_WITNESSES - 1], near[-_WITNESSES]
    return first, np.maximum(first, last)


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


def _single_columns(first, last, floor, begin, end):
    """Begin and end of the drop in each column that sees one, with its neighbours."""
    for c in np.flatnonzero(np.isfinite(first)):
        around = range(c - _NEIGHBORS, c + _NEIGHBORS + 1)
        before = max(floor.last_before(k, first[c]) for k in around)
        begin[c] = max(0.0, before - _EDGE)
        beyond = [floor.beyond(k, last[c]) for k in around]
        if sum(count for count, _ in beyond) >= _FLOOR_AGAIN:
            end[c] = min(nearest for _, nearest in beyond) + _FAR_EDGE
    # An edge that runs aslant lies farther in the column itself than in some beside it.
    known = np.isfinite(end)
    again = np.where(known, end, 0.0)
    shifts = range(-_NEIGHBORS, _NEIGHBORS + 1)
    end[known] = np.max([np.roll(again, k) for k in shifts], axis=0)[known]


@dataclass(frozen=True)
class _Edge:
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

    def across(self, directions):
        """Cosine between directions (..., 2) and the normal."""
        return self.nx * directions[..., 0] + self.ny * directions[..., 1]

    def along(self, direction):
        """Place along the edge where it meets a direction [m]."""
        sideways = self.nx * direction[1] - self.ny * direction[0]
        return self.rho * sideways / self.across(direction)


def _along_edges(own, first, floor, directions, walls, begin, end, floor_to):
    """Begin at straight edges where they explain what is seen; the columns that none explains."""
    columns = len(own)
    sees = np.isfinite(own) & np.isfinite(first)
    before = np.array([floor.last_around(c, min(own[c], first[c])) for c in range(columns)])
    edges = _find_edges(before, own, sees, directions, walls)
    taken = np.zeros(columns, bool)
    for edge, _ in edges:
        taken[(edge.first + np.arange(edge.count)) % columns] = True
    explained = taken.copy()
    for edge, drop in edges:
        spanned = (edge.first + np.arange(edge.count)) % columns
        drawn = _drawn_on(edge, taken, floor, directions)
        _place(edge, drop, spanned, drawn, before, directions, begin, floor_to)
        for c in drawn[0] + drawn[1]:
            count, resumes = _floor_behind(edge, c, floor, directions)
            if not np.isfinite(first[c]) and count >= _FLOOR_AGAIN:
                end[c] = resumes / edge.across(directions[c]) + _FAR_EDGE
            explained[c] = True
    return np.isfinite(first) & ~explained


def _find_edges(before, after, sees, directions, walls):
    """The edges, each as far as it is seen, and where the drop behind it begins for certain."""
    left, edges = sees.copy(), []
    for _ in range(_MOST_EDGES):
        found = _strongest_edge(before, after, left, directions, walls)
        if found is None:
            break
        explained, run = _longest_run(found[:3], before, after, left, sees, directions)
        left &= ~explained
        if run is not None:
            edge = _Edge(*found, *run)
            edges.append((edge, float((after * edge.across(directions))[explained].min())))
    return edges


def _place(edge, drop, spanned, drawn, before, directions, begin, floor_to):
    """Ends the floor where the farthest floor before an edge was measured.

    Floor that was not measured is told of where the edge runs along or across a wall, from the
    columns that see the drop to those that measure floor close to the edge.
    """
    at = np.concatenate([spanned, drawn[0], drawn[1]]).astype(np.int64)
    across = edge.across(directions[at])
    floor = before[at] * across
    nearest = floor[floor <= edge.rho + _TOLERANCE].max()
    rho = min(nearest, 0.5 * (nearest + drop) - _EDGE)
    begin[at] = rho / across if edge.sure else np.minimum(begin[at], rho / across)
    if edge.sure:
        told = list(spanned)
        for side in drawn:
            close = [k for k, c in enumerate(side) if _is_close(edge, before[c], directions[c])]
            told += side[: close[-1] + 1] if close else []
        floor_to[told] = rho / edge.across(directions[told])


def _is_close(edge, before, direction):
    across = edge.across(direction)
    return edge.rho - _CLOSE < before * across < edge.rho + _TOLERANCE


def _strongest_edge(before, after, use, directions, walls):
    """The line that lies between floor and drop in most columns, with most room.

    Its normal, its distance, whether it runs along or across a wall, and whether it does so beyond
    doubt; None where no line lies there in enough columns.
    """
    use = np.flatnonzero(use)
    if len(use) < _EDGE_COLUMNS:
        return None
    columns = before[use], after[use], directions[use]
    free = _best(columns, [_normal(360.0 / _ANGLES * k) for k in range(_ANGLES)])
    angle = math.degrees(math.atan2(free.ny, free.nx))
    fine = range(-_FINE_ANGLES, _FINE_ANGLES + 1)
    free = _best(columns, [_normal(angle + _FINE_STEP_DEG * k) for k in fine])
    aligned = _candidates(columns, _along_and_across(walls))
    best = _first_best(aligned)
    if best is not None and best.columns >= max(_EDGE_COLUMNS, _ALIGNED_SHARE * free.columns):
        others = [one for one in aligned if one.nx * best.nx + one.ny * best.ny < _LIKE_NORMALS]
        doubt = any(one.columns > _DOUBT_SHARE * best.columns for one in others)
        return best.nx, best.ny, best.rho, True, not doubt
    return (free.nx, free.ny, free.rho, False, False) if free.columns >= _EDGE_COLUMNS else None


def _along_and_across(walls):
    return [normal for x, y in walls for normal in ((x, y), (-y, x), (-x, -y), (y, -x))]


def _normal(angle_deg):
    angle = math.radians(angle_deg)
    return float(np.float32(math.cos(angle))), float(np.float32(math.sin(angle)))


@dataclass(frozen=True)
class _Candidate:
    """A line, the columns that agree on it, and its score."""

    nx: float
    ny: float
    rho: float
    columns: int
    score: float


def _best(columns, normals):
    return _first_best(_candidates(columns, normals))


def _candidates(columns, normals):
    return [_candidate(*columns, *normal) for normal in normals]


def _first_best(candidates):
    """The first of highest score."""
    return max(candidates, key=lambda one: one.score, default=None)


def _candidate(before, after, directions, nx, ny):
    """The line with a normal that most columns agree on, just before the drop begins."""
    across = nx * directions[:, 0] + ny * directions[:, 1]
    facing = across > _ACROSS
    slots = int(_FARTHEST / _SLOT)
    low = _slot((before * across)[facing] - _TOLERANCE, slots)
    high = _slot((after * across)[facing] + _TOLERANCE, slots) + 1
    change = np.bincount(low, minlength=slots + 2) - np.bincount(high, minlength=slots + 2)
    agree = np.cumsum(change)[:slots]
    count = int(agree.max())
    room = np.flatnonzero(agree == count)
    margin = min(_SLOT * len(room), _MOST_MARGIN)
    rho = room[-1] * _SLOT - _TOLERANCE
    return _Candidate(nx, ny, rho, count, count + _MARGIN_WORTH * margin)


def _slot(distance, slots):
    return np.clip(np.floor(distance / _SLOT), 0, slots).astype(np.int64)


def _between(before, after, across, rho):
    """Columns that see floor before a line and the drop behind it."""
    with np.errstate(invalid="ignore"):
        agrees = (before * across <= rho + _TOLERANCE) & (after * across >= rho - _TOLERANCE)
    return agrees & (across > _ACROSS)


def _longest_run(edge, before, after, left, sees, directions):
    """Columns an edge explains, and (first, count) of the longest run of them, None if short.

    A run breaks where floor is measured beyond the edge, where columns that see a drop do not
    agree, and where the edge is not seen for too long.
    """
    nx, ny, rho = edge
    columns = len(before)
    across = nx * directions[:, 0] + ny * directions[:, 1]
    facing = across > _ACROSS
    agrees = _between(before, after, across, rho)
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


def _drawn_on(edge, taken, floor, directions):
    """Columns (two lists) into which an edge goes on beyond its ends, until floor is measured
    right behind it.
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
            if taken[c] or across <= _ACROSS:
                break
            far = not edge.aligned and abs(edge.along(directions[c]) - start) > farthest
            _, resumes = _floor_behind(edge, c, floor, directions)
            if (far and k > _WIDEST_SPREAD) or resumes < edge.rho + _CLEAR + _RESUMED:
                break
            side.append(c)
    return drawn


def _floor_behind(edge, column, floor, directions):
    """Returns of floor behind an edge in a column and its two neighbours: how many, how near.

    The distance is that across the edge, as its own.
    """
    count, nearest = 0, math.inf
    for c in (column - 1, column, column + 1):
        across = edge.across(directions[c % len(directions)])
        if across > 0.0:
            more, planar = floor.beyond(c, (edge.rho + _CLEAR) / across)
            count, nearest = count + more, min(nearest, planar * across)
    return count, nearest


def _spread(begin, seen, farthest):
    """A drop without an edge goes on sideways until floor is measured well beyond it."""
    for step in (1, -1):
        for c in np.flatnonzero(seen):
            edge = begin[c]
            for k in range(1, _WIDEST_SPREAD + 1):
                at = (c + step * k) % len(begin)
                if seen[at] or farthest[at] > edge + _BEYOND_EDGE:
                    break
                edge = max(edge, farthest[at] - _EDGE)
                begin[at] = min(begin[at], edge)
