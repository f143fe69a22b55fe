"""The thesis's own way of making a ground truth, on floors worked out by hand."""

import numpy as np
import pytest

from evaluation_truths import points_of_cells, rectangle_truth
from smoke_ground_reconstruction.evaluation.thesis_table import (
    merge_floor_points,
    merged_truth,
    score_as_thesis,
    without_outliers,
)


def square(half=1.0, step=0.1, z=-0.7):
    side = np.arange(-half + step / 2, half, step)
    x, y = [grid.ravel() for grid in np.meshgrid(side, side)]
    return np.stack([x, y, np.full(x.shape, z)], axis=1)


def pose(x, y, yaw_deg):
    c, s = np.cos(np.deg2rad(yaw_deg)), np.sin(np.deg2rad(yaw_deg))
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0.7], [0, 0, 0, 1]])


def test_points_of_two_positions_meet_in_the_frame_of_a_third():
    """World point (3, 0, 0) from (2, 0) looking along y, and from the origin; seen from (1, 1)."""
    first = (np.array([[0.0, -1.0, -0.7]]), pose(2, 0, 90))
    second = (np.array([[3.0, 0.0, -0.7]]), pose(0, 0, 0))
    merged = merge_floor_points([first, second], pose(1, 1, 180))
    np.testing.assert_allclose(merged, [[-2, 1, -0.7], [-2, 1, -0.7]], atol=1e-12)


def test_floor_that_nobody_saw_inside_the_floor_is_filled():
    points = square()
    hidden = (np.abs(points[:, 0] - 0.5) < 0.2) & (np.abs(points[:, 1]) < 0.2)
    truth = merged_truth(points[~hidden], cell=0.2, disc_radius=0.3)
    assert np.count_nonzero(truth.visible_floor) == 100  # 2 m x 2 m
    assert truth.visible_floor.shape == (14, 14)  # 0.3 m around, in whole cells


def test_disc_under_the_sensor_is_filled_in_and_its_height_not_scored():
    """A scan that is blind within 0.5 m but sees all else, 10 mm too high."""
    points = square()
    truth = merged_truth(points, cell=0.2, disc_radius=0.5)
    seen = points[np.hypot(points[:, 0], points[:, 1]) > 0.5] + [0, 0, 0.01]
    score = score_as_thesis(seen, truth, sensor_height=0.7)
    assert score.counts.iou == 1.0
    assert score.heights.to_dict()["mean"] == pytest.approx(0.01)
    assert score.heights.to_dict()["cells"] < 100


def test_accuracy_has_the_margin_of_the_bounding_box():
    """14 x 14 cells, of which 100 are floor: an output of half the floor is right in 146."""
    points = square()
    truth = merged_truth(points, cell=0.2, disc_radius=0.0)
    half = points[points[:, 0] < 0]
    counts = score_as_thesis(half, truth, sensor_height=0.7).counts
    assert counts.recall == pytest.approx(0.5)
    assert counts.accuracy == pytest.approx(146 / 196)


def test_points_off_the_true_floor_are_removed_before_merging():
    """Floor of 6 x 4 cells: a point just beyond its edge, one beyond the grid, the floor's own."""
    truth = rectangle_truth(columns=6, rows=4)
    floor = points_of_cells(truth, truth.visible_floor)
    outliers = np.array([[0.61, 0.0, -0.7], [30.0, 0.0, -0.7]])
    np.testing.assert_array_equal(without_outliers(np.vstack([outliers, floor]), truth), floor)
