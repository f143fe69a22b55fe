"""The yardstick against values worked out by hand on small floors."""

import numpy as np
import pytest

from evaluation_truths import MARGIN, points_of_cells, rectangle_truth
from smoke_ground_reconstruction.evaluation.grids import CellGrid, mean_height, occupancy
from smoke_ground_reconstruction.evaluation.metrics import Counts
from smoke_ground_reconstruction.evaluation.yardstick import (
    cell_share,
    level_rotation,
    score_floor,
    to_level,
)

EMPTY = np.zeros((0, 3))


def floor_points(truth, z=-0.7):
    return points_of_cells(truth, truth.visible_floor, z)


def test_true_floor_against_itself_is_perfect():
    truth = rectangle_truth()
    counts = score_floor(floor_points(truth), truth).counts
    figures = (counts.precision, counts.accuracy, counts.recall, counts.f1, counts.iou)
    assert figures == (1.0, 1.0, 1.0, 1.0, 1.0)


def test_empty_cloud_scores_zero():
    truth = rectangle_truth()
    score = score_floor(EMPTY, truth)
    counts = score.counts
    assert (counts.precision, counts.recall, counts.f1, counts.iou) == (0.0, 0.0, 0.0, 0.0)
    assert counts.accuracy == pytest.approx((80 - 24) / 80)  # 10 x 8 cells, 6 x 4 of them floor
    assert score.heights.to_dict()["mean"] is None
    assert score.knowable_recall == 0.0


def test_floor_shifted_by_one_cell():
    """6 x 4 cells moved by one column: 20 right, 4 too many, 4 missing, of 80 cells."""
    truth = rectangle_truth(columns=6, rows=4)
    shifted = floor_points(truth) + [truth.cell, 0, 0]
    counts = score_floor(shifted, truth).counts
    assert (counts.true_positive, counts.false_positive, counts.false_negative) == (20, 4, 4)
    assert counts.iou == pytest.approx(20 / 28)
    assert counts.precision == pytest.approx(5 / 6)
    assert counts.recall == pytest.approx(5 / 6)
    assert counts.f1 == pytest.approx(5 / 6)
    assert counts.accuracy == pytest.approx(72 / 80)


@pytest.mark.parametrize("claimed", [False, True])
def test_out_of_sight_floor_counts_neither_way(claimed):
    truth = rectangle_truth()
    truth.visible_floor[:, MARGIN] = False
    truth.out_of_sight[MARGIN:-MARGIN, MARGIN] = True
    cells = truth.visible_floor | truth.out_of_sight if claimed else truth.visible_floor
    counts = score_floor(points_of_cells(truth, cells), truth).counts
    assert counts.iou == 1.0
    assert counts.accuracy == 1.0
    assert counts.true_positive == 20


def test_cell_with_any_visible_floor_counts_as_floor():
    truth = rectangle_truth()
    truth.out_of_sight[MARGIN, MARGIN] = True  # partly seen, partly not
    counts = score_floor(EMPTY, truth).counts
    assert counts.false_negative == 24


@pytest.mark.parametrize("claimed", [False, True])
def test_disc_under_the_sensor_is_ignored(claimed):
    truth = rectangle_truth()
    truth.under_sensor[3:5, 4:6] = True
    cells = truth.visible_floor if claimed else truth.visible_floor & ~truth.under_sensor
    counts = score_floor(points_of_cells(truth, cells), truth).counts
    assert counts.true_positive == 20
    assert counts.iou == 1.0


@pytest.mark.parametrize("out_of_sight", [False, True])
def test_claim_over_a_hole_is_a_false_positive(out_of_sight):
    truth = rectangle_truth()
    truth.hole[MARGIN:-MARGIN, -MARGIN - 1] = True
    truth.visible_floor &= ~truth.hole
    truth.out_of_sight |= truth.hole & out_of_sight
    cells = truth.visible_floor | truth.hole
    score = score_floor(points_of_cells(truth, cells), truth)
    assert score.counts.false_positive == 4
    assert score.counts.iou == pytest.approx(20 / 24)
    assert (score.hole_cells, score.hole_claimed) == (4, 4)


def pit_truth():
    """6 x 4 cells of floor; its last column is a pit, the one before the pit's rim."""
    truth = rectangle_truth(columns=6, rows=4)
    truth.hole[MARGIN:-MARGIN, -MARGIN - 1] = True
    truth.visible_floor &= ~truth.hole
    truth.hole_rim[MARGIN:-MARGIN, -MARGIN - 2] = True
    return truth


def test_precision_at_a_hole_counts_its_cells_and_its_rim_alone():
    """All 20 floor cells and one of the pit's four: 4 right and 1 wrong at the hole."""
    truth = pit_truth()
    cells = truth.visible_floor.copy()
    cells[MARGIN, -MARGIN - 1] = True
    score = score_floor(points_of_cells(truth, cells), truth)
    assert score.hole_precision == pytest.approx(4 / 5)
    assert score.counts.precision == pytest.approx(20 / 21)
    assert score.to_dict()["hole_precision"] == score.hole_precision


def test_who_claims_nothing_at_a_hole_has_no_precision_there():
    truth = pit_truth()
    cells = truth.visible_floor & ~truth.hole_rim
    assert score_floor(points_of_cells(truth, cells), truth).hole_precision is None
    assert score_floor(floor_points(truth), rectangle_truth()).hole_precision is None


def test_claims_beyond_the_grid_are_false_positives():
    """Two points of one cell and one of another, 10 m away."""
    truth = rectangle_truth()
    far = [[10.01, 0.01, -0.7], [10.02, 0.01, -0.7], [-10.01, 0.01, -0.7]]
    counts = score_floor(np.vstack([floor_points(truth), far]), truth).counts
    assert counts.false_positive == 2
    assert counts.precision == pytest.approx(24 / 26)


def test_unknowable_floor_counts_neither_way_in_the_knowable_figures():
    truth = rectangle_truth()
    truth.knowable[:, :5] = False  # three of the floor's six columns
    cells = truth.knowable.copy()
    cells[:, MARGIN] |= truth.visible_floor[:, MARGIN]  # a lucky claim
    score = score_floor(points_of_cells(truth, cells), truth)
    assert score.knowable_recall == 1.0
    assert score.knowable_iou == 1.0
    assert score.counts.recall == pytest.approx(16 / 24)


def test_heights_are_exact_on_known_offsets():
    """Left half 30 mm too low, right half 10 mm too high, two points a cell."""
    truth = rectangle_truth(columns=6, rows=4)
    xyz = floor_points(truth)
    offset = np.where(xyz[:, 0] < 0, -0.03, 0.01)
    low, high = xyz.copy(), xyz.copy()
    low[:, 2] += offset - 0.005
    high[:, 2] += offset + 0.005
    figures = score_floor(np.vstack([low, high]), truth).heights.to_dict()
    assert figures["cells"] == 24
    assert figures["mean"] == pytest.approx(-0.01)
    assert figures["median"] == pytest.approx(-0.01)
    assert figures["mean_abs"] == pytest.approx(0.02)
    assert figures["p95"] == pytest.approx(0.03)


def test_height_of_false_claims_does_not_count():
    truth = rectangle_truth()
    wrong = points_of_cells(truth, ~truth.visible_floor, z=5.0)
    figures = score_floor(np.vstack([floor_points(truth), wrong]), truth).heights.to_dict()
    assert figures["mean_abs"] == pytest.approx(0.0, abs=1e-12)


def test_cells_crossed_by_a_step_are_scored_apart():
    truth = rectangle_truth(columns=6, rows=4)
    truth.edge_crossing[:, 4] = True
    xyz = floor_points(truth)
    xyz[np.abs(xyz[:, 0] - (truth.origin[0] + 4.5 * truth.cell)) < 0.01, 2] += 0.1
    figures = score_floor(xyz, truth).heights.to_dict()
    assert (figures["cells"], figures["edge_cells"]) == (20, 4)
    assert figures["mean"] == pytest.approx(0.0, abs=1e-12)
    assert figures["edge_mean_abs"] == pytest.approx(0.1)


def test_points_are_drawn_into_half_open_cells():
    grid = CellGrid((0.0, 0.0), 0.5, (2, 2))
    xyz = [[0.0, 0.0, 1.0], [0.5, 0.25, 2.0], [0.6, 0.25, 4.0], [np.nan, 0.1, 0.0]]
    assert occupancy(grid, xyz).cells.tolist() == [[True, True], [False, False]]
    z = mean_height(grid, xyz)
    assert z[0].tolist() == [1.0, 3.0]
    assert np.isnan(z[1]).all()


def test_points_of_a_wrong_shape_are_refused():
    with pytest.raises(ValueError, match=r"points must be \(N, 3\), not \(5, 2\)"):
        score_floor(np.zeros((5, 2)), rectangle_truth())


def test_counts_of_points():
    predicted = np.array([True, True, False, False, True])
    true = np.array([True, False, True, False, True])
    assert Counts.of_points(predicted, true) == Counts(2, 1, 1, 1)


def test_share_of_cells_that_smoke_leaves():
    """18 of the 24 cells were seen in clear air; smoke leaves 12 of them and adds one."""
    truth = rectangle_truth(columns=6, rows=4)
    clear = truth.visible_floor.copy()
    clear[MARGIN, :] = False
    smoke = clear.copy()
    smoke[MARGIN + 1, :] = False
    smoke[MARGIN, MARGIN] = True
    share = cell_share(points_of_cells(truth, smoke), points_of_cells(truth, clear), truth)
    assert share == pytest.approx(12 / 18)


def test_level_frame_keeps_heading_and_takes_out_tilt():
    """A sensor turned by 90 deg and nose down by 10 deg sees the true vertical after levelling."""
    pitch = np.deg2rad(10.0)
    yaw = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    nose_down = np.array(
        [
            [np.cos(pitch), 0, np.sin(pitch)],
            [0, 1, 0],
            [-np.sin(pitch), 0, np.cos(pitch)],
        ]
    )
    R_world_sensor = yaw @ nose_down
    down_in_sensor = R_world_sensor.T @ [0, 0, -0.7]
    np.testing.assert_allclose(to_level([down_in_sensor], R_world_sensor), [[0, 0, -0.7]])
    np.testing.assert_allclose(level_rotation(R_world_sensor), nose_down, atol=1e-12)
