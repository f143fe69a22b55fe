"""Mean and worst of made-up records, and the tables that show them."""

import pytest

from smoke_ground_reconstruction.evaluation import report, tables
from smoke_ground_reconstruction.evaluation.summary import lookup, summarise


def floor(iou, precision, claimed=True, height=0.0):
    return {
        "true_positive": 10 if claimed else 0,
        "false_positive": 0,
        "iou": iou,
        "precision": precision,
        "recall": iou,
        "accuracy": iou,
        "f1": iou,
        "knowable_recall": None,
        "knowable_iou": None,
        "hole_claimed": 0,
        "height": {"mean": height, "median": height, "mean_abs": abs(height), "p95": abs(height)},
    }


def record(scene, seed, method="ours", bounded=True, **scores):
    return {
        "scene": scene,
        "level": "heavy",
        "seed": seed,
        "method": method,
        "bounded": bounded,
        "scores": {"times": {"denoise": float(seed)}, **scores},
    }


def rows_of(records):
    return {(row["method"], row["scene"]): row for row in summarise(records, ["0.2"])}


def test_mean_and_worst_of_two_scans():
    rows = rows_of(
        [
            record("box", 0, floor={"0.2": floor(0.9, 1.0, height=0.002)}),
            record("box", 1, floor={"0.2": floor(0.7, 0.8, height=-0.004)}),
        ]
    )
    row = rows["ours", "box"]
    assert row["iou@0.2"]["mean"] == pytest.approx(0.8)
    assert row["iou@0.2"]["worst"] == 0.7
    assert row["height_mean@0.2"]["mean"] == pytest.approx(-0.001)
    assert row["height_mean@0.2"]["worst"] == -0.004
    assert row["height_p95@0.2"]["worst"] == 0.004
    assert row["milliseconds"]["denoise"]["median"] == 0.5
    assert "knowable_recall@0.2" not in row


def test_silence_has_no_precision():
    """A scan that claims nothing has IoU 0 but does not pull the mean precision down."""
    silent = floor(0.0, 0.0, claimed=False)
    rows = rows_of(
        [
            record("box", 0, floor={"0.2": floor(0.9, 0.95)}),
            record("box", 1, floor={"0.2": silent}),
        ]
    )
    assert rows["ours", "box"]["iou@0.2"]["worst"] == 0.0
    assert rows["ours", "box"]["precision@0.2"] == {"mean": 0.95, "worst": 0.95, "scans": 1}
    assert lookup({"floor": {"0.2": silent}}, ("floor", "0.2", "precision")) is None


def test_bounded_scenes_are_summed_up_apart():
    rows = rows_of(
        [
            record("box", 0, floor={"0.2": floor(0.9, 1.0)}),
            record("windows", 0, bounded=False, floor={"0.2": floor(0.5, 1.0)}),
        ]
    )
    assert rows["ours", "bounded scenes"]["iou@0.2"]["mean"] == 0.9
    assert rows["ours", "all scenes"]["iou@0.2"]["mean"] == pytest.approx(0.7)


@pytest.mark.parametrize(("bounded", "group"), [(True, "bounded scenes"), (False, "all scenes")])
def test_groups_that_are_the_same_are_given_once(bounded, group):
    good = {"0.2": floor(0.9, 1.0)}
    rows = rows_of([record(name, 0, bounded=bounded, floor=good) for name in ("box", "hall")])
    assert set(rows) == {("ours", scene) for scene in ("box", "hall", group)}


def test_one_scene_has_no_groups():
    assert set(rows_of([record("box", 0, floor={"0.2": floor(0.9, 1.0)})])) == {("ours", "box")}


def test_refused_scans_are_counted():
    failed = {**record("box", 1), "error": "no rings"}
    del failed["scores"]
    row = rows_of([record("box", 0, floor={"0.2": floor(0.9, 1.0)}), failed])["ours", "box"]
    assert (row["scans"], row["failed"]) == (1, 1)


def test_floor_table_shows_mean_and_worst():
    rows = summarise([record("box", 0, floor={"0.2": floor(0.913, 1.0, height=0.0021)})], ["0.2"])
    text = tables.floor_table("Floor", rows, ["0.2"]).text()
    assert "0.91 / 0.91" in text
    assert "+2.1 / +2.1" in text


def test_denoising_by_range_is_pooled_over_scans():
    """Ring 0-1 m: 10 smoke points all removed and 30 half removed: 25 of 40."""

    def rings(points, removed):
        ring = {"from": 0.0, "to": 1.0, "smoke_points": points, "smoke_removed": removed}
        ring.update(floor_points=0, floor_kept=None, wall_points=4, walls_kept=1.0)
        return {"by_range": [ring]}

    records = [record("box", i, denoising=rings(*r)) for i, r in enumerate([(10, 1.0), (30, 0.5)])]
    table = tables.range_table("by range", records)
    assert table.rows == [["0 – 1", "0.62", "40", "–", "0", "1.00", "8"]]


def test_page_escapes_names_and_loads_nothing():
    table = tables.Table("a < b", ["method"], [["<script>"]], "x & y")
    page = report.page("T", [("Floor", report.table_html(table))])
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "http" not in page
    assert "src=" not in page


def test_feature_table_pairs_the_two_versions():
    ground = {"true_positive": 9, "false_positive": 1, "precision": 0.9, "recall": 0.5, "f1": 0.6}
    better = dict(ground, precision=0.95, recall=0.4)
    records = [
        record("box", 0, method="channel_original", ground=ground),
        record("box", 0, method="channel", ground=better),
        record("hall", 0, method="channel", ground=better),
    ]
    shown = tables.feature_table(summarise(records, ["0.2"])).rows
    assert shown[0] == ["box", "heavy", "0.9000", "0.9500", "0.5000", "0.4000"]
    assert "hall" not in [row[0] for row in shown]  # only one of the two was run there
