"""Clustering: PCL's tree, the grid and the reference find the same clusters."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parity import as_partition, compiled_group
from rooms import read_scan, seeded_cloud, view_of
from smoke_ground_reconstruction.params import Params, SegmenterParams
from smoke_ground_reconstruction.reference.label import NO_CLUSTER, Label
from smoke_ground_reconstruction.reference.scan import Scan
from smoke_ground_reconstruction.reference.wall_clustering import WallClustering


def assert_parity(core, params, view, labels):
    expected = WallClustering(params).cluster(Scan(view), labels)
    for engine in ["grid", "kdtree"] if core.HAVE_PCL else ["grid"]:
        group = compiled_group(Params(segmenter=params), "segmenter.clustering")
        group.cluster_engine = engine
        actual = core.WallClustering(group).cluster(view.xyz, labels)
        np.testing.assert_array_equal(actual == NO_CLUSTER, expected == NO_CLUSTER)
        np.testing.assert_array_equal(as_partition(actual), as_partition(expected))
        np.testing.assert_array_equal(actual, expected)  # the numbering is part of the interface
    return expected


def wall_labels(view, seed=0):
    rng = np.random.default_rng(seed)
    return rng.choice([Label.WALL, Label.KEPT], len(view.xyz), p=[0.8, 0.2]).astype(np.uint8)


@pytest.mark.parametrize("seed", range(8))
def test_seeded_rooms(core, seed):
    view = seeded_cloud(seed)
    params = SegmenterParams(cluster_tolerance=0.12, min_cluster_size=20, max_cluster_size=0)
    clusters = assert_parity(core, params, view, wall_labels(view, seed))
    assert len(np.unique(clusters)) > 2


LIMITS = itertools.product([0.03, 0.3], [0.0, 0.03], [(1, 0), (4, 60)])


@pytest.mark.parametrize(("tolerance", "per_range", "sizes"), LIMITS)
def test_every_parameter(core, tolerance, per_range, sizes):
    params = SegmenterParams(
        cluster_tolerance=tolerance, cluster_tolerance_per_range=per_range,
        min_cluster_size=sizes[0], max_cluster_size=sizes[1],
    )  # fmt: skip
    cloud = seeded_cloud(6)
    view = cloud.select(np.arange(0, len(cloud.xyz), 3))
    assert_parity(core, params, view, wall_labels(view))


def test_real_scans(core, real_scan):
    view = read_scan(real_scan)
    assert_parity(core, SegmenterParams(), view, np.full(len(view.xyz), Label.WALL, np.uint8))


# On a lattice whole rows of points lie at exactly the tolerance, which is no link.
COORDINATE = st.one_of(
    st.integers(-4, 4).map(lambda i: i * 0.25),
    st.sampled_from([np.nan, np.inf, 1e6, 0.2499]),
    st.floats(-2, 2, width=32),
)
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), max_size=60)


@settings(max_examples=150, deadline=None)
@given(
    points=POINTS,
    tolerance=st.sampled_from([0.25, 0.5, 0.3]),
    per_range=st.sampled_from([0.0, 0.25]),
)
def test_odd_clouds(core, points, tolerance, per_range):
    params = SegmenterParams(
        cluster_tolerance=tolerance, cluster_tolerance_per_range=per_range,
        min_cluster_size=2, max_cluster_size=20,
    )  # fmt: skip
    view = view_of(points)
    assert_parity(core, params, view, np.full(len(points), Label.WALL, np.uint8))
