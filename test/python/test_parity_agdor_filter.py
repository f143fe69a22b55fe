"""Denoiser: window, KD-tree, reference and brute force decide alike, point by point."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parity import compiled_group
from rooms import read_scan, seeded_cloud, view_of
from smoke_ground_reconstruction.params import AgdorParams, Params
from smoke_ground_reconstruction.reference.agdor_filter import (
    AgdorFilter,
    count_neighbors,
    count_neighbors_brute_force,
)
from smoke_ground_reconstruction.reference.scan import Scan

# alpha * theta from a few neighbours to the whole cloud: inside, at and beyond the range.
RADII = [0.0035, 0.02, 0.2, 0.7, 0.999, 1.0, 1.5, 3.0]


def params_of(radius_per_range, min_neighbors=100, max_neighbors=5000):
    return AgdorParams(
        alpha=radius_per_range, theta_deg=1.0,
        min_neighbors=min_neighbors, max_neighbors=max_neighbors,
    )  # fmt: skip


def compiled_labels(core, params, view, engine):
    group = compiled_group(Params(denoiser=params), "denoiser")
    group.engine = engine
    return core.AgdorFilter(group).classify(view.xyz, view.intensity)


def engines_of(core):
    return ["window", "kdtree"] if core.HAVE_PCL else ["window"]


def assert_parity(core, params, view):
    expected = AgdorFilter(params).classify(Scan(view))
    for engine in engines_of(core):
        labels = compiled_labels(core, params, view, engine)
        np.testing.assert_array_equal(labels, expected, err_msg=f"{engine}, {params}")


def assert_reference_is_exact(view, radius_per_range):
    scan = Scan(view)
    points = np.flatnonzero(scan.valid)
    np.testing.assert_array_equal(
        count_neighbors(scan, points, radius_per_range),
        count_neighbors_brute_force(scan, points, radius_per_range),
    )


@pytest.mark.parametrize("seed", range(8))
def test_seeded_rooms(core, seed):
    assert_parity(core, AgdorParams(), seeded_cloud(seed))


@pytest.mark.parametrize("radius_per_range", RADII)
@pytest.mark.parametrize("limits", [(0, 0), (3, 20), (40, 200)])
def test_any_radius_and_limit(core, radius_per_range, limits):
    cloud = seeded_cloud(5)
    view = cloud.select(np.arange(0, len(cloud.xyz), 6))
    assert_parity(core, params_of(radius_per_range, *limits), view)


@pytest.mark.parametrize("radius_per_range", RADII)
def test_reference_counts_as_brute_force(radius_per_range):
    cloud = seeded_cloud(2)
    assert_reference_is_exact(cloud.select(np.arange(0, len(cloud.xyz), 10)), radius_per_range)


def test_theta_in_radians(core):
    params = AgdorParams(alpha=8.0, theta_unit="radians", min_neighbors=2, max_neighbors=30)
    assert_parity(core, params, seeded_cloud(3))


def test_real_scans(core, real_scan):
    view = read_scan(real_scan)
    assert_parity(core, AgdorParams(), view)
    assert_parity(core, AgdorParams(alpha=0.05, min_neighbors=3, max_neighbors=12), view)


# A lattice makes equal distances, and points exactly at the radius, the rule instead of chance.
COORDINATE = st.one_of(
    st.integers(-4, 4).map(lambda i: i * 0.25),
    st.sampled_from([np.nan, np.inf, -0.0, 1e-30, -1e-7, 1e6]),
    st.floats(-10, 10, width=32),
)
POINTS = st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), max_size=60)


@settings(max_examples=150, deadline=None)
@given(
    points=POINTS,
    radius_per_range=st.sampled_from([0.25, 0.5, 1.0, 1.25, 0.1]),
    min_neighbors=st.integers(0, 6),
    extra=st.integers(0, 8),
)
def test_odd_clouds(core, points, radius_per_range, min_neighbors, extra):
    view = view_of(points, intensity=0.0)
    max_neighbors = min_neighbors + extra if extra > 0 else 0
    assert_parity(core, params_of(radius_per_range, min_neighbors, max_neighbors), view)
    assert_reference_is_exact(view, radius_per_range)
