"""Methods by name, and a run over a world that is worked out by hand."""

import multiprocessing
import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest

from evaluation_truths import points_of_cells, rectangle_truth

pytest.importorskip("smoke_ground_reconstruction._core", reason="the package is not built")

from smoke_ground_reconstruction.evaluation import (
    methods,
    results,
    runner,
    scoring,
    tables,
    world,
)
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.journal import Journal, record_key
from smoke_ground_reconstruction.evaluation.scan_input import ScanInput
from smoke_ground_reconstruction.evaluation.summary import summarise
from smoke_ground_reconstruction.reference.label import Label


def scan_of(xyz, truth, intensity=None):
    xyz = np.asarray(xyz, dtype=np.float32)
    return ScanInput(
        xyz=xyz,
        intensity=np.full(len(xyz), 100.0, dtype=np.float32) if intensity is None else intensity,
        ring=np.zeros(len(xyz), dtype=np.uint16),
        truth=np.asarray(truth, dtype=np.uint8),
        sensor_height=0.7,
        T_world_sensor=np.eye(4),
    )


def half_floor():
    """Floor points of half the cells of a 6 x 4 floor, and one wall point."""
    truth = rectangle_truth()
    floor = points_of_cells(truth, truth.visible_floor)
    floor = floor[floor[:, 0] < 0]
    xyz = np.vstack([floor, [[0.55, 0.0, 0.5]]])
    classes = [world.Truth.FLOOR] * len(floor) + [world.Truth.WALL]
    return scan_of(xyz, classes), truth


def test_raw_cloud_claims_the_points_whose_truth_is_floor():
    scan, truth = half_floor()
    output = methods.method("raw_cloud").run(scan)
    scores = scoring.score_output(output, scan, {0.2: truth})
    assert scores["floor"]["0.2"]["iou"] == pytest.approx(0.5)
    assert "denoising" not in scores


def test_raw_cloud_band_is_cut_by_height():
    heights = [-0.81, -0.79, -0.61, -0.59]
    scan = scan_of([[1, 0, z] for z in heights], [0] * 4)
    kept = methods.method("raw_cloud_band").run(scan).surface[:, 2]
    assert kept == pytest.approx([-0.79, -0.61])


def test_intensity_threshold_is_scored_on_points():
    truth = [world.Truth.SMOKE, world.Truth.SMOKE, world.Truth.FLOOR, world.Truth.WALL]
    scan = scan_of([[1, 0, 0], [2, 0, 0], [2, 0, -0.7], [3, 0, 0]], truth)
    scan.intensity[:] = [3, 30, 4, 90]
    output = methods.method("intensity_threshold").run(scan)
    score = scoring.score_output(output, scan, {})["denoising"]
    assert (score["smoke_removed"], score["floor_kept"], score["walls_kept"]) == (0.5, 0.0, 1.0)


def test_visibility_is_scored_against_the_true_extinction():
    told = methods.Output(extinction=np.array([0.3, 0.05]))
    score = scoring.score_output(told, half_floor()[0], {}, 0.4)["visibility"]
    assert (score["true"], score["extinction"], score["sigma"]) == (0.4, 0.3, 0.05)
    assert score["error"] == pytest.approx(0.25)
    assert score["after_clear_air"] == {"extinction": None, "sigma": None, "error": None}
    in_clear_air = scoring.score_output(told, half_floor()[0], {}, 0.0)["visibility"]
    assert (in_clear_air["true"], in_clear_air["error"]) == (0.0, None)
    assert "visibility" not in scoring.score_output(methods.Output(), half_floor()[0], {}, 0.4)


def test_extinction_is_told_at_first_sight_and_after_a_look_at_clear_air():
    names = ("polar_segments", "room_boundary")
    plan = runner.Plan(names, ("large_hall",), ("very_heavy",), seeds=1)
    polar, room = (record["scores"] for record in runner.run(plan))
    assert "visibility" not in polar
    score = room["visibility"]
    (smoke,) = results.calibrations(plan)
    assert score["true"] == smoke["mean_extinction"] > 0.3
    assert score["after_clear_air"]["error"] < 0.2 < score["error"]
    row = summarise(runner.run(plan), ("0.2",))[1]
    assert row["extinction_after_clear_error"]["mean"] == score["after_clear_air"]["error"]
    table = tables.visibility_table("Visibility", [row])
    assert table.rows[0][4:6] == [
        f"{score['true']:.3f}",
        f"{score['after_clear_air']['extinction']:.3f}",
    ]


def test_composed_method_sees_only_what_the_denoiser_keeps():
    """The threshold removes a faint point; a stand-in calls all that is left ground."""
    seen = []

    def everything(scan, denoise):
        seen.append((len(scan), denoise))
        labels = np.full(len(scan), Label.GROUND, dtype=np.uint8)
        return methods.Output(surface=scan.xyz, labels=labels, times={"segment": 1.0})

    scan = scan_of([[1, 0, 0], [2, 0, 0], [3, 0, 0]], [0, 0, 0])
    scan.intensity[1] = 3
    second = methods.Method("all", "ground", "all", everything)
    first = methods.method("intensity_threshold")
    output = methods._composed("a+b", first, second).run(scan)
    assert seen == [(2, False)]
    assert output.kept.tolist() == [True, False, True]
    assert output.labels.tolist() == [Label.GROUND, Label.NOISE, Label.GROUND]
    assert set(output.times) == {"denoise", "segment"}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("magic", "unknown method 'magic' .known: raw_cloud, "),
        ("nowhere.yaml", "no parameter file 'nowhere.yaml'"),
        ("polar_segments+agdor", "'polar_segments.agdor' must be DENOISER.METHOD"),
    ],
)
def test_bad_names_are_refused_with_one_line(name, message):
    with pytest.raises(ValueError, match=message) as error:
        methods.method(name)
    assert "\n" not in str(error.value)


def test_parameter_file_is_a_method(tmp_path):
    path = tmp_path / "narrow.yaml"
    path.write_text("reconstructor:\n  segment_angle_deg: 5\n", encoding="utf-8")
    chosen = methods.method(str(path))
    assert (chosen.name, chosen.kind) == ("narrow", "pipeline")
    path.write_text("reconstructor:\n  segment_angel_deg: 5\n", encoding="utf-8")
    with pytest.raises(ValueError, match="segment_angel_deg"):
        methods.method(str(path))


@pytest.fixture
def tiny_world(monkeypatch):
    """Every scan is half_floor(); nothing is simulated."""
    monkeypatch.setattr(world, "scan", lambda *names: half_floor()[0])
    monkeypatch.setattr(world, "truth", lambda *names: half_floor()[1])
    monkeypatch.setattr(world, "extinction", lambda *names: 0.3)
    monkeypatch.setattr(world, "poses", lambda scene, which: ("centre",))
    monkeypatch.setattr(world, "is_bounded", lambda scene: True)
    monkeypatch.setattr(world, "fingerprint", lambda scene, sensor: "of box and sensor")


def plan(*names):
    return runner.Plan(names, ("box",), ("clear", "heavy"), seeds=2, cells=(0.2,))


def test_run_scores_every_method_on_every_scan(tiny_world):
    records = runner.run(plan("raw_cloud", "intensity_threshold"))
    assert [(r["level"], r["seed"], r["method"]) for r in records[:3]] == [
        ("clear", 0, "raw_cloud"),
        ("clear", 0, "intensity_threshold"),
        ("clear", 1, "raw_cloud"),
    ]
    assert len(records) == 8
    assert records[0]["scores"]["floor"]["0.2"]["recall"] == pytest.approx(0.5)
    assert records[0]["points"] == 13


def test_number_of_processes_changes_nothing(tiny_world):
    alone = runner.run(plan("raw_cloud"))
    assert runner.run(plan("raw_cloud"), processes=2) == alone


def test_refused_scan_does_not_end_the_run(tiny_world, monkeypatch):
    def refuse(scan, denoise):
        raise ValueError("too few points")

    stubborn = methods.Method("stubborn", "pipeline", "refuses", refuse)
    monkeypatch.setitem(methods.METHODS, "stubborn", stubborn)
    records = runner.run(plan("stubborn", "raw_cloud"))
    assert records[0]["error"] == "too few points"
    assert "scores" in records[1]


def interrupting_method(monkeypatch, at_call):
    """A reference method that is interrupted at its so-maniest call, once; and its calls."""
    calls = []

    def interrupt(scan, denoise):
        calls.append(len(calls) + 1)
        if len(calls) == at_call:
            raise KeyboardInterrupt
        return methods.Output(surface=scan.xyz)

    chosen = methods.Method("interrupting", "reference", "", interrupt)
    monkeypatch.setitem(methods.METHODS, "interrupting", chosen)
    return calls


def test_interrupted_run_goes_on_where_it_stopped(tiny_world, monkeypatch, tmp_path):
    calls = interrupting_method(monkeypatch, at_call=3)
    journal = Journal(tmp_path / "new" / "records.jsonl")
    with pytest.raises(KeyboardInterrupt):
        runner.run(plan("interrupting"), journal=journal)
    assert len(journal.read()) == 2
    records = runner.run(plan("interrupting"), journal=journal)
    assert len(calls) == 5  # two, the one that was interrupted, and it again with the last
    assert records == runner.run(plan("interrupting"))


def test_another_method_is_run_beside_the_kept_records(tiny_world, monkeypatch, tmp_path):
    calls = interrupting_method(monkeypatch, at_call=0)
    journal = Journal(tmp_path / "records.jsonl")
    runner.run(plan("interrupting"), journal=journal)
    records = runner.run(plan("raw_cloud", "interrupting"), journal=journal)
    assert len(calls) == 4
    assert [record["method"] for record in records] == ["raw_cloud", "interrupting"] * 4


def test_record_that_was_cut_off_is_made_again(tiny_world, monkeypatch, tmp_path):
    calls = interrupting_method(monkeypatch, at_call=0)
    journal = Journal(tmp_path / "records.jsonl")
    runner.run(plan("interrupting"), journal=journal)
    journal.path.write_bytes(journal.path.read_bytes()[:-20])
    records = runner.run(plan("interrupting"), journal=journal)
    assert (len(calls), len(records), len(journal.read())) == (5, 4, 4)


def test_kept_records_are_those_of_the_same_question(tiny_world, monkeypatch, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("reconstructor:\n  segment_angle_deg: 5\n", encoding="utf-8")
    names = (str(path), "agdor+raw_cloud")
    first = plan(*names).jobs()[0]
    keys = [record_key(first, name) for name in names]
    path.write_text("reconstructor:\n  segment_angle_deg: 4\n", encoding="utf-8")
    assert record_key(first, names[0]) != keys[0]
    assert record_key(first, names[1]) == keys[1]
    monkeypatch.setattr(world, "fingerprint", lambda scene, sensor: "another box")
    assert record_key(first, names[1]) != keys[1]
    assert len({record_key(job, "raw_cloud") for job in plan("raw_cloud").jobs()}) == 4


def test_run_that_is_told_to_stop_leaves_no_workers(tiny_world, monkeypatch, tmp_path):
    def stop(scan, denoise):
        os.kill(os.getppid(), signal.SIGTERM)
        return methods.Output(surface=scan.xyz)

    chosen = methods.Method("stopping", "reference", "", stop)
    monkeypatch.setitem(methods.METHODS, "stopping", chosen)
    with pytest.raises(KeyboardInterrupt):
        runner.run(plan("stopping"), processes=2, journal=Journal(tmp_path / "records.jsonl"))
    assert multiprocessing.active_children() == []
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_missing_baseline_is_left_out_with_a_line(monkeypatch):
    def missing():
        raise BaselineUnavailableError("not here")

    absent = methods.Method("absent", "ground", "", None, missing)
    monkeypatch.setitem(methods.METHODS, "absent", absent)
    with pytest.warns(UserWarning, match="left out absent: not here"):
        assert runner.available(("absent", "raw_cloud")) == ("raw_cloud",)


def test_scan_without_its_non_returns():
    scan = SimpleNamespace(
        xyz=np.array([[1, 0, 0], [0, 0, 0], [np.nan, 0, 0]], dtype=np.float32),
        intensity=np.array([5, 6, 7]),
        ring=np.array([1, 2, 3]),
        truth=np.array([1, 0, 0]),
        sensor_height=0.7,
        pose=np.eye(4),
    )
    cleaned = ScanInput.of(scan)
    assert cleaned.xyz.tolist() == [[1, 0, 0]]
    assert (cleaned.intensity.tolist(), cleaned.ring.tolist()) == ([5.0], [1])
