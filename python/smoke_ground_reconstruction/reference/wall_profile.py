"""The room's boundary per azimuth column, from what smoke leaves of the walls.

Thesis: Algorithm 5 takes one least distance per 10 deg segment; here every column of 0.4 deg has
its own boundary. Vertical posts are found in each column, straight walls through posts; the
nearest wall that reaches the ceiling bounds the floor (furniture does not), gaps are bridged along
walls seen on both sides and up to the corner where two of them meet.
"""

import math
from dataclasses import dataclass

import numpy as np

_POST_HALF = 0.025  # a post's returns lie this near to each other in planar range [m]
_POST_AROUND = 0.12  # and most returns that lie this near belong to it: smoke is spread wider [m]
_POST_SHARE = 0.6
_POST_POINTS = 4
_POST_EXTENT = 0.12  # least height of a post [m]
_STRONG_POST = 6  # returns of a post that bounds the floor without being part of a line
_LOWEST = 0.1  # above the floor: returns that can be wall [m]
_NEAREST = 0.2  # planar range [m]

_ANGLES = 180  # of the Hough transform, 1 deg apart
_RHO_STEP = 0.04  # [m]
_LINE_HALF = 0.03  # a wall's returns lie this near to its line [m]
_LINE_COLUMNS = 6  # least number of columns of a wall
_LINE_LENGTH = 0.2  # least length of a wall [m]
_MOST_LINES = 40
_SUPPORT_POINTS = 3  # of a wall in one column
_BREAK = 4  # columns without a return of a wall divide it

_CEILING_LOWEST, _CEILING_HIGHEST = 1.6, 12.0  # above the floor [m]
_CEILING_SLOT = 0.02
_CEILING_POINTS = 100


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


def ceiling_height(height, planar):
    """Height of the ceiling above the floor [m]; infinite where none is seen.

    The highest level that holds a large share of what is above: the strongest slot of heights,
    each return weighted by its range (near ones are dense).
    """
    high = (height > _CEILING_LOWEST) & (height < _CEILING_HIGHEST)
    if np.count_nonzero(high) < _CEILING_POINTS:
        return math.inf
    slots = int((_CEILING_HIGHEST - _CEILING_LOWEST) / _CEILING_SLOT)
    slot = ((height[high] - _CEILING_LOWEST) / _CEILING_SLOT).astype(int)
    votes = np.bincount(slot, planar[high], slots + 1)
    around = np.convolve(votes, np.ones(3), "same")
    at = int(around.argmax())
    if around[at] < 0.2 * votes[max(0, at - 50) :].sum():
        return math.inf
    centre = _CEILING_LOWEST + (at + 0.5) * _CEILING_SLOT
    near = high & (np.abs(height - centre) < 1.5 * _CEILING_SLOT)
    return float(np.median(height[near])) if np.count_nonzero(near) >= _CEILING_POINTS else math.inf


def find_posts(column, planar, height, xy):
    """Posts among returns that can be wall; all arrays (N,), `xy` (N, 2)."""
    order = np.lexsort((planar, column))
    column, planar, height, xy = column[order], planar[order], height[order], xy[order]
    key = column * 1000.0 + planar
    near = _count_within(key, _POST_HALF)
    around = _count_within(key, _POST_AROUND)
    dense = (near >= _POST_POINTS) & (near >= _POST_SHARE * around)
    column, planar, height, xy = column[dense], planar[dense], height[dense], xy[dense]
    if len(column) == 0:
        empty = np.zeros(0)
        return Posts(empty.astype(int), empty.astype(int), *[empty] * 5)
    starts = np.flatnonzero(np.r_[True, np.diff(column * 1000.0 + planar) > _POST_HALF])
    count = np.diff(np.r_[starts, len(column)])
    mean = lambda values: np.add.reduceat(values, starts) / count  # noqa: E731
    low, high = np.minimum.reduceat(height, starts), np.maximum.reduceat(height, starts)
    keep = (count >= _POST_POINTS) & (high - low >= _POST_EXTENT)
    return Posts(
        column[starts][keep],
        count[keep],
        mean(planar)[keep],
        low[keep],
        high[keep],
        mean(xy[:, 0])[keep],
        mean(xy[:, 1])[keep],
    )


def _count_within(key, half):
    return np.searchsorted(key, key + half, "right") - np.searchsorted(key, key - half, "left")


@dataclass(frozen=True)
class Lines:
    """Straight walls in plan: nx x + ny y = rho with rho > 0, all (L,) float64 [m]."""

    nx: np.ndarray
    ny: np.ndarray
    rho: np.ndarray

    def distances(self, xy):
        """Signed distances (L, N) of points (N, 2) to the lines [m]."""
        return self.nx[:, None] * xy[:, 0] + self.ny[:, None] * xy[:, 1] - self.rho[:, None]

    def reach(self, line, cosine, sine):
        """Planar range of a line in a direction [m]; infinite where it does not lie ahead."""
        ahead = self.nx[line] * cosine + self.ny[line] * sine
        with np.errstate(divide="ignore"):
            return np.where(ahead > 1e-3, self.rho[line] / ahead, np.inf)


def find_lines(posts):
    """Straight walls through posts, the best supported first.

    A Hough transform proposes, reweighted total least squares refines; a wall's posts are taken
    out before the next is looked for.
    """
    xy = np.column_stack([posts.x, posts.y])
    weight = np.minimum(posts.count, 12).astype(np.float64)
    angle = np.radians(np.arange(_ANGLES) * (180.0 / _ANGLES))
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    left = np.ones(len(xy), bool)
    found, skip = [], np.zeros(len(xy), bool)
    while len(found) < _MOST_LINES and np.count_nonzero(left & ~skip) >= _LINE_COLUMNS:
        use = np.flatnonzero(left & ~skip)
        line, peak = _refined_line(xy[use], weight[use], *_hough(xy[use], weight[use], normals))
        near = use[np.abs(xy[use] @ line[:2] - line[2]) < _LINE_HALF]
        if _is_wall(xy[near], posts.column[near], line):
            found.append(line)
            left[near] = False
            skip[:] = False
        elif peak < _LINE_COLUMNS * _POST_POINTS or len(near) == 0:
            break
        else:
            skip[near] = True
    lines = np.array(found).reshape(-1, 3)
    return Lines(lines[:, 0], lines[:, 1], lines[:, 2])


def _hough(xy, weight, normals):
    """Normal (2,) and distance of the strongest peak, and its weight."""
    rho = xy @ normals.T
    slots = int(np.abs(rho).max() / _RHO_STEP) + 2
    slot = np.floor(rho / _RHO_STEP).astype(np.int64) + slots
    index = slot + np.arange(_ANGLES) * (2 * slots + 1)
    weights = np.broadcast_to(weight[:, None], index.shape)
    votes = np.bincount(index.ravel(), weights.ravel(), _ANGLES * (2 * slots + 1))
    votes = votes.reshape(_ANGLES, -1)
    pairs = votes[:, :-1] + votes[:, 1:]
    at, slot = np.unravel_index(int(pairs.argmax()), pairs.shape)
    return normals[at], (slot - slots + 1) * _RHO_STEP, pairs[at, slot]


def _refined_line(xy, weight, normal, rho, peak):
    """Reweighted total least squares about a peak; (nx, ny, rho) with rho >= 0, and the peak."""
    for half in (0.08, 0.05, _LINE_HALF, _LINE_HALF):
        near = np.abs(xy @ normal - rho) < half
        if np.count_nonzero(near) < 2:
            break
        w, at = weight[near], xy[near]
        mean = (w[:, None] * at).sum(axis=0) / w.sum()
        centred = at - mean
        spread = centred.T @ (w[:, None] * centred)
        normal = np.linalg.eigh(spread)[1][:, 0]
        rho = float(normal @ mean)
    if rho < 0.0:
        normal, rho = -normal, -rho
    return np.array([normal[0], normal[1], rho]), peak


def _is_wall(xy, column, line):
    """Enough columns, and somewhere a dense enough stretch of them."""
    if len(xy) == 0 or len(np.unique(column)) < _LINE_COLUMNS or line[2] < _NEAREST:
        return False
    along = np.sort(line[0] * xy[:, 1] - line[1] * xy[:, 0])
    stretch = along[_LINE_COLUMNS - 1 :] - along[: len(along) - _LINE_COLUMNS + 1]
    return along[-1] - along[0] >= _LINE_LENGTH and stretch.min() < 0.1 * _LINE_COLUMNS


@dataclass(frozen=True)
class Support:
    """What each column shows of each wall; arrays (L, columns).

    Attributes
    ----------
    seen : bool
    full : bool
        ... and up to the ceiling, or as high as the sensor sees.
    reach : float64
        Planar range of the wall at the column's middle [m].
    """

    seen: np.ndarray
    full: np.ndarray
    reach: np.ndarray


@dataclass(frozen=True)
class Returns:
    """Returns that can be wall: column (N,), planar range, height above the floor, (N, 2) place."""

    column: np.ndarray
    planar: np.ndarray
    height: np.ndarray
    xy: np.ndarray


@dataclass(frozen=True)
class View:
    """How far up things can be seen.

    Attributes
    ----------
    ceiling : float
        Height above the floor [m]; infinite where none is seen.
    sensor_height : float
        [m]
    steepest : float
        Tangent of the highest beam's elevation.
    """

    ceiling: float
    sensor_height: float
    steepest: float

    def is_full(self, high, planar):
        """Does something of a height at a planar range reach the ceiling, or out of the view?"""
        top = np.minimum(self.ceiling, self.sensor_height + self.steepest * planar)
        return high > top - (0.1 + 0.05 * planar)

    def tells(self, planar):
        """Can a wall at a planar range be told from a cupboard?"""
        return self.sensor_height + self.steepest * planar > self.ceiling


def line_support(returns, lines, directions, view):
    """Support of walls in columns with middles `directions` (columns, 2)."""
    columns = len(directions)
    shape = (len(lines.rho), columns)
    seen, full = np.zeros(shape, bool), np.zeros(shape, bool)
    reach = np.full(shape, np.inf)
    for line in range(len(lines.rho)):
        off = np.abs(
            lines.nx[line] * returns.xy[:, 0] + lines.ny[line] * returns.xy[:, 1] - lines.rho[line]
        )
        on, around = off < _LINE_HALF, off < 4 * _LINE_HALF
        own = np.bincount(returns.column[on], minlength=columns)
        near = _summed(own)
        total = _summed(np.bincount(returns.column[around], minlength=columns))
        low, high = _extent(returns.column[on], returns.height[on], columns)
        reach[line] = lines.reach(line, directions[:, 0], directions[:, 1])
        seen[line] = (own > 0) & (near >= _SUPPORT_POINTS) & (near >= _POST_SHARE * total)
        seen[line] &= (high - low >= _POST_EXTENT) & np.isfinite(reach[line])
        full[line] = seen[line] & _full_columns(seen[line], high, reach[line], view)
    return Support(seen, full, reach)


def _full_columns(seen, high, reach, view):
    """A wall is a wall all along once a fifth of its columns, four at least, reach the ceiling.

    Columns too near to tell count neither way; breaks in what is seen divide a line into walls, so
    that a cupboard in line with a wall is none.
    """
    with np.errstate(invalid="ignore"):
        tells = seen & view.tells(reach)
        tops = tells & view.is_full(high, reach)
    full = np.zeros(len(seen), bool)
    for run in _runs(seen):
        full[run] = np.count_nonzero(tops[run]) >= max(4, 0.2 * np.count_nonzero(tells[run]))
    return full & seen


def _runs(seen):
    """Indices of each stretch of columns, round the circle, breaks of _BREAK columns apart."""
    at = np.flatnonzero(seen)
    if len(at) == 0:
        return []
    apart = np.diff(np.r_[at, at[0] + len(seen)]) > _BREAK
    if not apart.any():
        return [at]
    first = int(np.flatnonzero(apart)[-1]) + 1
    at, apart = np.roll(at, -first), np.roll(apart, -first)
    return np.split(at, np.flatnonzero(apart)[:-1] + 1)


def _summed(values):
    """Sum over each column and its two neighbours, round the circle."""
    return values + np.roll(values, 1) + np.roll(values, -1)


def _extent(column, height, columns):
    """Lowest and highest over each column and its neighbours."""
    low, high = np.full(columns, np.inf), np.full(columns, -np.inf)
    np.minimum.at(low, column, height)
    np.maximum.at(high, column, height)
    low = np.minimum(low, np.minimum(np.roll(low, 1), np.roll(low, -1)))
    return low, np.maximum(high, np.maximum(np.roll(high, 1), np.roll(high, -1)))


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


_SEEN, _INFERRED, _LIMIT = 0, 1, 2
_BEYOND = 0.25  # returns this far beyond a bridge tear it down [m]
_WIDEST_GAP = 90.0  # that is bridged along one wall [deg]
_MEETING = 0.05  # [m]
_CHAIN_STEP = 0.04  # from post to post of a chain [m]
_CHAIN_SLOPE = 0.012  # ... and per metre of range: a wall at 60 deg to the beam
_EXTENSION = 1.6  # a wall is drawn on to a corner so many times its seen length
_LONG = 0.8  # a wall so long is bridged though its top is not seen [m]
_FARTHEST_CORNER = 1.6  # times the farther of the two places where its walls were seen last


def column_profile(posts, support, view, beyond):
    """The boundary of each column.

    Parameters
    ----------
    posts : Posts
    support : Support
    view : View
    beyond : (columns,) float64
        How far floor or ceiling was measured in each column [m]: no wall stands nearer, unless
        it is seen.
    """
    columns = len(beyond)
    distance, kind = np.zeros(columns), np.full(columns, _LIMIT)
    line = np.full(columns, -1)
    if len(support.reach) > 0:
        reach = np.where(support.full, support.reach, np.inf)
        nearest = reach.argmin(axis=0)
        known = np.isfinite(reach.min(axis=0))
        distance[known], kind[known] = reach.min(axis=0)[known], _SEEN
        line[known] = nearest[known]
    _add_full_posts(posts, view, distance, kind)
    outermost = _outermost(posts, support, columns)
    _follow(outermost, distance, kind)
    _bridge(support, distance, kind, line, np.maximum(beyond, outermost))
    rest = (distance == 0.0) & (outermost > 0.0)
    # A lone column is a look through a crack: no place to claim floor in.
    rest &= _like_neighbors(np.where(distance > 0.0, distance, outermost)) >= 2
    distance[rest], kind[rest] = outermost[rest], _SEEN
    _take_lines(support, distance, line, rest)
    _bridge(support, distance, kind, line, np.maximum(beyond, outermost))
    return Profile(distance, kind, line)


def _take_lines(support, distance, line, columns):
    """Walls of which no top is seen, long enough to be bridged along."""
    if len(support.reach) == 0:
        return
    on = support.seen & (np.abs(support.reach - distance) < _LINE_HALF) & columns
    for number in range(len(on)):
        for run in _runs(on[number]):
            if _chord(support.reach[number], run[0], run[-1], on.shape[1]) > _LONG:
                line[run] = number


def _add_full_posts(posts, view, distance, kind):
    """Walls that no straight line fits: posts up to the ceiling, with like neighbours."""
    full = view.is_full(posts.high, posts.distance) & view.tells(posts.distance)
    full &= posts.count >= _STRONG_POST
    nearest = np.full(len(distance), np.inf)
    np.minimum.at(nearest, posts.column[full], posts.distance[full])
    add = (distance == 0.0) & np.isfinite(nearest) & (_like_neighbors(nearest) >= 3)
    distance[add], kind[add] = nearest[add], _SEEN


def _like_neighbors(distance):
    """How many of the three columns to either side go on at about a column's distance."""
    like = np.zeros(len(distance), int)
    with np.errstate(invalid="ignore"):
        for shift in (-3, -2, -1, 1, 2, 3):
            step = np.abs(np.roll(distance, shift) - distance)
            like += step < (0.05 + 0.03 * distance) * abs(shift)
    return like


def _outermost(posts, support, columns):
    """The farthest vertical structure of each column; 0 where there is none."""
    farthest = np.zeros(columns)
    strong = posts.count >= _STRONG_POST
    np.maximum.at(farthest, posts.column[strong], posts.distance[strong])
    if len(support.reach) > 0:
        seen = np.where(support.seen, support.reach, 0.0)
        farthest = np.maximum(farthest, seen.max(axis=0))
    return farthest


def _follow(outermost, distance, kind):
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
        step = (_CHAIN_STEP + _CHAIN_SLOPE * np.minimum(planar[1:], planar[:-1])) * turn
        if turn.max() > _BREAK or np.any(np.abs(np.diff(planar)) > step):
            continue
        place = np.r_[0, np.cumsum(turn)]
        distance[gap] = np.interp(1 + np.arange(len(gap)), place, planar)
        kind[gap] = np.where(outermost[gap] > 0.0, _SEEN, _INFERRED)


def _bridge(support, distance, kind, line, beyond):
    """Bridge the gaps between known walls, along one wall or round the corner of two.

    Along one wall nothing but a wall on both sides is asked for: the floor ends at the line of a
    wall whether a door in it is open or not. A corner must lie in the gap, no farther along either
    wall than it was seen to be long, and no floor, ceiling or wall may be seen beyond it.
    """
    columns = len(distance)
    known = np.flatnonzero(line >= 0)
    widest = _WIDEST_GAP * columns / 360.0
    for first, after in zip(known, np.roll(known, -1)):
        gap = (first + 1 + np.arange((after - first - 1) % columns)) % columns
        gap = gap[distance[gap] == 0.0]
        if not 0 < len(gap) <= widest:
            continue
        a, b = support.reach[line[first]], support.reach[line[after]]
        bridge = np.minimum(a[gap], b[gap])
        if bridge.max() > _FARTHEST_CORNER * max(distance[first], distance[after]):
            continue
        is_corner = a[first] <= b[first] + _MEETING and b[after] <= a[after] + _MEETING
        torn = np.count_nonzero(beyond[gap] > bridge + _BEYOND) > 0.1 * len(gap)
        if line[first] != line[after]:
            on_first = a[gap] <= b[gap]
            fits = _extends(a, line, first, -1, gap[on_first], columns)
            fits &= _extends(b, line, after, 1, gap[~on_first], columns)
            if torn or not (is_corner and fits):
                continue
        distance[gap], kind[gap] = bridge, _INFERRED
        line[gap] = np.where(a[gap] <= b[gap], line[first], line[after])


def _extends(reach, line, at, step, gap, columns):
    """Is a wall seen along enough of its length to be drawn on through a gap?"""
    if len(gap) == 0:
        return True
    end, allowed_breaks = at, 0
    for k in range(1, columns):
        c = (at + step * k) % columns
        if line[c] == line[at]:
            end, allowed_breaks = c, 0
        elif allowed_breaks > _BREAK:
            break
        allowed_breaks += 1
    far = gap[0] if step == 1 else gap[-1]
    seen = _chord(reach, at, end, columns)
    return _chord(reach, at, far, columns) <= _EXTENSION * seen


def _chord(reach, a, b, columns):
    """Distance of a wall's places in two columns [m]."""
    turn = 2.0 * math.pi * ((b - a) % columns) / columns
    square = reach[a] ** 2 + reach[b] ** 2 - 2.0 * reach[a] * reach[b] * math.cos(turn)
    return math.sqrt(max(0.0, square))
