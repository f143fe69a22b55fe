"""Planes of a floor's relief, and the lines at which one ends and another begins."""

import math
from dataclasses import dataclass, replace

import numpy as np

from .ordered import least_axis, ordered_sum
from .predicates import Direction

ON_PLANE = 0.03  # a cell so near to the floor's plane lies on it [m]
_INLIER = 0.015  # a cell lies on a facet if its mean height is so near [m]
_FEWEST = 6  # cells of a facet
_MOST_FACETS = 6
_SEEDS = 48  # cells around which facets are sought
_AROUND = 0.5  # half the window around a seed [m]
_PRIOR = 0.0025  # keeps slopes from what too short a piece cannot tell [m^2]
LEVEL = 0.03  # facets less steep are level
STEEPER = 1.5625  # a facet may be so many times as steep as the way onto it
_BEND = 0.03  # facets whose slopes differ by less do not cross
_SHARE = 0.85  # of the cells lie on their own side of a crease
_CREASE_SLACK = 0.15  # or no farther than this beyond it [m]

_RISER_LOWEST = 0.03  # heights of what may be a riser [m]
_RISER_OVER = 0.02  # ... up to so much over the highest step
_RISER_EXTENT = 0.06  # between the lowest and the highest return of a riser's cell [m]
_STEP_TOP = 0.05  # nothing stands higher in a cell of a riser, over the highest step [m]
_ANGLES = 180  # 1 deg apart
_RHO_STEP = 0.04  # [m]
_FARTHEST = 20.0
_LINE_HALF = 0.03  # returns of a riser lie so near to its line [m]
_LINE_CELLS = 8
_LINE_LENGTH = 1.5  # [m]
_TOP_SHARE = 0.9  # of the cells' tops lie below the platform
_ON_TOP = 0.05  # returns so far behind a riser, near its top's height, lie on its platform [m]
_FEWEST_ON_TOP = 8  # tell the platform's height
_BEHIND = 0.2  # floor cells so far behind a riser lie on its platform [m]
_MOST_AGAINST = 2  # cells behind a riser that lie lower than its top
LOWER = 0.04  # returns so far below a facet show that the floor is lower there [m]
FEWEST_LOWER = 3  # returns
_BESIDE = 1.0  # the lowest of them counts if the next one lies so near [m]


@dataclass(frozen=True)
class Crease:
    """Where a facet `of` goes over into a facet `to`: beyond nx x + ny y = rho."""

    of: int
    to: int
    nx: float
    ny: float
    rho: float

    def side(self, x, y):
        """Signed distance to the line, positive on the side of `to` [m]."""
        return (self.nx * x + self.ny * y) - self.rho


@dataclass(frozen=True)
class Step:
    """A riser: its line with the normal away from the sensor, and the platform behind it.

    Attributes
    ----------
    nx, ny, rho : float
        nx x + ny y = rho [m].
    height : float
        Of the platform over the plane [m].
    facet : int
        Number of the platform's facet.
    """

    nx: float
    ny: float
    rho: float
    height: float
    facet: int = 0

    def onto(self, facet):
        """The same step with the number of its platform's facet."""
        return replace(self, facet=facet)

    def side(self, x, y):
        """Signed distance to the riser, positive on its platform [m]."""
        return (self.nx * x + self.ny * y) - self.rho

    def holds(self, x, y, height):
        """Are returns part of the riser?"""
        part = (height > _RISER_LOWEST) & (height < self.height + _LINE_HALF)
        return part & (np.abs(self.side(x, y)) < _LINE_HALF)

    def carries(self, grid, group):
        """Do cells (a flat bool map) lie on the step's platform?"""
        level = np.abs(grid.mean_height[group] - self.height) < LOWER
        behind = self.side(grid.mean_x[group], grid.mean_y[group]) > -_CREASE_SLACK
        return bool(np.all(level & behind))


def find_facets(grid, raised, max_slope):
    """Planes through cells that are no part of the floor's plane.

    Returns facets (F, 3), the first of them the floor's plane, and the facet of each cell of the
    grid (-1: none).
    """
    of = np.full(len(raised), -1, np.int64)
    facets = [[0.0, 0.0, 0.0]]
    left = np.flatnonzero(raised)
    while len(left) >= _FEWEST and len(facets) <= _MOST_FACETS:
        plane = _strongest(grid, left, STEEPER * max_slope)
        on = _on(grid, left, plane)
        if np.count_nonzero(on) < _FEWEST:
            break
        of[left[on]] = len(facets)
        facets.append(plane)
        left = left[~on]
    return np.array(facets), of


def _on(grid, cells, plane):
    a, b, c = plane
    model = (a * grid.mean_x[cells] + b * grid.mean_y[cells]) + c
    return np.abs(grid.mean_height[cells] - model) < _INLIER


def _strongest(grid, left, steepest):
    """The plane that most cells lie on, fitted to them."""
    best, count = None, 0
    for seed in left[:: max(1, len(left) // _SEEDS)]:
        near = np.abs(grid.mean_x[left] - grid.mean_x[seed]) < _AROUND
        near &= np.abs(grid.mean_y[left] - grid.mean_y[seed]) < _AROUND
        for plane in ([0.0, 0.0, grid.mean_height[seed]], _fitted(grid, left[near])):
            found = np.count_nonzero(_on(grid, left, plane))
            if found > count and _square(plane) < steepest * steepest:
                best, count = plane, found
    for _ in range(3):
        on = left[_on(grid, left, best)]
        best = _fitted(grid, on) if len(on) > 0 else best
    return best


def _square(plane):
    """Of its slope."""
    return plane[0] * plane[0] + plane[1] * plane[1]


def _fitted(grid, cells):
    """Least squares through the means of cells; level where it is nearly so."""
    weight = np.minimum(grid.count[cells], 25).astype(np.float64)
    total = ordered_sum(weight)
    mean = [
        ordered_sum(weight * v[cells]) / total for v in (grid.mean_x, grid.mean_y, grid.mean_height)
    ]
    x, y = grid.mean_x[cells] - mean[0], grid.mean_y[cells] - mean[1]
    h = grid.mean_height[cells] - mean[2]
    xx, xy = ordered_sum(weight * (x * x)) + _PRIOR, ordered_sum(weight * (x * y))
    yy = ordered_sum(weight * (y * y)) + _PRIOR
    xh, yh = ordered_sum(weight * (x * h)), ordered_sum(weight * (y * h))
    determinant = xx * yy - xy * xy
    a, b = (xh * yy - yh * xy) / determinant, (yh * xx - xh * xy) / determinant
    if a * a + b * b < LEVEL * LEVEL:
        return [0.0, 0.0, mean[2]]
    return [a, b, mean[2] - (a * mean[0] + b * mean[1])]


def find_creases(grid, facets, of, step):
    """Where the facets go over into each other; `step` (or None) knows the number of its own."""
    creases = []
    for a in range(len(facets)):
        for b in range(a + 1, len(facets)):
            if step is not None and a == 0 and b == step.facet:
                line = step.nx, step.ny, step.rho
            else:
                line = _crossing(grid, facets[a], facets[b], of == a, of == b)
            if line is not None:
                nx, ny, rho = line
                creases += [Crease(a, b, nx, ny, rho), Crease(b, a, -nx, -ny, -rho)]
    return creases


def _crossing(grid, first, second, on_first, on_second):
    """Where two facets meet, the normal towards the second; None where no line parts them."""
    nx, ny = first[0] - second[0], first[1] - second[1]
    length = math.sqrt(nx * nx + ny * ny)
    if length < _BEND:
        return None
    nx, ny, rho = nx / length, ny / length, (second[2] - first[2]) / length
    sides = [(nx * grid.mean_x[on] + ny * grid.mean_y[on]) - rho for on in (on_first, on_second)]
    if 2 * np.count_nonzero(sides[1] > 0.0) < len(sides[1]):
        nx, ny, rho, sides = -nx, -ny, -rho, [-side for side in sides]
    apart = np.count_nonzero(sides[0] < _CREASE_SLACK) >= _SHARE * len(sides[0])
    apart &= np.count_nonzero(sides[1] > -_CREASE_SLACK) >= _SHARE * len(sides[1])
    return (nx, ny, rho) if apart else None


def find_step(grid, max_height):
    """The longest riser of a platform, if nothing speaks against it; else None."""
    riser = (grid.height > _RISER_LOWEST) & (grid.height < max_height + _RISER_OVER)
    riser &= grid.top[grid.cell] < max_height + _STEP_TOP
    riser &= grid.top[grid.cell] - grid.bottom[grid.cell] > _RISER_EXTENT
    x, y, cell = grid.x[riser], grid.y[riser], grid.cell[riser]
    if len(x) < _LINE_CELLS:
        return None
    line = _refined(x, y, _straightest(x, y, cell))
    if line is None or line[2] < _BEHIND:
        return None
    on = np.abs((line[0] * x + line[1] * y) - line[2]) < _LINE_HALF
    cells = np.unique(cell[on])
    if len(cells) < _LINE_CELLS:
        return None
    along = np.sort(line[0] * y[on] - line[1] * x[on])
    span = along[len(along) // 20], along[-1 - len(along) // 20]
    tops = np.sort(grid.top[cells])
    step = Step(*line, float(tops[int(_TOP_SHARE * (len(tops) - 1))]))
    if span[1] - span[0] < _LINE_LENGTH or not _stands(grid, step, span):
        return None
    return replace(step, height=_platform_height(grid, step, span))


def _straightest(x, y, cell):
    """The line that runs through most cells with returns: a Hough transform, one vote a cell."""
    cells, of = np.unique(cell, return_inverse=True)
    count = np.bincount(of)
    x, y = np.bincount(of, x) / count, np.bincount(of, y) / count
    best, line = 0, (1.0, 0.0, 0.0)
    slots = int(_FARTHEST / _RHO_STEP)
    for k in range(_ANGLES):
        nx, ny = Direction.from_degrees(float(k))
        slot = np.floor((nx * x + ny * y) / _RHO_STEP).astype(np.int64) + slots
        votes = np.bincount(slot, minlength=2 * slots)
        pairs = votes[:-1] + votes[1:]
        at = int(pairs.argmax())
        if pairs[at] > best:
            best, line = pairs[at], (nx, ny, (at - slots + 1) * _RHO_STEP)
    return line


def _refined(x, y, line):
    """Total least squares through the returns near a line, twice; None where too few are left."""
    for _ in range(2):
        near = np.abs((line[0] * x + line[1] * y) - line[2]) < 2.0 * _LINE_HALF
        if np.count_nonzero(near) < _LINE_CELLS:
            return None
        line = _line_through(x[near], y[near])
    return line


def _line_through(x, y):
    """Total least squares; the normal points away from the sensor."""
    count = len(x)
    mean_x, mean_y = ordered_sum(x) / count, ordered_sum(y) / count
    dx, dy = x - mean_x, y - mean_y
    nx, ny, _ = least_axis(ordered_sum(dx * dx), ordered_sum(dx * dy), ordered_sum(dy * dy))
    rho = nx * mean_x + ny * mean_y
    return (nx, ny, rho) if rho >= 0.0 else (-nx, -ny, -rho)


def _behind(grid, step, span, far):
    """Returns so far behind a riser, as far as it is seen to run."""
    along = step.nx * grid.y - step.ny * grid.x
    return (step.side(grid.x, grid.y) > far) & (along > span[0]) & (along < span[1])


def _platform_height(grid, step, span):
    """The mean of what lies on the platform, no wall above it, if that is enough; else the riser's
    top, which noise lifts."""
    top = grid.top[grid.cell]
    on = _behind(grid, step, span, _ON_TOP) & (top > ON_PLANE) & (top < step.height + LOWER)
    on &= grid.height > step.height - LOWER
    count = np.count_nonzero(on)
    return ordered_sum(grid.height[on]) / count if count >= _FEWEST_ON_TOP else step.height


def _stands(grid, step, span):
    """Does nothing behind a riser, as far as it is seen to run, lie lower than its top?"""
    lower = _behind(grid, step, span, _BEHIND) & (grid.height < step.height - LOWER)
    against = np.unique(grid.cell[lower])
    return len(against) <= _MOST_AGAINST


def lowered(grid, facets, of, floor, creases):
    """Facets and creases with a level end for each slope that returns from beneath it disprove.

    A wall's returns from below a ramp drawn on show that the ramp has ended before it.
    """
    facets, creases = [list(facet) for facet in facets], list(creases)
    for number in range(1, len(facets)):
        if facets[number][0] == 0.0 and facets[number][1] == 0.0:
            continue
        on = of == number
        highest = float(grid.mean_height[on].max())
        against = _returns_beneath(grid, number, facets[number], highest, floor, creases)
        if len(against) >= FEWEST_LOWER:
            _end_level(number, facets, creases, highest, _lowest(grid, against))
    return np.array(facets), creases


def with_slope(grid, ramp, floor):
    """The plane and a wall's ramp that rises from it, with a level end where returns disprove more.

    Returns facets (F, 3), creases, and how many returns lie beneath the ramp as far as it was seen.
    """
    a, b, c = ramp.facet
    length = math.sqrt(a * a + b * b)
    nx, ny, rho = a / length, b / length, -c / length
    creases = [Crease(0, 1, nx, ny, rho), Crease(1, 0, -nx, -ny, -rho)]
    facets = [[0.0, 0.0, 0.0], [a, b, c]]
    beneath = _returns_beneath(grid, 1, facets[1], 0.0, floor, creases)
    beyond = _returns_beneath(grid, 1, facets[1], ramp.top, floor, creases)
    if len(beyond) >= FEWEST_LOWER:
        _end_level(1, facets, creases, ramp.top, _lowest(grid, beyond))
    return np.array(facets), tuple(creases), len(beneath) - len(beyond)


def _lowest(grid, returns):
    """Height of the lowest of some returns; of the second lowest if that is far from it: one alone
    may be smoke."""
    first, second = returns[np.argsort(grid.height[returns], kind="stable")[:2]]
    x, y = grid.x[first] - grid.x[second], grid.y[first] - grid.y[second]
    return float(grid.height[first if x * x + y * y < _BESIDE * _BESIDE else second])


def _end_level(number, facets, creases, highest, lowest):
    """Lets a slope end level, at its highest cells or where returns lie beneath it."""
    a, b, c = facets[number]
    level = max(highest, lowest)
    length = math.sqrt(a * a + b * b)
    creases.append(Crease(number, len(facets), a / length, b / length, (level - c) / length))
    facets.append([0.0, 0.0, level])


def _returns_beneath(grid, number, plane, highest, floor, creases):
    """Returns in unmeasured cells that lie beneath a facet drawn on to there."""
    a, b, c = plane
    model = (a * grid.x + b * grid.y) + c
    beneath = (grid.height < model - LOWER) & (model > highest) & ~floor[grid.cell]
    for crease in creases:
        if crease.of == number:
            beneath &= crease.side(grid.x, grid.y) <= 0.0
    return np.flatnonzero(beneath)
