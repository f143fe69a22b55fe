"""A scan played to the running nodelets as a bag gives the floor that `reconstruct` gives."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from box_room import HEIGHT, box_room
from smoke_ground_reconstruction import replay as replay_module
from smoke_ground_reconstruction.cli import main
from smoke_ground_reconstruction.io import files
from smoke_ground_reconstruction.params import RECONSTRUCTION_METHODS

ROOT = Path(__file__).resolve().parents[2]
SCANS = Path(os.environ.get("SMOKE_GROUND_SCANS", ROOT / "../shared/data/scans"))


def replay(*arguments):
    """In a process of its own, for rospy joins one master a process."""
    command = [str(ROOT / "scripts/smoke_ground"), "replay", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def assert_nodelets_agree(tmp_path, scans, height, method):
    directly, played = str(tmp_path / "directly.bag"), str(tmp_path / "played.bag")
    options = ["--sensor-height", str(height), "--method", method]
    assert main(["reconstruct", scans, directly, *options]) == 0
    done = replay(scans, played, *options)
    assert done.returncode == 0, done.stderr
    expected, got = list(files.open_floors(directly)), list(files.open_floors(played))
    assert [floor.stamp_ns for floor in got] == [floor.stamp_ns for floor in expected]
    for a, b in zip(got, expected):
        assert len(a.xyz) > 0
        for name in ("xyz", "ring", "provenance", "intensity", "boundary", "boundary_kind"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        np.testing.assert_allclose(a.confidence, b.confidence, rtol=1e-6)
        if method == "polar_segments":
            assert len(a.walls) == len(b.walls) > 0
        else:  # the other nodelets slept
            assert a.walls is None and len(b.walls) == 0


@pytest.mark.parametrize("method", RECONSTRUCTION_METHODS)
def test_a_room_through_the_nodelets(tmp_path, method):
    path = str(tmp_path / "room.npz")
    files.write_scans(path, [box_room(rings=64, steps=450)])
    assert_nodelets_agree(tmp_path, path, HEIGHT, method)


@pytest.mark.parametrize("method", RECONSTRUCTION_METHODS)
def test_a_recorded_scan_through_the_nodelets(tmp_path, method):
    path = SCANS / "nebula_qt128_room/frame00_strongest.npz"
    if not path.exists():
        pytest.skip(f"no recorded scan {path} (SMOKE_GROUND_SCANS)")
    assert_nodelets_agree(tmp_path, str(path), 0.10, method)


def test_what_cannot_be_replayed_is_one_line(tmp_path, capsys):
    scans, bad = str(tmp_path / "room.npz"), tmp_path / "bad.yaml"
    files.write_scans(scans, [box_room(rings=8, steps=40)])
    bad.write_text("denoiser: {alpha: -1}\n")
    command = ["replay", scans, str(tmp_path / "o.bag"), "--sensor-height", "0.7"]
    assert main([*command, "--params", str(bad)]) == 1
    assert "alpha must be > 0" in capsys.readouterr().err
    assert main([*command, "--rate", "0"]) == 1
    assert "--rate must be above 0" in capsys.readouterr().err
    assert main(["replay", scans, "o.npz"]) == 1
    assert "ending must be .bag" in capsys.readouterr().err
    assert not (tmp_path / "o.bag").exists()


def test_what_roslaunch_complains_of_is_told():
    log = ["... logging\n", "\x1b[31mRLException: two files named\n", "  - a\n", "  - b\x1b[0m\n"]
    said = replay_module.complaint([*log, "see the log\n"])
    assert said.startswith("RLException: two files named - a - b")
    assert replay_module.complaint(["one\n", "two\n"]) == "two"
    assert replay_module.complaint([]) == "nothing"
