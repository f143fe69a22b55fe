"""The command line does what it says, and says in one line what is wrong."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml

from box_room import HEIGHT, box_room
from smoke_ground_reconstruction import Params, Pipeline
from smoke_ground_reconstruction.cli import main
from smoke_ground_reconstruction.io import files
from smoke_ground_reconstruction.params import RECONSTRUCTION_METHODS

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def room():
    return box_room(rings=64, steps=450)


@pytest.fixture
def room_npz(tmp_path, room):
    path = str(tmp_path / "room.npz")
    files.write_scans(path, [room])
    return path


@pytest.fixture
def two_scans(tmp_path, room):
    path = str(tmp_path / "two.bag")
    files.write_scans(path, [room, room])
    return path


def fails(capsys, *arguments) -> str:
    """Runs a command that must fail with one line on stderr; returns that line."""
    capsys.readouterr()
    assert main(list(arguments)) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("smoke_ground: error: ")
    return lines[0]


# --- reconstruct ----------------------------------------------------------------------------------


@pytest.mark.parametrize("method", RECONSTRUCTION_METHODS)
@pytest.mark.parametrize("engine", ["cpp", "python"])
def test_reconstruct_writes_what_the_pipeline_makes(tmp_path, room, room_npz, engine, method):
    output = str(tmp_path / "floor.npz")
    arguments = ["--method", method, "--sensor-height", str(HEIGHT), "--engine", engine]
    assert main(["reconstruct", room_npz, output, *arguments]) == 0
    params = Params.from_dict({"reconstructor": {"sensor_height": HEIGHT, "method": method}})
    expected = Pipeline(params, engine=engine).process(room.xyz, room.intensity, room.ring)
    (floor,) = files.open_floors(output)
    np.testing.assert_array_equal(floor.xyz, expected.surface)
    np.testing.assert_array_equal(floor.provenance, expected.provenance)
    np.testing.assert_array_equal(floor.boundary[:, :2], expected.boundary[:, :2])
    np.testing.assert_array_equal(floor.floor_plane, expected.floor_plane)


def test_a_bag_gives_a_bag_of_as_many_floors(tmp_path, two_scans):
    output = str(tmp_path / "floors.bag")
    assert main(["reconstruct", two_scans, output, "--sensor-height", "0.7"]) == 0
    assert len(files.open_floors(output)) == 2


def test_the_floor_is_the_same_in_whatever_file(tmp_path, room_npz):
    floors = {}
    for ending in (".npz", ".pcd", ".bag"):
        output = str(tmp_path / f"floor{ending}")
        assert main(["reconstruct", room_npz, output, "--sensor-height", "0.7"]) == 0
        (floors[ending],) = files.open_floors(output)
    for floor in floors.values():
        np.testing.assert_array_equal(floor.xyz, floors[".npz"].xyz)
        np.testing.assert_array_equal(floor.ring, floors[".npz"].ring)
        np.testing.assert_array_equal(floor.confidence, floors[".npz"].confidence)


def test_the_height_is_estimated_and_said_so(tmp_path, room_npz, capsys):
    output = str(tmp_path / "floor.npz")
    assert main(["reconstruct", room_npz, output, "--method", "polar_segments"]) == 0
    said = re.search(r"sensor height estimated as ([0-9.]+) m", capsys.readouterr().err)
    assert float(said[1]) == pytest.approx(HEIGHT, abs=0.003)
    (floor,) = files.open_floors(output)  # its plane is the height it was given
    assert floor.floor_plane[2] == pytest.approx(-float(said[1]))


def test_a_height_in_the_parameters_is_taken(tmp_path, room_npz, capsys):
    params = tmp_path / "params.yaml"
    params.write_text("reconstructor: {sensor_height: 0.65, method: polar_segments}\n")
    output = str(tmp_path / "floor.npz")
    assert main(["reconstruct", room_npz, output, "--params", str(params)]) == 0
    assert "estimated" not in capsys.readouterr().err
    assert files.open_floors(output)[0].floor_plane[2] == pytest.approx(-0.65)
    more = ["--params", str(params), "--sensor-height", "0.6"]
    assert main(["reconstruct", room_npz, output, *more]) == 0
    assert files.open_floors(output)[0].floor_plane[2] == pytest.approx(-0.6)


def test_parameters_reach_the_stages(tmp_path, room_npz):
    params = tmp_path / "params.yaml"
    params.write_text("segmenter: {min_range_step: 9.0}\n")  # no pair is ground
    output = str(tmp_path / "floor.npz")
    command = ["reconstruct", room_npz, output, "--sensor-height", "0.7"]
    command += ["--method", "polar_segments"]
    assert main(command) == 0
    assert (files.open_floors(output)[0].provenance == 0).any()
    assert main([*command, "--params", str(params)]) == 0
    assert (files.open_floors(output)[0].provenance == 1).all()


def test_a_known_sensor_gives_its_beams(tmp_path, room, room_npz, capsys):
    beams = tmp_path / "sensor.yaml"
    text = (ROOT / "config/vlp16.yaml").read_text()
    # The room's beams, as the scan itself shows them; then the same upside down.
    rows = [f"  - [{e:.3f}, 0]" for e in np.linspace(-50.0, 30.0, 64)]
    output = str(tmp_path / "floor.npz")
    command = ["reconstruct", room_npz, output, "--sensor-height", "0.7"]
    command += ["--method", "polar_segments", "--sensor"]
    head = text[: text.index("rings:")]
    floors = []
    for table in (rows, rows[::-1]):
        beams.write_text(head + "rings:\n" + "\n".join(table) + "\n")
        assert main([*command, str(beams)]) == 0
        floors.append(files.open_floors(output)[0])
    assert main(command[:-1]) == 0
    np.testing.assert_array_equal(floors[0].xyz, files.open_floors(output)[0].xyz)
    assert len(floors[1].xyz) != len(floors[0].xyz)
    assert "rings 0 to 15" in fails(capsys, *command, "vlp16")
    fails(capsys, *command, "no_such_sensor")


def test_no_height_and_no_floor_is_an_error(tmp_path, room, capsys):
    path = str(tmp_path / "walls.npz")
    walls = type(room)(*(v[room.xyz[:, 2] > -0.6] for v in (room.xyz, room.intensity, room.ring)))
    files.write_scans(path, [walls])
    line = fails(capsys, "reconstruct", path, str(tmp_path / "o.npz"))
    assert "give --sensor-height" in line and not (tmp_path / "o.npz").exists()


def test_a_scan_of_many_must_be_chosen(tmp_path, two_scans, capsys):
    output = str(tmp_path / "floor.npz")
    command = ["reconstruct", two_scans, output, "--sensor-height", "0.7"]
    assert "two.bag has 2 scans" in fails(capsys, *command)
    assert "no scan 2" in fails(capsys, *command, "--scan", "2")
    assert main([*command, "--scan", "1"]) == 0
    assert len(files.open_floors(output)) == 1


def test_bad_files_are_one_line(tmp_path, room_npz, capsys):
    output = str(tmp_path / "o.npz")
    assert "no.npz: No such file" in fails(capsys, "reconstruct", str(tmp_path / "no.npz"), output)
    assert "no.bag: No such file" in fails(capsys, "reconstruct", str(tmp_path / "no.bag"), output)
    assert "no.pcd: " in fails(capsys, "reconstruct", str(tmp_path / "no.pcd"), output)
    assert "ending must be one of" in fails(capsys, "reconstruct", room_npz, "floor.txt")
    nowhere = str(tmp_path / "nowhere" / "o.npz")
    height = ["--sensor-height", "0.7"]
    assert "no directory" in fails(capsys, "reconstruct", room_npz, nowhere, *height)
    empty = tmp_path / "empty.npz"
    np.savez(
        empty,
        **{n: np.zeros(0, "f4") for n in ("x", "y", "z", "intensity")},
        ring=np.zeros(0, "u2"),
    )
    assert "give --sensor-height" in fails(capsys, "reconstruct", str(empty), output)
    assert main(["reconstruct", str(empty), output, *height]) == 0
    assert len(files.open_floors(output)[0].xyz) == 0


def test_bad_parameters_are_one_line(tmp_path, room_npz, capsys):
    params = tmp_path / "params.yaml"
    command = ["reconstruct", room_npz, str(tmp_path / "o.npz"), "--params", str(params)]
    for text, complaint in [
        ("denoiser: {alhpa: 1}", "alhpa"),
        ("denoiser: {alpha: -1}", "alpha must be > 0, is -1"),
        ("alpha: 0.5\nalhpa: 1", "'alhpa' is a parameter of no nodelet"),
        ("- 1\n- 2", "not a mapping"),
        ("denoiser: [", "not YAML"),
    ]:
        params.write_text(text)
        assert complaint in fails(capsys, *command)


@pytest.mark.parametrize("height", ["0", "-1", "nan", "inf", "low"])
def test_a_bad_height_is_a_wrong_argument(room_npz, capsys, height):
    with pytest.raises(SystemExit) as stop:
        main(["reconstruct", room_npz, "o.npz", f"--sensor-height={height}"])
    assert stop.value.code == 2
    assert f"must be a number of metres above 0, is '{height}'" in capsys.readouterr().err


def test_debug_shows_where_an_error_comes_from(tmp_path):
    with pytest.raises(FileNotFoundError):
        main(["--debug", "reconstruct", str(tmp_path / "no.npz"), str(tmp_path / "o.npz")])


# --- convert --------------------------------------------------------------------------------------


def test_scans_go_round_all_formats(tmp_path, room, room_npz):
    names = [room_npz, *(str(tmp_path / name) for name in ("a.pcd", "b.bag", "c.npz"))]
    for source, target in zip(names, names[1:]):
        assert main(["convert", source, target]) == 0
    (scan,) = files.open_scans(names[-1])
    for name in ("xyz", "intensity", "ring"):
        np.testing.assert_array_equal(getattr(scan, name), getattr(room, name))
    np.testing.assert_allclose(scan.t, room.t, atol=1e-7)


def test_floors_go_round_all_formats(tmp_path, room_npz, capsys):
    floor_npz, again = str(tmp_path / "floor.npz"), str(tmp_path / "again.npz")
    assert main(["reconstruct", room_npz, floor_npz, "--sensor-height", "0.7"]) == 0
    assert main(["convert", floor_npz, str(tmp_path / "floor.bag")]) == 0
    assert main(["convert", str(tmp_path / "floor.bag"), again]) == 0
    (before,), (after,) = files.open_floors(floor_npz), files.open_floors(again)
    for name in ("xyz", "ring", "provenance", "confidence", "boundary_kind"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    # A bag holds no plane: it is fitted to the surface, and the outline stands on it.
    np.testing.assert_allclose(after.boundary, before.boundary, atol=1e-5)
    np.testing.assert_allclose(after.floor_plane, before.floor_plane, atol=1e-5)
    capsys.readouterr()
    assert main(["convert", again, str(tmp_path / "floor.pcd")]) == 0
    assert "without its outline" in capsys.readouterr().err


# --- params ---------------------------------------------------------------------------------------


def test_params_prints_the_defaults(capsys):
    assert main(["params"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == Params().to_dict()


def test_params_reads_what_dynamic_reconfigure_dumps(tmp_path, capsys):
    encoding = pytest.importorskip("dynamic_reconfigure.encoding")
    values = {"alpha": 0.25, "engine": "kdtree", "max_neighbors": 0}
    # As dynamic_reconfigure.client's get_configuration() returns it, groups and all.
    group = encoding.Config({**values, "id": 0, "parent": 0, "groups": encoding.Config()})
    dump = tmp_path / "denoiser.yaml"
    config = encoding.Config({**values, "groups": encoding.Config(Default=group)})
    dump.write_text(yaml.dump(config))
    assert "!!python/object" in dump.read_text()
    assert main(["params", str(dump)]) == 0
    printed = yaml.safe_load(capsys.readouterr().out)
    expected = Params().to_dict()
    expected["denoiser"].update(values)
    assert printed == expected


def test_later_parameter_files_overlay_earlier_ones(tmp_path):
    (tmp_path / "a.yaml").write_text("denoiser: {alpha: 0.1, theta_deg: 0.2}\n")
    (tmp_path / "b.yaml").write_text("alpha: 0.3\nsegment_angle_deg: 5.0\n")
    output = tmp_path / "out.yaml"
    sources = [str(tmp_path / "a.yaml"), str(tmp_path / "b.yaml")]
    assert main(["params", *sources, "--output", str(output)]) == 0
    params = Params.from_yaml(output)
    assert (params.denoiser.alpha, params.denoiser.theta_deg) == (0.3, 0.2)
    assert params.reconstructor.segment_angle_deg == 5.0


# --- view -----------------------------------------------------------------------------------------


def test_view_draws_floors_and_scans(tmp_path, room_npz):
    floor = str(tmp_path / "floor.npz")
    assert main(["reconstruct", room_npz, floor, "--sensor-height", "0.7"]) == 0
    for source in (floor, room_npz):
        picture = tmp_path / "picture.png"
        assert main(["view", source, str(picture)]) == 0
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_view_asks_for_what_it_needs(tmp_path, two_scans, room_npz, capsys, monkeypatch):
    assert "choose one by --scan" in fails(capsys, "view", two_scans, str(tmp_path / "a.png"))
    assert "ending must be .png" in fails(capsys, "view", room_npz, str(tmp_path / "a.jpg"))
    monkeypatch.delenv("DISPLAY", raising=False)
    assert "no display" in fails(capsys, "view", room_npz)


# --- the script -----------------------------------------------------------------------------------


def run_script(*arguments, path):
    environment = {"PATH": path, "HOME": os.environ.get("HOME", "/")}
    script = str(ROOT / "scripts/smoke_ground")
    return subprocess.run(
        [script, *arguments], env=environment, capture_output=True, text=True, check=False
    )


def test_the_script_needs_nothing_sourced_and_no_python_in_the_path(tmp_path):
    foreign = tmp_path / "python3"
    foreign.write_text("#!/bin/sh\necho a foreign python >&2\nexit 9\n")
    foreign.chmod(0o755)
    done = run_script("params", path=f"{tmp_path}:/usr/bin:/bin")
    assert done.returncode == 0, done.stderr
    assert yaml.safe_load(done.stdout) == Params().to_dict()


def test_the_script_passes_the_exit_status_on(tmp_path):
    done = run_script("reconstruct", "no.npz", "out.npz", path="/usr/bin:/bin")
    assert done.returncode == 1
    assert done.stderr == "smoke_ground: error: no.npz: No such file or directory\n"
