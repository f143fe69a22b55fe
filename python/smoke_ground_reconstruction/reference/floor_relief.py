"""What of the floor is not on its plane: ramps and low platforms, where they are measured.

Cells in which all low returns agree on one height are floor where a slope that a robot climbs leads
there from the plane, or where they make a platform, low and wide. Not in the thesis.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

CELL = 0.2
_LOWEST, _HIGHEST = -0.09, 0.8  # heights that are looked at [m]
_NEAREST = 0.5  # planar range [m]
_POINTS = 4  # of a cell
_SPREAD = 0.04  # between the tenth and ninetieth percentile of a cell's heights [m]
_ON_PLANE = 0.03
_SLOPE, _SLACK = 0.16, 0.015  # between neighbouring cells: rise per metre, and [m]
_HOP = 2  # cells without returns between two rings
_PLATFORM_HEIGHT = 0.2  # [m]
_PLATFORM_CELLS = 25
_FEWEST_CELLS = 10  # less relief is clutter


@dataclass(frozen=True)
class FloorRelief:
    """Cells of measured floor and their heights over the plane; empty where the floor is flat.

    Attributes
    ----------
    cells : (C, 2) int64
        Column and row of the cells (multiples of CELL).
    height : (C,) float64
        Over the plane, 0 where the cell lies on it [m].
    """

    cells: np.ndarray
    height: np.ndarray

    def at(self, xy):
        """Floor over the plane at places (N, 2): as high as the nearest measured cell [m]."""
        heights = np.zeros(len(xy))
        if len(self.cells) == 0 or len(xy) == 0:
            return heights
        cells, of = np.unique(_cell_of(xy), axis=0, return_inverse=True)
        nearest = np.empty(len(cells))
        for i, cell in enumerate(cells):
            away = ((self.cells - cell) ** 2).sum(axis=1)
            nearest[i] = self.height[away.argmin()]
        return nearest[of.ravel()]


FLAT = FloorRelief(np.zeros((0, 2), np.int64), np.zeros(0))


def find_relief(xy, height, planar):
    """The relief of one scan.

    Parameters
    ----------
    xy : (N, 2) float64
        Places of returns, smoke left out [m].
    height, planar : (N,) float64
        Over the plane, and planar range [m].
    """
    low = (height > _LOWEST) & (height < _HIGHEST) & (planar > _NEAREST)
    medians = _even_cells(_cell_of(xy[low]), height[low])
    off = sum(abs(median) > _ON_PLANE for median in medians.values())
    if off < _FEWEST_CELLS:
        return FLAT
    floor = {cell for cell, median in medians.items() if abs(median) <= _ON_PLANE}
    floor |= _reached(floor, medians, lambda rise, away: rise < _SLOPE * CELL * away + _SLACK)
    for platform in _platforms(medians, floor):
        floor |= platform
    if sum(abs(medians[cell]) > _ON_PLANE for cell in floor) < _FEWEST_CELLS:
        return FLAT
    cells = sorted(floor)
    heights = np.array([medians[cell] for cell in cells])
    heights[np.abs(heights) <= _ON_PLANE] = 0.0
    return FloorRelief(np.array(cells), heights)


def _cell_of(xy):
    return np.floor(xy / CELL).astype(np.int64)


def _even_cells(cell, height):
    """Median height of each cell whose returns agree on one."""
    order = np.lexsort((height, cell[:, 1], cell[:, 0]))
    cell, height = cell[order], height[order]
    cells, begin, count = np.unique(cell, axis=0, return_index=True, return_counts=True)
    spread = height[begin + (9 * count) // 10] - height[begin + count // 10]
    even = (count >= _POINTS) & (spread < _SPREAD)
    median = height[begin + count // 2]
    return {tuple(at): value for at, value in zip(cells[even].tolist(), median[even].tolist())}


def _reached(start, medians, leads):
    """Cells that a chain of neighbours leads to, each step judged by its rise and its length."""
    found, queue = set(start), deque(sorted(start))
    while queue:
        column, row = at = queue.popleft()
        for dx in range(-_HOP, _HOP + 1):
            for dy in range(-_HOP, _HOP + 1):
                to = (column + dx, row + dy)
                if to in found or to not in medians:
                    continue
                if leads(abs(medians[to] - medians[at]), max(abs(dx), abs(dy))):
                    found.add(to)
                    queue.append(to)
    return found


def _platforms(medians, floor):
    """Low, wide, level groups of cells beside the floor."""
    left = {
        cell: median
        for cell, median in medians.items()
        if cell not in floor and abs(median) <= _PLATFORM_HEIGHT
    }
    while left:
        group = _reached({min(left)}, left, lambda rise, away: rise < _SLACK)
        if len(group) >= _PLATFORM_CELLS:
            yield group
        left = {cell: median for cell, median in left.items() if cell not in group}
