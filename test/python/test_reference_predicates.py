"""Predicates and azimuth bins against geometry worked out by hand."""

import math

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.azimuth_bins import AzimuthBins
from smoke_ground_reconstruction.reference.predicates import (
    AngleWindow,
    Direction,
    is_return,
    planar_range,
    range_,
    squared_distance,
)


def points(*rows):
    return np.array(rows, np.float32).reshape(-1, 3)


def test_distances_of_pythagorean_points():
    a = points((1, 2, 3))
    b = points((3, 5, 9))  # 2, 3, 6: 7 apart
    assert squared_distance(a, b).tolist() == [49.0]
    assert planar_range(points((3, -4, 12))).tolist() == [5.0]
    assert range_(points((3, -4, 12))).tolist() == [13.0]


def test_distances_are_float64_of_float32():
    # In float32 the square of 4097 = 16785409 would be rounded to 16785408.
    assert range_(points((4097, 0, 0))).tolist() == [4097.0]
    assert squared_distance(points((4097, 0, 0)), points((0, 0, 0))).tolist() == [16785409.0]


def test_returns_are_finite_near_and_not_zero():
    rows = [(1, 0, 0), (0, 0, -1), (0, 0, 0), (-0.0, 0, 0), (np.nan, 1, 1), (1, np.inf, 1)]
    rows += [(1e6, 0, 0), (1.1e6, 0, 0), (0, 1e30, 0)]
    expected = [True, True, False, False, False, False, True, False, False]
    assert is_return(points(*rows)).tolist() == expected


@pytest.mark.parametrize(
    ("angle_deg", "cosine", "sine"),
    [(0, 1, 0), (90, 0, 1), (180, -1, 0), (270, 0, -1), (-90, 0, -1), (360, 1, 0)],
)
def test_axes_are_exact_directions(angle_deg, cosine, sine):
    assert Direction.from_degrees(angle_deg) == (cosine, sine)


def test_directions_are_rounded_to_float32():
    direction = Direction.from_degrees(30.0)
    assert direction.sine == 0.5
    assert direction.cosine == float(np.float32(math.sqrt(0.75)))


@pytest.mark.parametrize(
    ("u", "v", "inside"),
    [
        (1.0, 1.0, True),  # 45 deg, an end
        (0.0, 2.0, True),  # 90 deg
        (-1.0, 1.0, True),  # 135 deg, the other end
        (1.0, 0.999, False),
        (-1.0, 0.999, False),
        (0.0, -1.0, False),  # opposite
        (0.0, 0.0, False),  # no angle
    ],
)
def test_windows_are_closed(u, v, inside):
    window = AngleWindow.from_degrees(45.0, 135.0)
    assert bool(window.contains(np.float64(u), np.float64(v))) is inside


def test_bins_are_half_open_and_count_from_plus_x():
    bins = AzimuthBins(90.0)
    rows = [(1, 0), (1, 1), (0, 1), (-1, 0), (-1, -0.0), (0, -1), (1, -1e-7)]
    x, y = np.array(rows, np.float32).T
    assert bins.index(x, y).tolist() == [0, 0, 1, 2, 2, 3, 3]


def test_a_point_on_an_edge_is_in_the_bin_that_begins_there():
    bins = AzimuthBins(45.0)
    assert bins.index(np.float32([2, -3]), np.float32([2, 3])).tolist() == [1, 3]


def test_the_axis_is_in_the_first_bin():
    assert AzimuthBins(0.4).index(np.float32([0, -0.0]), np.float32([0, -0.0])).tolist() == [0, 0]


def test_bins_agree_with_the_angle_away_from_edges():
    angles_deg = np.arange(0.2, 360.0, 0.4)
    x, y = np.cos(np.radians(angles_deg)), np.sin(np.radians(angles_deg))
    for scale in (1e-3, 1.0, 1e5):
        index = AzimuthBins(0.4).index(np.float32(scale * x), np.float32(scale * y))
        assert index.tolist() == list(range(900))


@pytest.mark.parametrize(("width_deg", "count"), [(0.4, 900), (10, 36), (0.01, 36000), (90, 4)])
def test_count_of_bins(width_deg, count):
    assert AzimuthBins(width_deg).count() == count


@pytest.mark.parametrize("width_deg", [7.0, 0.0, -10.0, 180.0, 0.009, math.nan, math.inf])
def test_widths_that_do_not_divide_the_circle_are_refused(width_deg):
    with pytest.raises(ValueError, match="the width of an azimuth bin must be"):
        AzimuthBins(width_deg)
