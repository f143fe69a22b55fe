"""Denoiser against neighbourhoods counted by hand. Thesis: Algorithm 1."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rooms import joined, view_of
from smoke_ground_reconstruction.params import AgdorParams
from smoke_ground_reconstruction.reference.agdor_filter import AgdorFilter
from smoke_ground_reconstruction.reference.label import Label
from smoke_ground_reconstruction.reference.scan import Scan

DIM, BRIGHT = 5.0, 50.0


def label_of_first(params, *views):
    return AgdorFilter(params).classify(Scan(joined(*views)))[0]


def candidate(position=(10, 0, 0)):
    return view_of([position], intensity=DIM)


def crowd(count, distance=1.0, position=(10, 0, 0)):
    """Bright points on a circle around a position, in its tangential plane."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    ring = np.stack([np.zeros(count), np.cos(angle), np.sin(angle)], axis=1)
    return view_of(np.array(position) + distance * ring, intensity=BRIGHT)


@pytest.mark.parametrize(
    ("neighbors", "label"),
    [(0, Label.NOISE), (100, Label.NOISE), (101, Label.KEPT), (5000, Label.KEPT),
     (5001, Label.NOISE)],
)  # fmt: skip
def test_dense_neighborhoods_are_kept_up_to_the_maximum(neighbors, label):
    """The point itself is not counted; more than 100 and at most 5000."""
    assert label_of_first(AgdorParams(), candidate(), crowd(neighbors)) == label


def test_no_maximum_where_it_is_zero():
    assert label_of_first(AgdorParams(max_neighbors=0), candidate(), crowd(5001)) == Label.KEPT


@pytest.mark.parametrize(
    ("intensity", "label"),
    [(24.99, Label.NOISE), (25.0, Label.KEPT), (math.nan, Label.KEPT), (-math.inf, Label.NOISE)],
)
def test_candidates_are_strictly_below_the_threshold(intensity, label):
    assert label_of_first(AgdorParams(), view_of([(5, 0, 0)], intensity)) == label


@pytest.mark.parametrize(("offset", "label"), [(1.999, Label.KEPT), (2.0, Label.NOISE)])
def test_a_point_at_the_radius_is_no_neighbor(offset, label):
    """SR = 0.5 * 0.4 * 10 m = 2 m; a neighbour is nearer than that."""
    params = AgdorParams(min_neighbors=0)
    other = view_of([(10 + offset, 0, 0)], BRIGHT)
    assert label_of_first(params, candidate(), other) == label


@pytest.mark.parametrize(("distance", "label"), [(9.9, Label.NOISE), (10.1, Label.KEPT)])
def test_the_radius_grows_with_range(distance, label):
    params = AgdorParams(min_neighbors=0)  # SR reaches 2 m at 10 m
    position = (0.6 * distance, 0, -0.8 * distance)
    other = view_of([(0.6 * distance, 2.0, -0.8 * distance)], BRIGHT)
    assert label_of_first(params, candidate(position), other) == label


def test_theta_in_radians_finds_nobody_at_the_default():
    """0.5 * 0.4 deg = 3.5 mm per metre: below the spacing of the points."""
    params = AgdorParams(theta_unit="radians", min_neighbors=0)
    assert params.radius_per_range() == pytest.approx(0.5 * 0.4 * math.pi / 180.0)
    spacing = 10.0 * math.radians(0.4)
    assert label_of_first(params, candidate(), crowd(8, spacing)) == Label.NOISE
    assert label_of_first(params, candidate(), crowd(8, 0.034)) == Label.KEPT


def test_alpha_scales_the_radius():
    views = candidate(), crowd(3, 3.0)
    params = AgdorParams(min_neighbors=0)
    assert label_of_first(params, *views) == Label.NOISE  # 2 m
    assert label_of_first(replace(params, alpha=0.8), *views) == Label.KEPT  # 3.2 m


def test_points_of_any_intensity_and_repeated_points_are_neighbors():
    params = AgdorParams(min_neighbors=2)
    dim_twins = view_of([(10, 0, 0), (10, 0, 0)], DIM)
    assert label_of_first(params, candidate(), dim_twins) == Label.NOISE
    bright_twin = view_of([(10, 0, 0)], BRIGHT)
    assert label_of_first(params, candidate(), dim_twins, bright_twin) == Label.KEPT


def test_invalid_points_are_labeled_so_and_are_no_neighbors():
    view = view_of([(1, 0, 0), (0, 0, 0), (math.nan, 0, 0), (0.95, 0, math.inf)], DIM)
    labels = AgdorFilter(AgdorParams(min_neighbors=0)).classify(Scan(view))
    assert labels.tolist() == [Label.NOISE, Label.INVALID, Label.INVALID, Label.INVALID]


def test_the_radius_may_reach_beyond_the_sensor():
    """With alpha * theta = 2 a point 1 m away sees what lies behind the sensor."""
    params = AgdorParams(alpha=2.0, theta_deg=1.0, min_neighbors=0)
    behind = view_of([(-0.9, 0, 0)], BRIGHT)
    assert label_of_first(params, candidate((1, 0, 0)), behind) == Label.KEPT


def test_empty_input_gives_empty_output():
    labels = AgdorFilter(AgdorParams()).classify(Scan(view_of([])))
    assert labels.shape == (0,)
    assert labels.dtype == np.uint8
