"""The room's boundary per azimuth column, from what smoke leaves of the walls.

Thesis: Algorithm 5 takes one least distance per 10 deg segment; here every column of 0.4 deg has
its own boundary. Vertical posts are found in each column (`posts`), straight walls through posts
(`wall_lines`); the nearest wall that reaches the ceiling bounds the floor (furniture does not),
gaps are bridged along walls seen on both sides and up to the corner where two of them meet.
"""

import math
from dataclasses import dataclass

import numpy as np

from .posts import on_line_for, widening_for
from .wall_lines import BREAK, LINE_HALF, runs

_SEEN, _INFERRED, _LIMIT = 0, 1, 2
_STRONG_POST = 6  # returns of a post that bounds the floor without being part of a line
_BEYOND = 0.25  # returns this far beyond a bridge tear it down [m]
_TORN = 0.1  # in this share of its columns
_WIDEST_GAP = 0.25  # that is bridged along one wall, of the circle
_MEETING = 0.05  # [m]
_CHAIN_STEP = 0.04  # from post to post of a chain [m]
_CHAIN_SLOPE = 0.012  # ... and per metre of range: a wall at 60 deg to the beam
_CROSSING = 0.06  # lines so near to each other in a column cross there [m]
_CURVE_COLUMNS = 3  # to either side, in which posts behind a line show that the wall curves
_LONG = 0.8  # a wall so long is bridged though its top is not seen [m]
_OVER_FURNITURE = 2.1  # people, cupboards and doors are lower [m]
_SQUARE = 0.17  # cosine between the normals of walls that meet at right angles, at most
_ASKEW = 0.5  # any others are drawn on by so much of what those are
_FARTHEST_CORNER = 1.6  # times the farther of the two places where its walls were seen last


@dataclass(frozen=True)
class Profile:
    """The boundary per column.

    Attributes
    ----------
    distance : (columns,) float64
        Planar range of the boundary [m]; 0 where none is known.
    kind : (columns,) int64
        0 wall seen, 1 wall inferred, 2 limit of knowledge.
    line : (columns,) int64
        Index of the wall; -1 where none.
    """

    distance: np.ndarray
    kind: np.ndarray
    line: np.ndarray


def column_profile(
    posts, support, view, beyond, level_floor, directions, max_bridge_ratio, spread=0.0
):
    """The boundary of each column.

    Parameters
    ----------
    posts : Posts
    support : Support
    view : View
    beyond : (columns,) float64
        How far floor or ceiling was measured in each column [m]: no wall stands nearer, unless
        it is seen.
    level_floor : (columns,) float64
        How far floor was measured that goes on as level as the room's [m].
    directions : (columns, 2) float64
        Of the columns' middles.
    max_bridge_ratio : float
        A wall is drawn on to a corner at most so many times its seen length.
    spread : float
        How far walls' returns stray, as by spread_of_walls() [m].
    """
    columns, widening = len(beyond), widening_for(spread)
    distance, kind = np.zeros(columns), np.full(columns, _LIMIT)
    line = np.full(columns, -1)
    if len(support.reach) > 0:
        reach = np.where(support.full, support.reach, np.inf)
        nearest = reach.argmin(axis=0)
        known = np.isfinite(reach.min(axis=0))
        distance[known], kind[known] = reach.min(axis=0)[known], _SEEN
        line[known] = nearest[known]
    _add_full_posts(posts, view, distance, kind, widening)
    outermost = _outermost(posts, support, columns, widening, on_line_for(spread))
    beyond = np.maximum(beyond, outermost)
    _follow(outermost, distance, kind, widening)
    tall = _tall_posts(posts, view, columns)
    _bridge(support, distance, kind, line, beyond, tall, directions, max_bridge_ratio, widening)
    rest = (distance == 0.0) & (outermost > 0.0)
    # A lone column is a look through a crack: no place to claim floor in.
    rest &= _like_neighbors(np.where(distance > 0.0, distance, outermost), widening) >= 2
    distance[rest], kind[rest] = outermost[rest], _SEEN
    _take_lines(support, distance, line, rest, directions, widening)
    _close_openings(support, view, level_floor, distance, kind, line)
    _bridge(support, distance, kind, line, beyond, tall, directions, max_bridge_ratio, widening)
    return Profile(distance, kind, line)


def _close_openings(support, view, level_floor, distance, kind, line):
    """Walls go on across openings whose upper edge lies out of view.

    Where the ceiling is in view a lintel shows, or shows to be missing. Where it is not, a wall
    farther away between two stretches of one line is seen through a door or a window: floor goes
    on to it only if some is measured there. Desks in line, lower than the view, are no such wall.
    """
    columns = len(distance)
    for number in np.unique(line[line >= 0]):
        if not support.tall[number]:
            continue
        stretches = runs(line == number)
        for before, after in zip(stretches, stretches[1:] + stretches[:1]):
            gap = (before[-1] + 1 + np.arange((after[0] - before[-1] - 1) % columns)) % columns
            reach = support.reach[number, gap]
            if not 0 < len(gap) <= _WIDEST_GAP * columns or view.tells(reach).any():
                continue
            if _is_torn(level_floor[gap], reach):
                continue
            farther = distance[gap] > reach
            gap, reach = gap[farther], reach[farther]
            distance[gap], kind[gap], line[gap] = reach, _INFERRED, number


def _take_lines(support, distance, line, columns, directions, widening):
    """Walls of which no top is seen, long enough to be bridged along."""
    if len(support.reach) == 0:
        return
    on = support.seen & (np.abs(support.reach - distance) < LINE_HALF * widening) & columns
    for number in range(len(on)):
        reach = support.reach[number]
        length = 0.0
        for run in runs(on[number]):
            length += _chord(reach, run[0], run[-1], directions)
        if length > _LONG:
            line[on[number]] = number


def _add_full_posts(posts, view, distance, kind, widening):
    """Walls that no straight line fits: posts up to the ceiling, with like neighbours."""
    full = view.is_full(posts.high, posts.distance) & view.tells(posts.distance)
    full &= posts.count >= _STRONG_POST
    nearest = np.full(len(distance), np.inf)
    np.minimum.at(nearest, posts.column[full], posts.distance[full])
    add = (distance == 0.0) & np.isfinite(nearest) & (_like_neighbors(nearest, widening) >= 3)
    distance[add], kind[add] = nearest[add], _SEEN


def _tall_posts(posts, view, columns):
    """Where what reaches out of the view, higher than furniture, begins in each column [m]."""
    tall = np.full(columns, np.inf)
    is_tall = view.is_full(posts.high, posts.distance) & (posts.high > _OVER_FURNITURE)
    is_tall &= posts.count >= _STRONG_POST
    np.minimum.at(tall, posts.column[is_tall], posts.distance[is_tall])
    return tall


def _like_neighbors(distance, widening):
    """How many of the three columns to either side go on at about a column's distance."""
    like = np.zeros(len(distance), int)
    with np.errstate(invalid="ignore"):
        for shift in (-3, -2, -1, 1, 2, 3):
            step = np.abs(np.roll(distance, shift) - distance)
            like += step < (0.05 * widening + 0.03 * distance) * abs(shift)
    return like


def _outermost(posts, support, columns, widening, on_line):
    """The farthest vertical structure of each column; 0 where there is none.

    A line knows better than the few returns of one column how far its wall is, unless the wall
    curves away behind it, in the columns beside, too. Of lines that cross there the nearest bounds
    the floor: in a corner it is the wall, elsewhere one of them only touches it.
    """
    farthest = np.zeros(columns)
    strong = posts.count >= _STRONG_POST
    np.maximum.at(farthest, posts.column[strong], posts.distance[strong])
    if len(support.reach) == 0:
        return farthest
    farthest_line = np.where(support.seen, support.reach, 0.0).max(axis=0)
    crosses = support.seen & (support.reach > farthest_line - _CROSSING * widening)
    wall = np.where(crosses, support.reach, np.inf).min(axis=0)
    wall[~crosses.any(axis=0)] = 0.0
    behind = farthest > wall
    shifts = range(-_CURVE_COLUMNS, _CURVE_COLUMNS + 1)
    curves = np.all([np.roll(behind, k) for k in shifts], axis=0)
    return np.where(curves | (farthest > wall + on_line), farthest, wall)


def _follow(outermost, distance, kind, widening):
    """Close gaps between known walls along a chain of posts that leads from one to the other.

    A curved wall of which the top is hidden, mostly: furniture stands before the walls' ends.
    """
    columns = len(distance)
    known = np.flatnonzero(distance > 0.0)
    for first, after in zip(known, np.roll(known, -1)):
        gap = (first + 1 + np.arange((after - first - 1) % columns)) % columns
        posts = gap[outermost[gap] > 0.0]
        if len(gap) == 0 or len(posts) == 0:
            continue
        chain = np.r_[first, posts, after]
        planar = np.r_[distance[first], outermost[posts], distance[after]]
        turn = (np.diff(chain) - 1) % columns + 1
        nearer = np.minimum(planar[1:], planar[:-1])
        step = (_CHAIN_STEP * widening + _CHAIN_SLOPE * nearer) * turn
        if turn.max() > BREAK or np.any(np.abs(np.diff(planar)) > step):
            continue
        place = np.r_[0, np.cumsum(turn)]
        at = 1 + np.arange(len(gap))
        link = np.searchsorted(place, at, "right") - 1
        slope = np.diff(planar) / turn
        distance[gap] = slope[link] * (at - place[link]) + planar[link]
        kind[gap] = np.where(outermost[gap] > 0.0, _SEEN, _INFERRED)


def _bridge(support, distance, kind, line, beyond, tall, directions, max_ratio, widening):
    """Bridge the gaps between known walls, along one wall or round the corner of two.

    Along one wall nothing but a wall on both sides is asked for: the floor ends at the line of a
    wall whether a door in it is open or not. A corner must lie in the gap, no farther along either
    wall than it was seen to be long, and no floor, ceiling or wall may be seen beyond it, nor may
    anything before it be higher than furniture. Walls that do not meet at right angles may as well
    be chords of a round one, and are drawn on by less.
    """
    columns = len(distance)
    known = np.flatnonzero(line >= 0)
    widest, meeting = _WIDEST_GAP * columns, _MEETING * widening
    for first, after in zip(known, np.roll(known, -1)):
        between = (first + 1 + np.arange((after - first - 1) % columns)) % columns
        gap = between[distance[between] == 0.0]
        if not 0 < len(gap) <= widest:
            continue
        a, b = support.reach[line[first]], support.reach[line[after]]
        bridge = np.minimum(a[gap], b[gap])
        if bridge.max() > _FARTHEST_CORNER * max(distance[first], distance[after]):
            continue
        is_corner = a[first] <= b[first] + meeting and b[after] <= a[after] + meeting
        torn = _is_torn(beyond[gap], bridge)
        # Walls are not drawn on behind a wall.
        torn |= np.any(tall[between] < np.minimum(a, b)[between] - _BEYOND)
        if line[first] != line[after]:
            on_first = a[gap] <= b[gap]
            is_square = abs(support.cosine(line[first], line[after])) < _SQUARE
            ratio = max_ratio if is_square else _ASKEW * max_ratio
            fits = _extends(a, line, first, -1, gap[on_first], directions, ratio)
            fits &= _extends(b, line, after, 1, gap[~on_first], directions, ratio)
            if torn or not (is_corner and fits):
                continue
        distance[gap], kind[gap] = bridge, _INFERRED
        line[gap] = np.where(a[gap] <= b[gap], line[first], line[after])


def _is_torn(beyond, bridge):
    """Is something seen behind a bridge in so many of its columns that it cannot be?"""
    return np.count_nonzero(beyond > bridge + _BEYOND) > _TORN * len(bridge)


def _extends(reach, line, at, step, gap, directions, max_ratio):
    """Is a wall seen along enough of its length to be drawn on through a gap?"""
    if len(gap) == 0:
        return True
    columns, end, allowed_breaks = len(line), at, 0
    for k in range(1, columns):
        c = (at + step * k) % columns
        if line[c] == line[at]:
            end, allowed_breaks = c, 0
        elif allowed_breaks > BREAK:
            break
        allowed_breaks += 1
    far = gap[0] if step == 1 else gap[-1]
    seen = _chord(reach, at, end, directions)
    return _chord(reach, at, far, directions) <= max_ratio * seen


def _chord(reach, a, b, directions):
    """Distance of a wall's places in two columns [m]."""
    step = reach[a] * directions[a] - reach[b] * directions[b]
    return math.sqrt(step[0] * step[0] + step[1] * step[1])
