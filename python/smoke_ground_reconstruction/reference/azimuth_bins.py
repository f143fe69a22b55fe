"""Equal bins of azimuth: the columns of a scan and the segments of the polar grid."""

import numpy as np

from ..params import require_divides_circle
from .predicates import Direction, is_at_or_after


class AzimuthBins:
    """Equal bins of azimuth [a, b) around the vertical, the first beginning at +x.

    They count counter-clockwise and serve the columns of a scan (0.4 deg) and the segments of the
    polar grid (10 deg; Algorithm 5 line 2).

    Reading: Algorithm 5 line 9 prints arctan(y / x) and closes both ends; here atan2 mod 360 and
    [a, b), so that every point is in one segment.

    Parameters
    ----------
    width_deg : float
        Angle of a bin [deg]; must divide 360 into 4 to 36,000 bins, else ValueError.
    """

    def __init__(self, width_deg: float):
        require_divides_circle("the width of an azimuth bin", width_deg)
        self._count = round(360.0 / width_deg)
        edges = [Direction.from_degrees(i * 360.0 / self._count) for i in range(self._count)]
        self._cosine = np.array([edge.cosine for edge in edges])
        self._sine = np.array([edge.sine for edge in edges])

    def count(self) -> int:
        """Number of bins."""
        return self._count

    def index(self, x, y):
        """Bin of each direction (x, y), float32 (N,) each; the axis (0, 0) is in bin 0.

        atan2 proposes; products with the bin's two edges decide. Returns int64 (N,).
        """
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        turns = np.arctan2(y, x) / (2.0 * np.pi)
        bins = np.floor(turns * self._count).astype(np.int64) % self._count
        bins = np.where(self._is_at_or_after(bins, x, y), bins, (bins - 1) % self._count)
        after = (bins + 1) % self._count
        bins = np.where(self._is_at_or_after(after, x, y), after, bins)
        return np.where((x == 0.0) & (y == 0.0), 0, bins)

    def _is_at_or_after(self, edge, x, y):
        return is_at_or_after(self._cosine[edge], self._sine[edge], x, y)


def around_columns(values, beside, fold):
    """Folds the values of each column and of so many to either side into one.

    Args:
        values: (columns,) one of each column.
        beside: columns to either side.
        fold: what makes one of them, as np.max, np.sum or np.any do along their `axis`.

    Returns:
        What `fold` makes of (2 beside + 1, columns) along the first axis.
    """
    return fold([np.roll(values, k) for k in range(-beside, beside + 1)], axis=0)
