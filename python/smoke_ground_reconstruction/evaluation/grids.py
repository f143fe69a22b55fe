"""Cells on the ground: which of them an output claims, and how the claim compares with the truth.

Every array of cells is (rows, columns) = (y, x) in the level, sensor-centred frame; row 0 and
column 0 lie at the grid's corner of smallest y and x. Thesis: Section 5.2.1, Figures 5.5 and 5.6.
"""

from dataclasses import dataclass
from typing import Tuple

import numpy as np


@dataclass(frozen=True)
class CellGrid:
    """Where the cells lie.

    Attributes:
        origin: x and y of the grid's corner of smallest coordinates [m].
        cell: edge of a cell [m].
        shape: number of rows and columns.
    """

    origin: Tuple[float, float]
    cell: float
    shape: Tuple[int, int]

    @classmethod
    def of(cls, truth):
        """The grid that a FloorTruth is drawn on."""
        x, y = truth.origin
        rows, columns = truth.visible_floor.shape
        return cls((float(x), float(y)), float(truth.cell), (rows, columns))

    def rows_columns(self, xy):
        """Row and column of each point, (N,) int64 each; they may lie outside the grid.

        Args:
            xy: (N, 2 or more) coordinates [m]; finite.
        """
        xy = np.asarray(xy, dtype=np.float64)
        columns = np.floor((xy[:, 0] - self.origin[0]) / self.cell).astype(np.int64)
        rows = np.floor((xy[:, 1] - self.origin[1]) / self.cell).astype(np.int64)
        return rows, columns

    def contains(self, rows, columns):
        """(N,) bool: does the cell exist?"""
        return (rows >= 0) & (rows < self.shape[0]) & (columns >= 0) & (columns < self.shape[1])

    def centres(self):
        """x and y of the cells' centres [m], each of the grid's shape."""
        x = self.origin[0] + (np.arange(self.shape[1]) + 0.5) * self.cell
        y = self.origin[1] + (np.arange(self.shape[0]) + 0.5) * self.cell
        return np.meshgrid(x, y)

    @property
    def extent(self):
        """Left, right, bottom, top [m], as matplotlib's imshow takes it with origin='lower'."""
        x, y = self.origin
        return x, x + self.shape[1] * self.cell, y, y + self.shape[0] * self.cell


@dataclass(frozen=True)
class Occupancy:
    """The cells that hold at least one point.

    Attributes:
        cells: bool of the grid's shape.
        beyond: number of distinct cells outside the grid that hold points.
    """

    cells: np.ndarray
    beyond: int = 0


def finite_points(xyz):
    """The finite rows of an (N, 3) array, as float64.

    Raises:
        ValueError: the array is not (N, 3).
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise ValueError(f"points must be (N, 3), not {xyz.shape}")
    return xyz[np.isfinite(xyz).all(axis=1)]


def occupancy(grid, xyz):
    """Draw points into cells: occupied if one or more points lie in it (thesis Section 5.2.1).

    Args:
        grid: CellGrid.
        xyz: (N, 3) points in the level frame [m]; non-finite ones are left out.

    Returns:
        Occupancy.
    """
    rows, columns = grid.rows_columns(finite_points(xyz))
    inside = grid.contains(rows, columns)
    cells = np.zeros(grid.shape, dtype=bool)
    cells[rows[inside], columns[inside]] = True
    outside = np.stack([rows[~inside], columns[~inside]], axis=1)
    return Occupancy(cells, len(np.unique(outside, axis=0)))


def mean_height(grid, xyz):
    """Mean z of the points of each cell [m], float64 of the grid's shape; NaN in empty cells."""
    xyz = finite_points(xyz)
    return cell_mean(grid, xyz, xyz[:, 2])


def cell_mean(grid, xyz, values):
    """Mean of the values (N,) of the points (N, 3) in each cell, of the grid's shape; NaN in empty
    cells."""
    rows, columns = grid.rows_columns(xyz)
    inside = grid.contains(rows, columns)
    flat = rows[inside] * grid.shape[1] + columns[inside]
    size = grid.shape[0] * grid.shape[1]
    count = np.bincount(flat, minlength=size)
    total = np.bincount(flat, weights=values[inside], minlength=size)
    with np.errstate(invalid="ignore"):
        return (total / count).reshape(grid.shape)


@dataclass(frozen=True)
class Classification:
    """What became of each cell; bool arrays of the grid's shape, no two of them true together.

    Attributes:
        true_positive, false_positive, false_negative, true_negative: of the cells that count.
        ignored: cells that count neither way.
        beyond: claimed cells outside the grid, false positives that have no cell to be drawn in.
    """

    true_positive: np.ndarray
    false_positive: np.ndarray
    false_negative: np.ndarray
    true_negative: np.ndarray
    ignored: np.ndarray
    beyond: int = 0


def ignored_cells(truth):
    """Cells that count neither way, bool of the grid's shape.

    They are the disc under the sensor, and true floor out of the sensor's sight. A hole is no
    floor: a claim over it counts even where the sensor cannot look into it.
    """
    unseen = truth.out_of_sight & ~truth.visible_floor & ~truth.hole
    return truth.under_sensor | unseen


def classify(claimed, floor, ignored):
    """Compare claimed cells with true ones.

    Args:
        claimed: Occupancy of the output.
        floor: bool of the grid's shape, the true floor cells.
        ignored: bool of the grid's shape, cells that count neither way.

    Returns:
        Classification. Thesis: Figure 5.6.
    """
    counts = ~ignored
    return Classification(
        true_positive=counts & floor & claimed.cells,
        false_positive=counts & ~floor & claimed.cells,
        false_negative=counts & floor & ~claimed.cells,
        true_negative=counts & ~floor & ~claimed.cells,
        ignored=ignored.copy(),
        beyond=claimed.beyond,
    )
