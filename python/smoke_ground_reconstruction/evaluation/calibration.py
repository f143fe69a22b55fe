"""Does confidence mean something? Claimed cells by how sure a method is of them.

A cell is as sure as the surest point in it: it is floor if any part of it is. Cells that count
neither way and cells that are not claimed (unknown) are left out.
"""

from dataclasses import dataclass

import numpy as np

from smoke_ground_reconstruction.evaluation import grids
from smoke_ground_reconstruction.evaluation.metrics import ratio

BINS = 10


@dataclass(frozen=True)
class Reliability:
    """Cells by confidence, in BINS bins of equal width.

    Attributes:
        cells: (BINS,) int64, number of cells.
        confidence: (BINS,) float64, sum of their confidences.
        right: (BINS,) int64, how many are floor.
        square: sum of the squared differences of confidence and truth over all cells.
    """

    cells: np.ndarray
    confidence: np.ndarray
    right: np.ndarray
    square: float

    @classmethod
    def of(cls, confidence, right):
        """Of cells with confidences (N,) from 0 to 1 and truths (N,) bool."""
        confidence, right = np.asarray(confidence, np.float64), np.asarray(right, bool)
        slot = np.minimum((confidence * BINS).astype(np.int64), BINS - 1)
        return cls(
            np.bincount(slot, minlength=BINS),
            np.bincount(slot, confidence, BINS),
            np.bincount(slot[right], minlength=BINS),
            float(((confidence - right) ** 2).sum()),
        )

    @classmethod
    def from_dict(cls, found):
        """What to_dict() wrote."""
        arrays = (np.array(found[name]) for name in ("cells", "confidence", "right"))
        return cls(*arrays, float(found["square"]))

    def to_dict(self):
        """Plain lists and numbers, for pooling over scans."""
        return {
            "cells": self.cells.tolist(),
            "confidence": self.confidence.tolist(),
            "right": self.right.tolist(),
            "square": self.square,
        }

    def __add__(self, other):
        return Reliability(
            self.cells + other.cells,
            self.confidence + other.confidence,
            self.right + other.right,
            self.square + other.square,
        )

    @property
    def total(self):
        """Number of cells."""
        return int(self.cells.sum())

    @property
    def expected_calibration_error(self):
        """Mean over cells of |mean confidence - share of floor| of their bin."""
        return ratio(float(np.abs(self.confidence - self.right).sum()), self.total)

    @property
    def brier(self):
        """Mean squared difference of confidence and truth."""
        return ratio(self.square, self.total)

    @property
    def constant_brier(self):
        """The Brier score of the best constant, the share of floor."""
        share = ratio(int(self.right.sum()), self.total)
        return share * (1.0 - share)

    def summary(self):
        """The figures by name."""
        return {
            "cells": self.total,
            "wrong": self.total - int(self.right.sum()),
            "expected_calibration_error": self.expected_calibration_error,
            "brier": self.brier,
            "constant_brier": self.constant_brier,
        }


def cell_confidence(xyz, confidence, truth):
    """Claimed cells that count.

    Args:
        xyz: (N, 3) points of the claimed floor in the truth's level frame [m].
        confidence: (N,) from 0 to 1.
        truth: FloorTruth.

    Returns:
        Index of each cell's surest point (K,) int64, its confidence (K,), and whether there is
        floor in the cell (K,) bool. Cells beyond the grid are wrong.
    """
    grid = grids.CellGrid.of(truth)
    rows, columns = grid.rows_columns(xyz)
    inside = grid.contains(rows, columns)
    key = rows * 1_000_003 + columns
    order = np.lexsort((-np.asarray(confidence, np.float64), key))
    surest = order[np.r_[True, np.diff(key[order]) != 0]] if len(order) > 0 else order
    at = rows[surest], columns[surest]
    floor, ignored = np.zeros(len(surest), bool), np.zeros(len(surest), bool)
    known = inside[surest]
    floor[known] = truth.visible_floor[at[0][known], at[1][known]]
    ignored[known] = grids.ignored_cells(truth)[at[0][known], at[1][known]]
    surest, floor = surest[~ignored], floor[~ignored]
    return surest, np.asarray(confidence, np.float64)[surest], floor


def reliability(xyz, confidence, truth):
    """Reliability of one scan's claimed cells; arguments of cell_confidence()."""
    _, sure, floor = cell_confidence(xyz, confidence, truth)
    return Reliability.of(sure, floor)


def pooled(found):
    """Sum of Reliability dicts; None of none."""
    sums = None
    for entry in found:
        one = Reliability.from_dict(entry)
        sums = one if sums is None else sums + one
    return sums
