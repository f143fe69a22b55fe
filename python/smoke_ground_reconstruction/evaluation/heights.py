"""Height of the claimed floor against the true one, cell by cell (thesis Section 5.2.2)."""

from dataclasses import dataclass

import numpy as np

from smoke_ground_reconstruction.evaluation import grids
from smoke_ground_reconstruction.evaluation.grids import mean_height


@dataclass(frozen=True)
class HeightErrors:
    """Claimed minus true height of the true-positive cells of one scan.

    Attributes:
        cells: float64 of the grid's shape [m]; NaN where a cell is not scored.
        edges: the same for cells that the edge of a step crosses, where the mean height of the
            cell has no meaning for a robot; kept apart.
    """

    cells: np.ndarray
    edges: np.ndarray

    @property
    def values(self):
        """The scored errors, (K,) float64 [m]."""
        return self.cells[np.isfinite(self.cells)]

    def to_dict(self):
        """Mean, median, mean absolute and 95th percentile of the absolute error [m] by name.

        None where no cell is scored.
        """
        edges = self.edges[np.isfinite(self.edges)]
        return {
            "cells": int(self.values.size),
            "mean": _of(np.mean, self.values),
            "median": _of(np.median, self.values),
            "mean_abs": _of(np.mean, np.abs(self.values)),
            "p95": _of(lambda errors: np.percentile(errors, 95), np.abs(self.values)),
            "edge_cells": int(edges.size),
            "edge_mean_abs": _of(np.mean, np.abs(edges)),
        }


def _of(statistic, values):
    return float(statistic(values)) if values.size else None


def height_errors(grid, xyz, truth, true_positive):
    """Mean z of the output in each true-positive cell minus the cell's true mean floor height.

    Args:
        grid: CellGrid.
        xyz: (N, 3) output points in the level frame [m].
        truth: FloorTruth on the same grid.
        true_positive: bool of the grid's shape.

    Returns:
        HeightErrors.
    """
    error = mean_height(grid, xyz) - truth.floor_z
    plain = true_positive & ~truth.edge_crossing
    crossed = true_positive & truth.edge_crossing
    return HeightErrors(np.where(plain, error, np.nan), np.where(crossed, error, np.nan))


def covered_share(xyz, sigma, truth):
    """Share of the claimed floor cells whose height error is within two of the sigmas stated.

    Cells that the edge of a step crosses are left out; a cell's sigma is the mean of its points'.

    Args:
        xyz: (N, 3) output points in the level frame [m], finite.
        sigma: (N,) one sigma of their heights [m].
        truth: FloorTruth.

    Returns:
        The share; None where no cell is scored.
    """
    grid = grids.CellGrid.of(truth)
    counts = truth.visible_floor & ~grids.ignored_cells(truth)
    error = height_errors(grid, xyz, truth, counts).cells
    stated = grids.cell_mean(grid, xyz, np.asarray(sigma, np.float64))
    scored = np.isfinite(error) & np.isfinite(stated)
    return _of(np.mean, np.abs(error[scored]) <= 2.0 * stated[scored])
