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

from .drop_edges import ACROSS, DropTolerances, drawn_on, find_edges, floor_behind
from .wall_feet import sealed_floor, steadily

_NEIGHBORS = 2  # columns to either side that share what they see
_WITNESSES = 2  # returns that make a drop; if there is none in a scan, one does
_WIDEST_GAP = 12  # columns between two that see a drop, which then see it too
_FLOOR_AGAIN = 3  # measured returns of floor beyond a drop
_CLOSE = 1.0  # floor measured so near before an edge goes on up to it [m]
_SINGLE_COLUMNS = 9  # that see a drop, though each by one return, make an edge beyond doubt
_MIRROR = 0.15  # floor so near beyond a crossing: there is no drop [m]
_FAR_EDGE = 0.03  # and begins so far behind the first return beyond a drop [m]
_BEYOND_EDGE = 0.3  # floor measured so far beyond an edge shows that the drop ended [m]
_NARROWEST = 0.5  # or so near to the wall that there is no room for one [m]
_WIDEST_SPREAD = 225  # columns to either side of a drop without an edge that may belong to it
_SPREAD_PAST_EDGE = 40  # and beyond the last ones of an edge


@dataclass(frozen=True)
class DropOffs:
    """Per column, planar ranges [m]; the floor between `begin` and `end` is not to be claimed.

    Attributes
    ----------
    begin, end : (columns,) float64
        Both infinite where no drop is seen; `end` infinite where no floor is measured beyond.
    floor_to : (columns,) float64
        How far there is floor for certain because a straight edge ends it; 0 where none does.
    is_doubted : (columns,) bool
        Past the end of an edge in doubt, where another one that may stand for it is drawn on but
        tells of no floor: the drop may as well go on sideways.
    """

    begin: np.ndarray
    end: np.ndarray
    floor_to: np.ndarray
    is_doubted: np.ndarray

    def hides(self, column, planar):
        """Does a place (N,) lie over a drop, or beyond one without floor measured again?"""
        return (planar > self.begin[column]) & (planar < self.end[column])


def find_drop_offs(
    column,
    planar,
    height,
    is_floor,
    sensor_height,
    directions,
    walls=(),
    feet=None,
    tolerances=None,
):
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
    feet : WallFeet, optional
        Of the room's walls: where nothing is seen below them, no drop reaches them.
    tolerances : DropTolerances, optional
    """
    columns, tolerances = len(directions), tolerances or DropTolerances()
    below = tolerances.is_below(planar, height, sensor_height)
    crossing = planar[below] * (sensor_height / (sensor_height - height[below]))
    floor = _Floor(column[is_floor], planar[is_floor], columns)
    falls = ~_is_mirrored(column[below], crossing, floor)
    below[below], crossing = falls, crossing[falls]
    begin, end = np.full(columns, np.inf), np.full(columns, np.inf)
    floor_to = np.zeros(columns)
    if not below.any():
        return DropOffs(begin, end, floor_to, np.zeros(columns, bool))
    own = np.full(columns, np.inf)
    np.minimum.at(own, column[below], crossing)
    sealed = np.zeros(columns)
    if feet is not None:
        sealed = sealed_floor(feet, np.isfinite(own), sensor_height)
    own = np.minimum(own, np.minimum(np.roll(own, 1), np.roll(own, -1)))
    witnessed = _witnessed(column[below], crossing, columns, _WITNESSES)
    if not np.isfinite(witnessed[0]).any():
        witnessed = _witnessed(column[below], crossing, columns, 1)
    first, last = _joined(*witnessed)
    _single_columns(first, last, floor, begin, end, tolerances)
    seen = _Seen(own, first, floor, steadily(sealed), tolerances)
    alone, known, ends, is_doubted = _along_edges(seen, directions, walls, begin, end, floor_to)
    farthest = np.maximum(floor.farthest(), sealed)
    no_room = np.full(columns, np.inf)
    if feet is not None:
        no_room = np.where(feet.distance > 0.0, feet.distance - _NARROWEST, np.inf)
    place = begin.copy() if ends.any() else seen.nearest
    room = farthest, place, no_room, tolerances.edge
    _spread(begin, known, alone, _WIDEST_SPREAD, *room)
    _spread(begin, known, ends, _SPREAD_PAST_EDGE, *room)
    return DropOffs(begin, end, floor_to, is_doubted)


def _is_mirrored(column, crossing, floor):
    """Which returns (N,) from below only seem to have fallen through: where floor is measured to
    either side, and on, a glossy floor has mirrored what stands on it."""
    return np.array(
        [
            all(
                any(
                    floor.beyond(c + side * k, place)[1] < place + _MIRROR
                    for k in range(_NEIGHBORS + 1)
                )
                for side in (-1, 1)
            )
            for c, place in zip(column, crossing)
        ],
        bool,
    )


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


def _witnessed(column, crossing, columns, witnesses):
    """Nearest and farthest crossing of each column and its neighbours that so many returns show."""
    order = np.lexsort((crossing, column))
    column, crossing = column[order], crossing[order]
    begin = np.searchsorted(column, np.arange(columns + 1))
    first, last = np.full(columns, np.inf), np.full(columns, -np.inf)
    for c in range(columns):
        around = [(c + k) % columns for k in range(-_NEIGHBORS, _NEIGHBORS + 1)]
        near = np.sort(np.concatenate([crossing[begin[k] : begin[k + 1]] for k in around]))
        if len(near) >= witnesses:
            first[c], last[c] = near[witnesses - 1], near[-witnesses]
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


def _single_columns(first, last, floor, begin, end, tolerances):
    """Begin and end of the drop in each column that sees one, with its neighbours."""
    for c in np.flatnonzero(np.isfinite(first)):
        around = range(c - _NEIGHBORS, c + _NEIGHBORS + 1)
        before = max(floor.last_before(k, first[c]) for k in around)
        begin[c] = max(0.0, before - tolerances.edge)
        beyond = [floor.beyond(k, last[c]) for k in around]
        if sum(count for count, _ in beyond) >= _FLOOR_AGAIN:
            end[c] = min(nearest for _, nearest in beyond) + _FAR_EDGE
    # An edge that runs aslant lies farther in the column itself than in some beside it.
    known = np.isfinite(end)
    again = np.where(known, end, 0.0)
    shifts = range(-_NEIGHBORS, _NEIGHBORS + 1)
    end[known] = np.max([np.roll(again, k) for k in shifts], axis=0)[known]


class _Seen:
    """What the columns show, all (columns,).

    Attributes
    ----------
    after : float64
        Nearest crossing of a beam that fell through; columns share it with those beside them [m].
    nearest : float64
        The same with what the columns between some that see a drop share with these [m].
    before : float64
        The last floor before it [m].
    witnessed : bool
        Is a drop seen by more than one return?
    falls : bool
        ... or the columns lie between some that see one?
    floor : _Floor
    sealed : float64
        How far no drop reaches the wall [m].
    tolerances : DropTolerances
    """

    def __init__(self, own, first, floor, sealed, tolerances):
        self.after, self.falls = own, np.isfinite(first)
        self.witnessed = np.isfinite(own) & self.falls
        self.nearest = np.minimum(own, first)
        before = np.array([floor.last_around(c, self.nearest[c]) for c in range(len(own))])
        self.before = np.where(self.witnessed, before, np.maximum(before, sealed))
        self.floor, self.sealed, self.tolerances = floor, sealed, tolerances

    def edges(self, directions, walls):
        """The edges that several returns show, or else one that single ones do beyond doubt."""
        seen, known = (self.before, self.after), (directions, walls, self.tolerances.place)
        found = find_edges(*seen, self.witnessed, *known)
        single = np.isfinite(self.after)
        if np.count_nonzero(single) < _SINGLE_COLUMNS or any(edge.sure for edge, _ in found):
            return found
        more = find_edges(*seen, single, *known)
        return more if any(edge.sure for edge, _ in more) else found


def _along_edges(seen, directions, walls, begin, end, floor_to):
    """Begin at straight edges where they explain what is seen.

    Returns four maps of columns: those of a drop that no edge explains, all of which a drop is
    known, the last ones of edges, and DropOffs.is_doubted.
    """
    columns, clear = len(seen.after), seen.tolerances.clear
    edges = seen.edges(directions, walls)
    spans = [(edge.first + np.arange(edge.count)) % columns for edge, _ in edges]
    taken, ends = np.zeros(columns, bool), np.zeros(columns, bool)
    for span in spans:
        taken[span] = True
    explained = taken.copy()
    drawn_in_doubt, past_ends = np.zeros(columns, bool), []
    for (edge, drop), span in zip(edges, spans):
        drawn = drawn_on(edge, taken, seen.floor, seen.sealed, directions, clear)
        rho = _place(edge, drop, span, drawn, seen, directions, begin)
        if edge.aligned:
            told = _told(edge, span, drawn, seen, directions)
            doubts = [] if edge.sure else [e for e, _ in edges if e.in_doubt and e is not edge]
            _tell(edge, rho, told, doubts, directions, floor_to)
        for side, last, step in zip(drawn, (span[0], span[-1]), (-1, 1)):
            last = side[-1] if side else last
            ends[last] = True
            if edge.in_doubt:
                drawn_in_doubt[side] = True
                past_ends.append((last, step))
            for c in side:
                count, resumes = floor_behind(edge, c, seen.floor, directions, clear)
                if not seen.falls[c] and count >= _FLOOR_AGAIN:
                    end[c] = resumes / edge.across(directions[c]) + _FAR_EDGE
                explained[c] = True
    alone = seen.falls & ~explained
    is_doubted = _past_ends(past_ends, drawn_in_doubt & (floor_to == 0.0))
    return alone, alone | explained, ends, is_doubted


def _past_ends(ends, untold):
    """Columns from the ends of edges, (column, step) each, on, as long as they are `untold`."""
    found = np.zeros(len(untold), bool)
    for last, step in ends:
        at = (last + step) % len(untold)
        while untold[at] and not found[at]:
            found[at] = True
            at = (at + step) % len(untold)
    return found


def _place(edge, drop, spanned, drawn, seen, directions, begin):
    """Ends the floor where the farthest floor before an edge was measured: that distance."""
    at = np.concatenate([spanned, drawn[0], drawn[1]]).astype(np.int64)
    across = edge.across(directions[at])
    floor = seen.before[at] * across
    nearest = floor[floor <= edge.rho + seen.tolerances.place].max()
    rho = min(nearest, 0.5 * (nearest + drop) - seen.tolerances.edge)
    begin[at] = rho / across if edge.sure else np.minimum(begin[at], rho / across)
    return rho


def _told(edge, spanned, drawn, seen, directions):
    """Columns in which floor goes on up to an edge though it is not measured.

    From those that see the drop to the last ones that measure floor close to the edge.
    """
    told = list(spanned)
    for side in drawn:
        close = [k for k, c in enumerate(side) if _is_close(edge, seen, c, directions[c])]
        told += side[: close[-1] + 1] if close else []
    return told


def _tell(edge, rho, told, doubts, directions, floor_to):
    """Floor up to an edge, in doubt no farther than up to the others that may stand for it."""
    for c in told:
        reach = rho / edge.across(directions[c])
        for other in doubts:
            across = other.across(directions[c])
            if across > ACROSS:
                reach = min(reach, other.rho / across)
        in_doubt = not edge.sure and floor_to[c] > 0.0
        floor_to[c] = min(floor_to[c], reach) if in_doubt else reach


def _is_close(edge, seen, column, direction):
    across, before = edge.across(direction), seen.before[column]
    passed = before * across >= edge.rho + seen.tolerances.place
    return edge.rho / across - _CLOSE < before and not passed


def _spread(begin, known, starts, widest, farthest, place, no_room, before_edge):
    """A drop goes on sideways until floor is measured well beyond it: where it ends is not seen.

    Beyond the `place` where it is seen (columns,), that is: nearer floor only goes on up to there.
    Where a wall stands nearer, or leaves `no_room` (columns,) behind the floor, it ends as well.
    """
    for step in (1, -1):
        for c in np.flatnonzero(starts):
            edge = begin[c]
            for k in range(1, widest + 1):
                at = (c + step * k) % len(begin)
                past = edge + _BEYOND_EDGE
                if k <= _SPREAD_PAST_EDGE:
                    past = max(past, min(place[c] + _BEYOND_EDGE, no_room[at]))
                if known[at] or farthest[at] > past:
                    break
                edge = max(edge, farthest[at] - before_edge)
                begin[at] = min(begin[at], edge)
