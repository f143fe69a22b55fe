"""Straight walls in plan, and what each azimuth column shows of each."""

from dataclasses import dataclass

import numpy as np

from .ordered import least_axis, ordered_sum
from .posts import POST_EXTENT, POST_POINTS, POST_SHARE
from .predicates import Direction

LINE_HALF = 0.03  # a wall's returns lie this near to its line, usually [m]
_ANGLES = 180  # of the Hough transform, 1 deg apart
_SLOTS_PER_METRE = 25.0
_MOST_WEIGHT = 12  # of a post: a high one is no better than two lower ones
_HALVES = (0.08, 0.05, LINE_HALF, LINE_HALF)  # of the refinement, coarse to fine [m]
_LINE_COLUMNS = 6  # least number of columns of a wall
_LINE_LENGTH = 0.2  # least length of a wall [m]
_POST_SPACING = 0.1  # of the densest stretch of a wall, at most [m]
_NEAREST = 0.2  # planar range [m]
_MOST_LINES = 40
_SUPPORT_POINTS = 3  # of a wall in one column
_TOP_COLUMNS, _TOP_SHARE = 4, 0.2  # that reach the ceiling make a wall of a stretch
_FOOT_COLUMNS = 12  # to either side of those that see a wall its foot goes on
_TALL_COLUMNS = 2  # that reach out of the view, at least, has what is as high as a wall
BREAK = 4  # columns without a return of a wall divide it


@dataclass(frozen=True)
class Lines:
    """Straight walls in plan: nx x + ny y = rho with rho >= 0, all (L,) float64 [m]."""

    nx: np.ndarray
    ny: np.ndarray
    rho: np.ndarray

    def distances(self, xy):
        """Distances (L, N) of points (N, 2) to the lines [m]."""
        return np.abs(
            (self.nx[:, None] * xy[:, 0] + self.ny[:, None] * xy[:, 1]) - self.rho[:, None]
        )

    def reach(self, line, directions):
        """Planar range of a line in directions (N, 2) [m]; infinite where it is not ahead."""
        ahead = self.nx[line] * directions[:, 0] + self.ny[line] * directions[:, 1]
        reach = np.full(len(ahead), np.inf)
        reach[ahead > 1e-3] = self.rho[line] / ahead[ahead > 1e-3]
        return reach


def find_lines(posts, widening=1.0):
    """Straight walls through posts, the best supported first.

    A Hough transform proposes, reweighted total least squares refines; a wall's posts are taken
    out before the next is looked for. `widening` as by widening_for().
    """
    xy = np.column_stack([posts.x, posts.y])
    weight = np.minimum(posts.count, _MOST_WEIGHT).astype(np.float64)
    normals = np.array([Direction.from_degrees(180.0 / _ANGLES * i) for i in range(_ANGLES)])
    left = np.ones(len(xy), bool)
    found, skip = [], np.zeros(len(xy), bool)
    while len(found) < _MOST_LINES and np.count_nonzero(left & ~skip) >= _LINE_COLUMNS:
        use = np.flatnonzero(left & ~skip)
        normal, rho, peak = _hough(xy[use], weight[use], normals)
        line = _refined_line(xy[use], weight[use], normal, rho, widening)
        near = use[_distances(xy[use], line) < LINE_HALF * widening]
        if _is_wall(xy[near], posts.column[near], line):
            found.append(line)
            left[near] = False
            skip[:] = False
        elif peak < _LINE_COLUMNS * POST_POINTS or len(near) == 0:
            break
        else:
            skip[near] = True
    lines = np.array(found).reshape(-1, 3)
    return Lines(lines[:, 0], lines[:, 1], lines[:, 2])


def _distances(xy, line):
    return np.abs((line[0] * xy[:, 0] + line[1] * xy[:, 1]) - line[2])


def _hough(xy, weight, normals):
    """Normal (2,), distance and weight of the strongest pair of slots side by side.

    Among equals the smallest angle, then the smallest distance.
    """
    rho = xy[:, :1] * normals[:, 0] + xy[:, 1:] * normals[:, 1]
    slot = np.floor(rho * _SLOTS_PER_METRE).astype(np.int64)
    first, width = slot.min(), slot.max() - slot.min() + 2
    index = (slot - first) + np.arange(_ANGLES) * width
    weights = np.broadcast_to(weight[:, None], index.shape)
    votes = np.bincount(index.ravel(), weights.ravel(), _ANGLES * width).reshape(_ANGLES, -1)
    pairs = votes[:, :-1] + votes[:, 1:]
    at, slot = np.unravel_index(int(pairs.argmax()), pairs.shape)
    return normals[at], (slot + first + 1) / _SLOTS_PER_METRE, pairs[at, slot]


def _refined_line(xy, weight, normal, rho, widening):
    """Reweighted total least squares about a peak; (nx, ny, rho) with rho >= 0."""
    nx, ny = normal
    for half in _HALVES:
        near = _distances(xy, (nx, ny, rho)) < half * widening
        if np.count_nonzero(near) < 2:
            break
        w, (x, y) = weight[near], xy[near].T
        total = ordered_sum(w)
        mean_x, mean_y = ordered_sum(w * x) / total, ordered_sum(w * y) / total
        x, y = x - mean_x, y - mean_y
        nx, ny, _ = least_axis(*(ordered_sum(w * a * b) for a, b in ((x, x), (x, y), (y, y))))
        rho = nx * mean_x + ny * mean_y
    return (-nx, -ny, -rho) if rho < 0.0 else (nx, ny, rho)


def _is_wall(xy, column, line):
    """Enough columns, and somewhere a dense enough stretch of them."""
    if len(np.unique(column)) < _LINE_COLUMNS or line[2] < _NEAREST:
        return False
    along = np.sort(line[0] * xy[:, 1] - line[1] * xy[:, 0])
    stretch = along[_LINE_COLUMNS - 1 :] - along[: len(along) - _LINE_COLUMNS + 1]
    is_long = along[-1] - along[0] >= _LINE_LENGTH
    return is_long and stretch.min() < _POST_SPACING * _LINE_COLUMNS


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
    normals : (L, 2) float64
        Of the walls.
    tall : (L,) bool
        Does a wall reach the ceiling, or as high as the sensor sees, anywhere?
    """

    seen: np.ndarray
    full: np.ndarray
    reach: np.ndarray
    normals: np.ndarray
    tall: np.ndarray

    def cosine(self, a, b):
        """Between the normals of two walls."""
        (ax, ay), (bx, by) = self.normals[a], self.normals[b]
        return ax * bx + ay * by

    def seen_near(self):
        """(L, columns) bool: is a wall seen in a column or in some to either side?"""
        shifts = range(-_FOOT_COLUMNS, _FOOT_COLUMNS + 1)
        return np.any([np.roll(self.seen, k, axis=1) for k in shifts], axis=0)


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
    furniture_height : float
        Walls are told from furniture where the view reaches higher [m].
    """

    ceiling: float
    sensor_height: float
    steepest: float
    furniture_height: float

    def is_full(self, high, planar):
        """Does something of a height at a planar range reach the ceiling, or out of the view?"""
        top = np.minimum(self.ceiling, self.sensor_height + self.steepest * planar)
        return high > top - (0.1 + 0.05 * planar)

    def tells(self, planar):
        """Can a wall at a planar range be told from a cupboard?"""
        top = self.sensor_height + self.steepest * planar
        return top > min(self.ceiling, self.furniture_height)


def line_support(returns, lines, directions, view, widening=1.0):
    """Support of walls in columns with middles `directions` (columns, 2)."""
    half = LINE_HALF * widening
    columns = len(directions)
    shape = (len(lines.rho), columns)
    seen, full = np.zeros(shape, bool), np.zeros(shape, bool)
    reach, tall = np.full(shape, np.inf), np.zeros(len(lines.rho), bool)
    for line in range(len(lines.rho)):
        off = _distances(returns.xy, (lines.nx[line], lines.ny[line], lines.rho[line]))
        on, around = off < half, off < 4.0 * half
        own = np.bincount(returns.column[on], minlength=columns)
        near = _summed(own)
        total = _summed(np.bincount(returns.column[around], minlength=columns))
        low, high = _extent(returns.column[on], returns.height[on], columns)
        reach[line] = lines.reach(line, directions)
        seen[line] = (own > 0) & (near >= _SUPPORT_POINTS) & (near >= POST_SHARE * total)
        seen[line] &= (high - low >= POST_EXTENT) & np.isfinite(reach[line])
        full[line] = _full_columns(seen[line], high, reach[line], view)
        tops = view.is_full(high[seen[line]], reach[line, seen[line]])
        tall[line] = np.count_nonzero(tops) >= _TALL_COLUMNS
    return Support(seen, full, reach, np.column_stack([lines.nx, lines.ny]), tall)


def _full_columns(seen, high, reach, view):
    """A wall is a wall all along once a fifth of its columns, four at least, reach the ceiling.

    Columns too near to tell count neither way; breaks in what is seen divide a line into walls, so
    that a cupboard in line with a wall is none.
    """
    full = np.zeros(len(seen), bool)
    for run in runs(seen):
        tells = view.tells(reach[run])
        tops = np.count_nonzero(tells & view.is_full(high[run], reach[run]))
        full[run] = tops >= max(_TOP_COLUMNS, _TOP_SHARE * np.count_nonzero(tells))
    return full


def runs(seen):
    """Indices of each stretch of columns, round the circle, breaks of BREAK columns apart."""
    at = np.flatnonzero(seen)
    if len(at) == 0:
        return []
    apart = np.diff(np.r_[at, at[0] + len(seen)]) > BREAK
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
