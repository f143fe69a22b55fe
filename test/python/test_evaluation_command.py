"""The commands `evaluate` and `figures` on the basic room."""

import json
from dataclasses import replace

import numpy as np
import pytest

from evaluation_truths import points_of_cells

pytest.importorskip("smoke_ground_reconstruction._core", reason="the package is not built")

from smoke_ground_reconstruction import cli, simulation
from smoke_ground_reconstruction.evaluation import methods, runner, world
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.yardstick import level_rotation
from smoke_ground_reconstruction.io import files, npz
from smoke_ground_reconstruction.io.clouds import Floor
from smoke_ground_reconstruction.simulation.scan import pose_matrix

ROOM = ("basic_room", "qt128", "position_5")


def error_line(capsys, *arguments):
    assert cli.main(list(arguments)) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["figures", "9.9", "out.png"], "no figure '9.9' (there are 2.1, "),
        (["evaluate", "--scenes", "moon"], "unknown scene 'moon' (known: "),
        (["evaluate", "--levels", "foggy"], "unknown level 'foggy' (known: clear, light"),
        (["evaluate", "magic"], "unknown method 'magic' (known: raw_cloud"),
        (["evaluate", "--seeds", "0"], "--seeds must be at least 1, not 0"),
        (["evaluate", "--result", "x.npz"], "--result needs one --scenes SCENE"),
        (
            ["evaluate", "--result", "x.npz", "--scenes", "ramp", "--truth", "t.npz"]
            + ["--levels", "heavy"],
            "--truth tells pose and smoke",
        ),
        (
            ["evaluate", "--result", "x.npz", "--scenes", "basic_room", "--levels", "clear"]
            + ["--pose", "roof"],
            "no pose 'roof'",
        ),
    ],
)
def test_bad_arguments_end_in_one_line(capsys, arguments, text):
    assert text in error_line(capsys, *arguments)


def test_interruption_says_in_one_line_how_to_go_on(capsys, monkeypatch, tmp_path):
    seen = []

    def run_job(job):
        seen.append(job.seed)
        if job.seed == 1 and len(seen) == 2:
            raise KeyboardInterrupt
        record = dict(job.describe(), method="raw_cloud", points=0, error="none")
        return [record]

    monkeypatch.setattr(runner, "run_job", run_job)
    arguments = ["evaluate", "raw_cloud", "--scenes", "empty_room", "--levels", "clear"]
    arguments += ["--seeds", "3", "--processes", "1", "--output", str(tmp_path)]
    assert cli.main(arguments) == 130
    line = f"interrupted; the same command goes on from {tmp_path}/records.partial.jsonl"
    assert capsys.readouterr().err.strip().splitlines() == [f"smoke_ground: {line}"]
    assert cli.main(arguments) == 0
    assert seen == [0, 1, 1, 2]
    assert "goes on after 1 of 3 scans" in capsys.readouterr().err
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["report.html", "results.json"]


def test_list_names_methods_scenes_and_levels(capsys):
    assert cli.main(["evaluate", "--list"]) == 0
    shown = capsys.readouterr().out
    assert "polar_segments" in shown
    assert "basic_room" in shown
    assert "very_heavy" in shown


def write_true_floor(path, cell, shift):
    truth = world.truth(*ROOM, cell, "clear")
    xyz = points_of_cells(truth, truth.visible_floor) + [shift, 0, 0]
    npz.write_floor(str(path), floor_of(xyz))
    return truth


def floor_of(xyz, stamp_ns=0):
    count = len(xyz)
    return Floor(
        xyz=xyz.astype(np.float32),
        ring=np.zeros(count, np.uint16),
        provenance=np.zeros(count, np.uint8),
        confidence=np.ones(count, np.float32),
        intensity=np.zeros(count, np.float32),
        stamp_ns=stamp_ns,
    )


def scores_of(path):
    folder = path.parent / "scores"
    arguments = ["--result", str(path), "--scenes", ROOM[0], "--levels", "clear"]
    assert cli.main(["evaluate", *arguments, "--output", str(folder)]) == 0
    assert "http" not in (folder / "report.html").read_text(encoding="utf-8")
    return json.loads((folder / "results.json").read_text(encoding="utf-8"))["floors"][0]


def test_true_floor_in_a_file_scores_one(tmp_path):
    path = tmp_path / "floor.npz"
    write_true_floor(path, 0.1, shift=0.0)
    scores = scores_of(path)
    for cell in ("0.2", "0.1"):
        assert scores[cell]["iou"] == 1.0
        assert scores[cell]["height"]["mean_abs"] < 1e-6


def test_shifted_floor_in_a_file_scores_what_the_shift_takes(tmp_path):
    """Shifted by one 0.2 m cell: the claimed cells move by one column, the ignored disc stays."""
    path = tmp_path / "floor.npz"
    truth = write_true_floor(path, 0.2, shift=0.2)
    counts = truth.visible_floor & ~truth.under_sensor
    claimed = np.roll(truth.visible_floor, 1, axis=1) & ~truth.under_sensor
    expected = np.count_nonzero(claimed & counts) / np.count_nonzero(claimed | counts)
    scores = scores_of(path)
    assert scores["0.2"]["iou"] == pytest.approx(expected)
    assert expected < 0.96


def test_floors_of_a_drive_are_scored_where_they_were_seen(capsys, tmp_path):
    """True floors at two places of the basic room, the second one turned by 90 deg and tilted."""
    poses = [world._pose_of(np.eye(4), 0.7)]
    poses = [replace(poses[0], at=(2.0, 2.0)), replace(poses[0], at=(4.0, 3.0), yaw_deg=90.0)]
    poses[1] = replace(poses[1], pitch_deg=2.0, roll_deg=-1.0)
    scene = simulation.load_scene("basic_room")
    matrices = [pose_matrix(scene, pose) for pose in poses]
    path, truth = tmp_path / "floors.bag", tmp_path / "truth.npz"
    floors = [true_floor_at(matrix, stamp) for stamp, matrix in enumerate(matrices, 10**18)]
    files.write_floors(str(path), floors)
    stamps = [floor.stamp_ns for floor in floors]
    same = {"sensor_height": [0.7, 0.7], "extinction": [0.0, 0.3]}
    np.savez(truth, stamp_ns=stamps, pose=matrices, **same)
    arguments = ["evaluate", "--result", str(path), "--scenes", "basic_room"]
    arguments += ["--output", str(tmp_path / "scores")]
    assert cli.main([*arguments, "--truth", str(truth)]) == 0
    found = json.loads((tmp_path / "scores/results.json").read_text(encoding="utf-8"))
    assert [floor["0.1"]["iou"] for floor in found["floors"]] == [1.0, 1.0]
    assert max(floor["0.1"]["height"]["mean_abs"] for floor in found["floors"]) < 1e-6
    capsys.readouterr()
    np.savez(truth, stamp_ns=[5], pose=matrices[:1], sensor_height=[0.7], extinction=[0.0])
    assert "no scan of stamp 1000000000000000000 ns" in error_line(
        capsys, *arguments, "--truth", str(truth)
    )


def true_floor_at(matrix, stamp):
    truth = world.truth_at("basic_room", "qt128", matrix, 0.7, 0.0, 0.1)
    level = points_of_cells(truth, truth.visible_floor)
    return floor_of(level @ level_rotation(matrix), stamp)


def test_figure_is_drawn_with_its_numbers(capsys, tmp_path):
    path = tmp_path / "figure.png"
    assert cli.main(["figures", "5.6", str(path)]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert numbers["Point cloud without smoke"]["recall"] > 0.9
    assert path.read_bytes().startswith(b"\x89PNG")


def test_figure_without_patchworkpp_takes_a_plane_in_its_place(capsys, monkeypatch, tmp_path):
    def missing():
        raise BaselineUnavailableError("not here")

    absent = replace(methods.METHODS["patchworkpp"], require=missing)
    monkeypatch.setitem(methods.METHODS, "patchworkpp", absent)
    assert cli.main(["figures", "2.5", str(tmp_path / "figure.png")]) == 0
    numbers = json.loads(capsys.readouterr().out)
    assert list(numbers) == ["ransac_plane_low", "channel_original"]


def test_page_sets_a_pipeline_beside_the_thesis(capsys, tmp_path):
    """Rows of the printed tables stand under ours, with the numbers the thesis prints."""
    arguments = ["polar_segments", "--scenes", "basic_room", "--seeds", "1", "--levels", "heavy"]
    arguments += ["--processes", "1", "--output", str(tmp_path)]
    assert cli.main(["evaluate", *arguments]) == 0
    shown = capsys.readouterr().out
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for title in ("Thesis Table 5.1", "Thesis Section 5.2.2", "Thesis Table 5.2"):
        assert title in shown
        assert title in page
    printed = next(line for line in shown.splitlines() if line.startswith("Reconstructed"))
    rows = [line.split() for line in shown.splitlines() if "printed " in line and "0.84" in line]
    assert "ours" in printed
    assert rows[0][-5:] == ["0.97", "0.86", "0.86", "0.91", "0.84"]
    for figure in ("5.2", "5.5", "5.6", "5.7"):
        assert f"As Figure {figure} of the thesis: polar_segments" in page


def test_evaluation_writes_numbers_and_a_page(capsys, tmp_path):
    arguments = ["raw_cloud", "intensity_threshold", "--scenes", "empty_room", "--seeds", "1"]
    arguments += ["--levels", "heavy", "--processes", "1", "--output", str(tmp_path)]
    assert cli.main(["evaluate", *arguments]) == 0
    shown = capsys.readouterr().out
    assert "IoU 0.2 m" in shown
    assert "smoke removed" in shown
    found = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    rows = {row["method"]: row for row in found["summary"]}
    assert rows["raw_cloud"]["iou@0.2"]["mean"] == pytest.approx(0.62, abs=0.1)
    assert rows["intensity_threshold"]["smoke_removed"]["mean"] > 0.99
    assert found["smoke"][0]["share"] == pytest.approx(0.66, abs=0.01)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "http" not in page
    assert "raw_cloud" in page
