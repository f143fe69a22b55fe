"""AGDOR denoiser. Thesis: Section 3.2, Algorithm 1."""

import numpy as np
from scipy.spatial import cKDTree

from ..params import AgdorParams
from .label import Label
from .predicates import range_, squared_distance
from .scan import Scan

# A tree rounds in its own way: it is asked a hair narrower and a hair wider.
_HAIR = 1e-6


class AgdorFilter:
    """Adaptive group of density outlier removal.

    Points of intensity >= threshold are kept. Of the others those are kept whose count of
    neighbours within alpha * theta * range, the point itself not counted, is above
    ``min_neighbors`` and at most ``max_neighbors``.

    Reading: the listing keeps dense neighbourhoods, the text says smoke is the denser; the listing
    is followed.
    Deviation: the listing has no upper bound; Table A.1 prints "min. / max. cluster size
    100 / 5000", taken as both bounds.
    Deviation: theta's value and unit are printed nowhere. Degrees make the radius 0.2 r; radians
    3.5 mm per metre, in which no point has a neighbour.

    Raises ValueError on bad parameters.
    """

    def __init__(self, params: AgdorParams):
        params.validate()
        self.params = params

    def classify(self, scan: Scan):
        """One label per point, uint8 (N,): INVALID, KEPT or NOISE."""
        labels = np.full(len(scan), Label.KEPT, np.uint8)
        labels[~scan.valid] = Label.INVALID
        low = scan.valid & (scan.intensity < self.params.intensity_threshold)  # Step 1, lines 4-10
        candidates = np.flatnonzero(low)
        neighbors = count_neighbors(scan, candidates, self.params.radius_per_range())
        labels[candidates[~self._has_kept_density(neighbors)]] = Label.NOISE  # Step 2, lines 16-20
        return labels

    def _has_kept_density(self, neighbors):
        dense_enough = neighbors > self.params.min_neighbors
        if self.params.max_neighbors == 0:
            return dense_enough
        return dense_enough & (neighbors <= self.params.max_neighbors)


def count_neighbors(scan: Scan, queries, radius_per_range: float):
    """Valid points nearer to each query point than ``radius_per_range`` times its range.

    Algorithm 1 lines 13-15, over all valid points, the query point itself not counted. A neighbour
    is one with squared distance strictly below the squared radius.

    Parameters
    ----------
    scan : Scan
    queries : (M,) int64
        Indices of valid points.
    radius_per_range : float
        alpha * theta.

    Returns
    -------
    (M,) int64
    """
    if len(queries) == 0:
        return np.zeros(0, np.int64)
    points = scan.xyz[scan.valid]
    tree = cKDTree(points)
    centers = scan.xyz[queries]
    radii = radius_per_range * range_(centers)
    counts = tree.query_ball_point(centers, radii * (1.0 - _HAIR), return_length=True)
    wider = tree.query_ball_point(centers, radii * (1.0 + _HAIR), return_length=True)
    for i in np.flatnonzero(counts != wider):  # a point lies on the sphere: the predicate decides
        found = points[tree.query_ball_point(centers[i], radii[i] * (1.0 + _HAIR))]
        counts[i] = np.count_nonzero(squared_distance(found, centers[i]) < radii[i] * radii[i])
    return counts - 1


def count_neighbors_brute_force(scan: Scan, queries, radius_per_range: float):
    """:func:`count_neighbors` without a tree, in O(M N): what the engines are tested against."""
    points = scan.xyz[scan.valid]
    radii = radius_per_range * range_(scan.xyz[queries])
    counts = [
        np.count_nonzero(squared_distance(points, scan.xyz[query]) < radius * radius)
        for query, radius in zip(queries, radii)
    ]
    return np.array(counts, np.int64) - 1
