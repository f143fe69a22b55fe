"""Scores of points and the timing table on numbers worked out by hand."""

import numpy as np
import pytest

from smoke_ground_reconstruction.evaluation import printed, timing
from smoke_ground_reconstruction.evaluation.point_scores import denoising_score, segmentation_score


def flags(text):
    return np.array([letter == "x" for letter in text])


def test_denoising_score_by_class_and_range():
    """Four smoke points (three removed), two floor points (one kept), one wall point (kept)."""
    ranges = np.array([0.5, 0.5, 1.5, 1.0, 0.9, 2.5, 7.0])
    score = denoising_score(
        kept=flags("x....xx"),
        ranges=ranges,
        is_smoke=flags("xxxx..."),
        is_floor=flags("....xx."),
        is_wall=flags("......x"),
    )
    assert score["smoke_removed"] == pytest.approx(0.75)
    assert score["floor_kept"] == pytest.approx(0.5)
    assert score["walls_kept"] == 1.0
    assert score["kept_precision"] == pytest.approx(2 / 3)
    first, second = score["by_range"][:2]
    assert (first["smoke_points"], first["smoke_removed"], first["floor_kept"]) == (2, 0.5, 0.0)
    assert (second["from"], second["to"], second["smoke_points"]) == (1.0, 2.0, 2)
    assert second["floor_kept"] is None
    assert score["by_range"][-1]["to"] is None
    assert score["by_range"][-1]["walls_kept"] == 1.0


def test_segmentation_does_not_answer_for_its_denoiser():
    """Three true ground points, one of them removed before; one found, one false alarm."""
    score = segmentation_score(
        predicted=flags("x..x"), true=flags("xxx."), candidates=flags("xx.x")
    )
    assert (score["precision"], score["recall"]) == (0.5, 0.5)
    assert segmentation_score(flags("x..x"), flags("xxx."))["recall"] == pytest.approx(1 / 3)


def test_breakdown_adds_up():
    stages = dict(organise=1, denoise=9, segment=5, cluster=20, reconstruct=10, rasterize=5)
    rows = {row["component"]: row for row in timing.table_5_2(stages)}
    assert rows["Denoiser"]["seconds"] == pytest.approx(0.010)
    assert rows["Ground surface reconstruction"]["seconds"] == pytest.approx(0.035)
    assert rows["Full method"]["seconds"] == pytest.approx(0.150)
    assert rows["Full method"]["hz"] == pytest.approx(1 / 0.15)
    assert sum(row["share"] for row in rows.values()) == pytest.approx(2.0)  # the whole is a row
    assert rows["Ground and wall segmentation"]["printed_seconds"] == pytest.approx(0.02)


def test_breakdown_refuses_a_stage_it_would_lose():
    with pytest.raises(ValueError, match="stages fuse"):
        timing.breakdown({"denoise": 1.0, "fuse": 2.0})


def test_printed_table_is_consistent():
    """F1 and IoU follow from precision and recall within the rounding of two decimals."""
    for precision, _, recall, f1, iou in printed.TABLE_5_1.values():
        assert 2 * precision * recall / (precision + recall) == pytest.approx(f1, abs=0.011)
        assert f1 / (2 - f1) == pytest.approx(iou, abs=0.011)
