"""Euclidean clustering of wall points. Thesis: Section 3.3 "Clustering", Table A.1."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..params import WallClusteringParams
from .label import NO_CLUSTER, Label
from .predicates import range_, squared_distance
from .scan import Scan

_HAIR = 1e-6


def are_linked(params: WallClusteringParams, a, b):
    """Are float32 (M, 3) points neighbours? squared distance < T^2 with
    T = cluster_tolerance + cluster_tolerance_per_range * min(range a, range b).

    Reading: the tolerance is printed as "dynamic" alone; hence the part proportional to range.
    """
    nearer = np.minimum(range_(a), range_(b))
    tolerance = params.cluster_tolerance + params.cluster_tolerance_per_range * nearer
    return squared_distance(a, b) < tolerance * tolerance


def find_components(params: WallClusteringParams, points):
    """Connected components of linked float32 (M, 3) points: int (M,), numbers in any order."""
    if len(points) == 0:
        return np.zeros(0, np.int64)
    farthest = float(np.max(range_(points)))
    widest = params.cluster_tolerance + params.cluster_tolerance_per_range * farthest
    pairs = cKDTree(points).query_pairs(widest * (1.0 + _HAIR), output_type="ndarray")
    pairs = pairs[are_linked(params, points[pairs[:, 0]], points[pairs[:, 1]])]
    links = coo_matrix((np.ones(len(pairs), bool), pairs.T), shape=(len(points),) * 2)
    return connected_components(links, directed=False)[1]


class WallClustering:
    """Clusters of wall points, the small and the large ones dropped.

    Raises ValueError on bad parameters.
    """

    def __init__(self, params: WallClusteringParams):
        WallClusteringParams.validate(params)
        self.params = params

    def cluster(self, scan: Scan, labels):
        """Cluster of each point, uint32 (N,).

        NO_CLUSTER where the point is no wall or its cluster has fewer than ``min_cluster_size`` or
        more than ``max_cluster_size`` points. Clusters count from 0 by their smallest point index.
        """
        walls = np.flatnonzero((labels == Label.WALL) & scan.valid)
        _, first, component, size = np.unique(
            find_components(self.params, scan.xyz[walls]),
            return_index=True,
            return_inverse=True,
            return_counts=True,
        )
        stays = self._has_kept_size(size)
        number = np.full(len(size), NO_CLUSTER, np.uint32)
        kept = np.flatnonzero(stays)
        number[kept[np.argsort(first[kept])]] = np.arange(len(kept))
        clusters = np.full(len(scan), NO_CLUSTER, np.uint32)
        clusters[walls] = number[component]
        return clusters

    def _has_kept_size(self, size):
        large_enough = size >= self.params.min_cluster_size
        if self.params.max_cluster_size == 0:
            return large_enough
        return large_enough & (size <= self.params.max_cluster_size)
