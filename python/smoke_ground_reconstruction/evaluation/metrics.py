"""Precision, accuracy, recall, F1 and IoU of a classification grid (thesis Table 5.1)."""

from dataclasses import dataclass

import numpy as np


def ratio(part, whole):
    """part / whole; 0 where there is no whole: who claims nothing earns nothing."""
    return part / whole if whole else 0.0


@dataclass(frozen=True)
class Counts:
    """Numbers of cells, or of points, of each outcome."""

    true_positive: int
    false_positive: int
    false_negative: int
    true_negative: int

    @classmethod
    def of_cells(cls, classification):
        """Count a grids.Classification; claims beyond the grid are false positives."""
        return cls(
            int(np.count_nonzero(classification.true_positive)),
            int(np.count_nonzero(classification.false_positive)) + classification.beyond,
            int(np.count_nonzero(classification.false_negative)),
            int(np.count_nonzero(classification.true_negative)),
        )

    @classmethod
    def of_points(cls, predicted, true):
        """Count two (N,) bool arrays, one entry a point."""
        return cls(
            int(np.count_nonzero(predicted & true)),
            int(np.count_nonzero(predicted & ~true)),
            int(np.count_nonzero(~predicted & true)),
            int(np.count_nonzero(~predicted & ~true)),
        )

    @property
    def claimed(self):
        return self.true_positive + self.false_positive

    @property
    def precision(self):
        return ratio(self.true_positive, self.claimed)

    @property
    def recall(self):
        return ratio(self.true_positive, self.true_positive + self.false_negative)

    @property
    def accuracy(self):
        right = self.true_positive + self.true_negative
        return ratio(right, right + self.false_positive + self.false_negative)

    @property
    def f1(self):
        twice = 2 * self.true_positive
        return ratio(twice, twice + self.false_positive + self.false_negative)

    @property
    def iou(self):
        union = self.true_positive + self.false_positive + self.false_negative
        return ratio(self.true_positive, union)

    def to_dict(self):
        """The counts and the five figures, plain numbers by name."""
        names = ("true_positive", "false_positive", "false_negative", "true_negative")
        figures = ("precision", "accuracy", "recall", "f1", "iou")
        return {name: getattr(self, name) for name in names + figures}
