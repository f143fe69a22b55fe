"""The calibration figures and the fit of the confidence on numbers worked out by hand."""

import numpy as np
import pytest

from evaluation_truths import points_of_cells, rectangle_truth
from smoke_ground_reconstruction.evaluation.calibration import (
    Reliability,
    cell_confidence,
    pooled,
    reliability,
)
from smoke_ground_reconstruction.evaluation.heights import covered_share

CONFIDENCE = [0.95, 0.95, 0.55, 0.15]
RIGHT = [True, False, True, False]


def test_figures_of_four_cells():
    found = Reliability.of(CONFIDENCE, RIGHT)
    assert found.cells.tolist() == [0, 1, 0, 0, 0, 1, 0, 0, 0, 2]
    # Bins: |1.90 - 1|, |0.55 - 1| and |0.15 - 0|, over four cells.
    assert found.expected_calibration_error == pytest.approx((0.90 + 0.45 + 0.15) / 4)
    assert found.brier == pytest.approx((0.0025 + 0.9025 + 0.2025 + 0.0225) / 4)
    assert found.constant_brier == pytest.approx(0.25)
    assert found.summary()["wrong"] == 2


def test_certainty_falls_into_the_last_bin():
    found = Reliability.of([1.0, 0.9], [True, True])
    assert found.cells[9] == 2
    assert found.brier == pytest.approx(0.005)


def test_pooling_is_the_same_as_all_cells_at_once():
    whole = Reliability.of(CONFIDENCE, RIGHT)
    parts = [Reliability.of([c], [r]).to_dict() for c, r in zip(CONFIDENCE, RIGHT)]
    assert pooled(parts).summary() == pytest.approx(whole.summary())
    assert pooled([]) is None


def test_a_cell_is_as_sure_as_its_surest_point():
    truth = rectangle_truth()
    one = points_of_cells(truth, truth.visible_floor)[:1]
    xyz = np.vstack([one, one + [0.05, 0.05, 0.0], one + [50.0, 0.0, 0.0]])
    at, sure, floor = cell_confidence(xyz, [0.3, 0.8, 0.6], truth)
    assert sorted(zip(at.tolist(), sure.tolist(), floor.tolist())) == [
        (1, 0.8, True),
        (2, 0.6, False),  # beyond the grid
    ]


def test_cells_that_count_neither_way_are_left_out():
    truth = rectangle_truth()
    xyz = points_of_cells(truth, truth.visible_floor)
    truth.under_sensor[:] = truth.visible_floor
    assert reliability(xyz, np.full(len(xyz), 0.5), truth).total == 0
    assert reliability(np.zeros((0, 3)), np.zeros(0), truth).total == 0


def test_two_sigma_cover_half_of_two_cells():
    truth = rectangle_truth()
    xyz = points_of_cells(truth, truth.visible_floor)[:2]
    xyz[:, 2] += [0.019, -0.021]  # 19 mm too high, 21 mm too low; two sigma are 20 mm
    assert covered_share(xyz, [0.010, 0.010], truth) == 0.5
    assert covered_share(xyz, [0.010, 0.011], truth) == 1.0
    assert covered_share(xyz[:0], [], truth) is None


def test_weights_that_give_the_shares_seen():
    fitting = pytest.importorskip("smoke_ground_reconstruction.evaluation.confidence_fit")
    # 9 of 10 right without the feature, 6 of 10 with it: logits ln 9 and ln 1.5.
    feature = np.repeat([0.0, 1.0], 10)
    right = np.arange(20) % 10 < np.where(feature > 0, 6, 9)
    features = np.column_stack([np.ones(20), feature])
    found = fitting.logistic_weights(features, right, np.full(20, 1e5))
    np.testing.assert_allclose(found, [np.log(9.0), np.log(1.5) - np.log(9.0)], rtol=1e-3)
