"""Clusters of points placed by hand. Thesis: Section 3.3 "Clustering"."""

from dataclasses import replace

import numpy as np
import pytest

from rooms import joined, view_of
from smoke_ground_reconstruction.params import WallClusteringParams
from smoke_ground_reconstruction.reference.label import NO_CLUSTER, Label
from smoke_ground_reconstruction.reference.scan import Scan
from smoke_ground_reconstruction.reference.wall_clustering import WallClustering

ANY_SIZE = WallClusteringParams(min_cluster_size=1, max_cluster_size=0)


def chain(count, spacing, start=(2.0, 0.0, 0.0)):
    offsets = spacing * np.arange(count)[:, None] * np.array([0.0, 1.0, 0.0])
    return view_of(np.array(start) + offsets)


def cluster(view, params, labels=None):
    labels = np.full(len(view.xyz), Label.WALL, np.uint8) if labels is None else labels
    return WallClustering(params).cluster(Scan(view), labels).tolist()


def test_a_chain_with_short_gaps_is_one_cluster():
    assert cluster(chain(20, 0.04), ANY_SIZE) == [0] * 20


def test_a_chain_with_wide_gaps_falls_apart():
    assert cluster(chain(4, 0.06), ANY_SIZE) == [0, 1, 2, 3]


@pytest.mark.parametrize(("spacing", "clusters"), [(0.25, [0, 1]), (0.2499, [0, 0])])
def test_points_at_the_tolerance_are_not_linked(spacing, clusters):
    assert cluster(chain(2, spacing), replace(ANY_SIZE, cluster_tolerance=0.25)) == clusters


def test_the_tolerance_grows_with_the_range_of_the_nearer_point():
    params = replace(ANY_SIZE, cluster_tolerance=0.05, cluster_tolerance_per_range=0.1)
    # Tolerance 0.25 m at 2 m, 0.45 m at 4 m.
    pair = [(2, 0, 0), (2.3, 0, 0)], [(4, 0, 0), (4.3, 0, 0)]
    assert cluster(view_of(pair[0]), params) == [0, 1]
    assert cluster(view_of(pair[1]), params) == [0, 0]


@pytest.mark.parametrize(
    ("size", "is_kept"), [(49, False), (50, True), (5000, True), (5001, False)]
)
def test_small_and_large_clusters_are_dropped(size, is_kept):
    clusters = cluster(chain(size, 0.001), WallClusteringParams())
    assert clusters == [0 if is_kept else NO_CLUSTER] * size


def test_unlimited_size():
    params = WallClusteringParams(max_cluster_size=0)
    assert cluster(chain(5001, 0.001), params) == [0] * 5001


def test_clusters_are_numbered_by_their_smallest_index():
    far, near = chain(3, 0.01, (9, 0, 0)), chain(2, 0.01, (1, 0, 0))
    lone = view_of([(5, 5, 5)])
    view = joined(lone, far, near, far)
    params = replace(ANY_SIZE, min_cluster_size=2)
    assert cluster(view, params) == [NO_CLUSTER] + [0] * 3 + [1] * 2 + [0] * 3


def test_only_wall_points_are_clustered():
    labels = np.array([Label.WALL, Label.GROUND, Label.WALL], np.uint8)
    # The ground point between them does not link the two.
    assert cluster(chain(3, 0.04), ANY_SIZE, labels) == [0, NO_CLUSTER, 1]


def test_no_walls():
    labels = np.full(3, Label.KEPT, np.uint8)
    assert cluster(chain(3, 0.04), ANY_SIZE, labels) == [NO_CLUSTER] * 3
    assert cluster(view_of([]), ANY_SIZE) == []
