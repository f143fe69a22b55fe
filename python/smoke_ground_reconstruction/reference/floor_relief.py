"""What of the floor is not on its plane: ramps, platforms and steps, where they are measured.

Cells in which all low returns agree on one height are floor where a slope that a robot climbs leads
there from the plane, or where they make a platform, low and wide. Planes through them, and the
lines at which these planes meet or a riser stands, tell how the floor goes on where nothing was
measured. Not in the thesis.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..params import RoomBoundaryParams
from .ramp_fit import fit_ramp
from .relief_facets import (
    FEWEST_LOWER,
    ON_PLANE,
    find_creases,
    find_facets,
    find_step,
    lowered,
    with_slope,
)

CELL = 0.2
SIDE = 128  # cells along each side of the grid, the sensor in its middle
REACH = 0.5 * SIDE * CELL  # of the grid [m]
LOWEST, HIGHEST = -0.09, 0.8  # heights that are looked at [m]
_NEAREST = 0.5  # planar range [m]
_POINTS = 4  # of a cell
_SPREAD = 0.04  # between the tenth and ninetieth percentile of a cell's heights [m]
_SLACK = 0.015  # of the rise between neighbouring cells [m]
_NEAR = 0.45  # returns on the floor drawn on lie so near to measured floor [m]
_HOP = 2  # cells without returns between two rings
_PLATFORM_CELLS = 25
_FEWEST_CELLS = 6  # fewer make no facet: clutter
FLATNESS = 0.004  # a floor without relief strays so far from its plane per metre [m]
_UNSEEN_SLOPE = 0.35  # of the steepest slope seen may be missed per metre


@dataclass(frozen=True)
class FloorRelief:
    """Cells of measured floor, and the planes that it lies on.

    Attributes
    ----------
    cells : (C, 2) int64
        Column and row of the cells (multiples of CELL), by row, then column.
    height : (C,) float64
        Over the plane, 0 where the cell lies on it [m].
    facet : (C,) int64
        Index of the cell's facet; -1 where it lies on none.
    facets : (F, 3) float64
        a, b [1], c [m] of height = a x + b y + c over the plane; the first is the plane itself.
    creases : tuple of relief_facets.Crease
    step : relief_facets.Step, optional
        The riser of a platform.
    """

    cells: np.ndarray
    height: np.ndarray
    facet: np.ndarray
    facets: np.ndarray
    creases: tuple = field(default_factory=tuple)
    step: object = None

    def is_flat(self):
        """Is the floor its plane and nothing else?"""
        return len(self.facets) == 1 and not np.any(self.height)

    def at(self, xy):
        """Floor over the plane at places (N, 2) [m].

        The facet of the nearest measured cell tells, or another one that begins on the way.
        """
        if self.is_flat() or len(self.cells) == 0 or len(xy) == 0:
            return np.zeros(len(xy))
        return self._at(xy, self._nearest(xy)[0])

    def _at(self, xy, nearest):
        heights = self.height[nearest].copy()
        facet = self.facet[nearest].copy()
        for crease in self.creases * (len(self.facets) - 1):
            beyond = (facet == crease.of) & (crease.side(xy[:, 0], xy[:, 1]) > 0.0)
            facet[beyond] = crease.to
        on = facet >= 0
        a, b, c = self.facets[facet[on]].T
        heights[on] = (a * xy[on, 0] + b * xy[on, 1]) + c
        return heights

    def with_ramp(self, ramp, xy, height, planar):
        """The relief of a flat floor with a wall_ramps.WallRamp.

        As it is where floor measured on the plane or returns beneath the ramp deny it. What was
        looked at for the relief is given as to `find_relief`.
        """
        grid = _grid_of(xy, height, planar)
        a, b, c = ramp.facet
        middle = CELL * (self.cells + 0.5)
        denying = np.count_nonzero((a * middle[:, 0] + b * middle[:, 1]) + c > 2.0 * ON_PLANE)
        floor = np.zeros(SIDE * SIDE, bool)
        floor[(self.cells[:, 1] + SIDE // 2) * SIDE + (self.cells[:, 0] + SIDE // 2)] = True
        facets, creases, beneath = with_slope(grid, ramp, floor)
        if max(denying, beneath) >= FEWEST_LOWER:
            return self
        return replace(self, facets=facets, creases=creases)

    def with_ramp_fitted(self, floor, feet, normals, max_slope):
        """The relief with its only slope fitted anew, as by `ramp_fit.fit_ramp`."""
        facets, creases = fit_ramp(self.facets, self.creases, floor, feet, normals, max_slope)
        return replace(self, facets=facets, creases=creases)

    def sigma(self, xy, flatness=FLATNESS):
        """One sigma of `at` (N,): grows with the way to the next measured cell [m].

        Along it the floor may bend, the more so where slopes are seen: by `flatness` a metre where
        none are.
        """
        if len(xy) == 0 or len(self.cells) == 0:
            return np.zeros(len(xy))
        _, away = self._nearest(xy)
        a, b = self.facets[:, 0], self.facets[:, 1]
        steepest = math.sqrt((a * a + b * b).max())
        highest = float(np.abs(self.height).max())
        per_metre = max(
            flatness, _UNSEEN_SLOPE * steepest, 0.0 if self.is_flat() else 0.1 * highest
        )
        return per_metre * np.maximum(0.0, away - CELL)

    def carries(self, xy, height):
        """Returns (N,) that lie on floor off the plane, near to where it was measured."""
        on = np.zeros(len(xy), bool)
        low = (height > LOWEST) & (height < HIGHEST) & np.all(np.abs(xy) < REACH, axis=1)
        low = np.flatnonzero(low)
        if self.is_flat() or len(self.cells) == 0 or len(low) == 0:
            return on
        nearest, away = self._nearest(xy[low])
        over = self._at(xy[low], nearest)
        on[low] = (over != 0.0) & (np.abs(height[low] - over) < ON_PLANE) & (away < _NEAR)
        return on

    def is_riser(self, xy, height):
        """Returns (N,) of the step's riser: there is floor at its foot."""
        if self.step is None:
            return np.zeros(len(xy), bool)
        return self.step.holds(xy[:, 0], xy[:, 1], height)

    def _nearest(self, xy):
        """Index of the nearest measured cell of each place, the first of equals, and the way."""
        cells, of = np.unique(_cell_of(xy), axis=0, return_inverse=True)
        nearest, square = np.empty(len(cells), np.int64), np.empty(len(cells), np.int64)
        for i, cell in enumerate(cells):
            away = ((self.cells - cell) ** 2).sum(axis=1)
            nearest[i] = away.argmin()
            square[i] = away[nearest[i]]
        return nearest[of.ravel()], CELL * np.sqrt(square[of.ravel()])


def _flat(cells, height):
    """A floor without relief, measured in some cells."""
    count = len(cells)
    return FloorRelief(cells, np.zeros(count), np.zeros(count, np.int64), np.zeros((1, 3)))


FLAT = _flat(np.zeros((0, 2), np.int64), None)


def find_relief(xy, height, planar, params=None):
    """The relief of one scan.

    Parameters
    ----------
    xy : (N, 2) float64
        Places of returns, smoke left out [m].
    height, planar : (N,) float64
        Over the plane, and planar range [m].
    params : RoomBoundaryParams, optional
    """
    params = params or RoomBoundaryParams()
    grid = _grid_of(xy, height, planar)
    on_plane = grid.even & (np.abs(grid.median) <= ON_PLANE)
    step = find_step(grid, params.max_step_height)
    floor = _floor_cells(grid, on_plane, step, params)
    raised = floor & ~on_plane
    if np.count_nonzero(raised) < _FEWEST_CELLS:
        raised[:] = False
        floor = on_plane
    if not raised.any() and step is None:
        return _flat(_places(on_plane), None)
    return _with_facets(grid, floor, raised, step, params.max_slope)


def _grid_of(xy, height, planar):
    inside = (planar > _NEAREST) & np.all(np.abs(xy) < REACH, axis=1)
    inside &= (height > LOWEST) & (height < HIGHEST)
    return _Grid(xy[inside], height[inside])


def _with_facets(grid, floor, raised, step, max_slope):
    facets, of = find_facets(grid, raised, max_slope)
    of[floor & ~raised] = 0
    if step is not None:
        facets, step = _joined(facets, step)
    creases = find_creases(grid, facets, of, step)
    facets, creases = lowered(grid, facets, of, floor, creases)
    index = np.flatnonzero(floor)
    height = np.where(raised[index], grid.median[index], 0.0)
    return FloorRelief(_places(floor), height, of[index], facets, tuple(creases), step)


def _joined(facets, step):
    """Facets with that of the step's platform, and the step with its number."""
    for number in range(1, len(facets)):
        a, b, c = facets[number]
        if a == 0.0 and b == 0.0 and abs(c - step.height) < ON_PLANE:
            return facets, step.onto(number)
    return np.vstack([facets, [0.0, 0.0, step.height]]), step.onto(len(facets))


def _cell_of(xy):
    return np.floor(xy / CELL).astype(np.int64)


def _places(which):
    """Column and row (C, 2) of the cells of a flat map."""
    index = np.flatnonzero(which)
    return np.column_stack([index % SIDE, index // SIDE]) - SIDE // 2


class _Grid:
    """Low returns by cell, all maps flat (SIDE * SIDE,).

    Attributes
    ----------
    x, y, height, cell : (N,)
        The returns, in input order.
    even : bool
        Do the cell's returns agree on one height?
    median, mean_x, mean_y, mean_height : float64
        Of a cell's returns [m]; 0 where there are none. The median also where all lie on the plane.
    bottom, top : float64
        Lowest and highest return of a cell [m]; infinite and -infinite where there is none.
    count : int64
        Returns of a cell.
    """

    def __init__(self, xy, height):
        cell = _cell_of(xy) + SIDE // 2
        self.x, self.y, self.height = xy[:, 0], xy[:, 1], height
        self.cell = cell[:, 1] * SIDE + cell[:, 0]
        total = SIDE * SIDE
        self.count = np.bincount(self.cell, minlength=total)
        self.mean_x, self.mean_y, self.mean_height = (
            np.bincount(self.cell, values, total) / np.maximum(self.count, 1)
            for values in (self.x, self.y, height)
        )
        self._rank(height[np.lexsort((height, self.cell))])

    def _rank(self, height):
        """What the heights, in the order of cell and height, say of each cell."""
        some = np.flatnonzero(self.count)
        count = self.count[some]
        at = np.cumsum(count) - count
        self.bottom, self.top = np.full(SIDE * SIDE, np.inf), np.full(SIDE * SIDE, -np.inf)
        self.bottom[some], self.top[some] = height[at], height[at + count - 1]
        self.median = np.zeros(SIDE * SIDE)
        self.median[some] = height[at + count // 2]
        spread = height[at + (9 * count) // 10] - height[at + count // 10]
        self.even = np.zeros(SIDE * SIDE, bool)
        self.even[some] = (count >= _POINTS) & (spread < _SPREAD)
        # No need to rank what lies on the plane altogether.
        on_plane = (self.count >= _POINTS) & (self.bottom > -ON_PLANE) & (self.top < ON_PLANE)
        self.even[on_plane], self.median[on_plane] = True, 0.0


def _floor_cells(grid, on_plane, step, params):
    """Cells of the plane and of what a climbable slope leads to, and platforms."""
    rise = params.max_slope * CELL
    floor = _reached(on_plane, grid.even, grid.median, lambda away: rise * away + _SLACK)
    left = grid.even & ~floor & (np.abs(grid.median) <= params.max_step_height)
    while left.any():
        start = np.zeros(len(left), bool)
        start[np.flatnonzero(left)[0]] = True
        group = _reached(start, left, grid.median, lambda away: _SLACK)
        if np.count_nonzero(group) >= _PLATFORM_CELLS or (
            step is not None and step.carries(grid, group)
        ):
            floor = floor | group
        left &= ~group
    return floor


def _reached(start, among, median, steepest):
    """Cells that a chain of neighbours leads to, each step judged by its rise and its length."""
    square = (SIDE, SIDE)
    found, among, median = start.reshape(square), among.reshape(square), median.reshape(square)
    found = found.copy()
    hops = [(x, y) for x in range(-_HOP, _HOP + 1) for y in range(-_HOP, _HOP + 1)]
    while True:
        before = np.count_nonzero(found)
        for x, y in hops:
            to, of = _shifted(x, y)
            leads = np.abs(median[to] - median[of]) < steepest(max(abs(x), abs(y)))
            found[to] |= among[to] & found[of] & leads
        if np.count_nonzero(found) == before:
            return found.ravel()


def _shifted(x, y):
    """Slices of a square map: the cells, and those that lie (x, y) before them."""
    cut = lambda by: slice(max(0, by), SIDE + min(0, by))  # noqa: E731
    return (cut(y), cut(x)), (cut(-y), cut(-x))
