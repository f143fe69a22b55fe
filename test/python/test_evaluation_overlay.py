"""Smoke over recorded rooms: the clear scan's truth by hand, and the command on real scans."""

import json

import numpy as np
import pytest

pytest.importorskip("smoke_ground_reconstruction._core", reason="the package is not built")

from smoke_ground_reconstruction import cli
from smoke_ground_reconstruction.evaluation import methods, overlay

SENSORS = {"nebula_qt128_room": "qt128", "nebula_vlp32c_room": "vlp32c"}
SENSORS.update(nebula_xt16_room="xt16", ouster_os0_128_office="os0_128")


def square_room(half=2.0, height=0.5, slope=0.02):
    """Floor returns every 0.05 m and walls of a square room around the sensor, (N, 3); and which
    of them are floor."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(-half + 0.025, half, 0.05)] * 2))
    floor = np.column_stack([x, y, slope * x - height])
    along, up = (axis.ravel() for axis in np.meshgrid(np.arange(-half, half, 0.01), [0.2, 0.6, 1]))
    side = np.full(len(along), half)
    walls = [np.column_stack(wall) for wall in ((side, along, up), (along, side, up))]
    walls += [wall * [-1, -1, 1] for wall in walls]
    xyz = np.vstack([floor, *walls])
    return xyz, np.arange(len(xyz)) < len(floor)


def room():
    return overlay.ClearRoom.of(*square_room())


def output_of(surface, **more):
    return methods.Output(surface=np.asarray(surface, dtype=float), **more)


def scored(surface, survivors=None, hard=None, **more):
    xyz, _ = square_room()
    return overlay.score(
        room(),
        xyz[:10] if survivors is None else survivors,
        xyz if hard is None else hard,
        output_of(surface, **more),
    )


def test_clear_room_is_its_plane_cells_and_reach():
    found = room()
    assert found.plane == pytest.approx([0.02, 0.0, -0.5], abs=1e-9)
    assert len(found.cells[0.2]) == 20 * 20
    assert len(found.cells[0.1]) == 40 * 40
    assert found.reach[0] == pytest.approx(2.0, abs=0.001)
    assert found.reach[44] == pytest.approx(2.0 / np.cos(np.radians(44.5)), abs=0.04)


def test_plane_is_that_of_the_larger_area_not_of_the_denser_returns():
    """A table top of 0.6 x 0.6 m, 30 mm above the floor and ten times as dense."""
    xyz, is_floor = square_room(slope=0.0)
    top = np.random.default_rng(1).uniform([0.5, 0.5, -0.47], [1.1, 1.1, -0.47], (30000, 3))
    plane, _ = overlay.fitted_plane(np.vstack([xyz[is_floor], top]))
    assert plane == pytest.approx([0.0, 0.0, -0.5], abs=2e-3)


def test_recovered_is_the_share_of_the_clear_floor():
    xyz, is_floor = square_room()
    floor = xyz[is_floor]
    found = scored(floor[floor[:, 0] > 0], survivors=floor[floor[:, 1] > 1])
    assert found["recovered@0.2"] == pytest.approx(0.5)
    assert found["raw@0.1"] == pytest.approx(0.25)
    assert found["beyond_cells"] == 0
    assert found["plane_height"] is None


def test_knowable_are_cells_before_what_is_seen_and_cells_seen_themselves():
    """Of the walls that at x = 2 alone is left: it tells of the quarter of the floor before it, and
    of the cells its edges cut. Four returns at (-1.1, 0.1) tell of their own cell, and of nothing
    behind it."""
    xyz, is_floor = square_room()
    cells = room().cells[0.2]
    wall = xyz[~is_floor & (xyz[:, 0] == 2.0)]
    east = overlay.is_knowable(cells, 0.2, wall)
    middle = 0.2 * (cells + 0.5)
    is_before = middle[:, 0] > np.abs(middle[:, 1])
    assert east[is_before].all()
    outside = np.abs(middle[:, 1]) - middle[:, 0]
    assert not east[outside > 0.41].any()  # farther than a cell's diagonal and a column
    lone = np.array([[-1.1, 0.1 + 0.01 * k, -0.5] for k in range(4)])
    west = overlay.is_knowable(cells, 0.2, np.vstack([wall, lone])) & ~east
    assert west[(cells == [-6, 0]).all(axis=1)].all()
    assert not west[middle[:, 0] < -1.2].any()


def test_recovered_of_the_knowable_leaves_out_what_no_return_tells():
    """Floor is claimed where x > 0, 200 of 400 cells; the walls left tell of these alone, and of
    two behind the sensor that touch its foot."""
    xyz, is_floor = square_room()
    floor = xyz[is_floor]
    ahead = np.abs(np.arctan2(xyz[:, 1], xyz[:, 0])) < np.radians(89.0)
    found = scored(floor[floor[:, 0] > 0], survivors=floor[:1], hard=xyz[~is_floor & ahead])
    assert found["recovered@0.2"] == pytest.approx(0.5)
    assert found["knowable@0.2"] == pytest.approx(202 / 400)
    assert found["recovered_knowable@0.2"] == pytest.approx(200 / 202)


def test_nothing_is_knowable_where_no_return_is_left():
    found = scored([[0.5, 0.5, -0.49]], hard=np.zeros((0, 3)))
    assert found["knowable@0.2"] == 0.0
    assert found["recovered_knowable@0.2"] is None


def test_claims_beyond_the_wall_are_counted_from_0_2_m():
    """Beyond the wall at x = 2: by 0.15 m, and three cells by 0.25, 0.35 and 0.95 m."""
    found = scored([[x, 0.05, -0.5] for x in (2.15, 2.25, 2.35, 2.95)])
    assert (found["beyond_cells"], found["shadow_cells"]) == (3, 0)
    assert found["beyond_max"] == pytest.approx(0.95, abs=0.01)


def test_claims_behind_something_near_are_in_its_shadow():
    """A post 1 m ahead, 8 deg wide, hides the wall: what lies before the wall's line is in its
    shadow, what lies behind is beyond."""
    xyz, is_floor = square_room()
    azimuth = np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0]))
    hidden = (np.abs(azimuth) < 4) & (xyz[:, 0] > 1)
    post = [[np.cos(a), np.sin(a), z] for a in np.radians(np.arange(-3.9, 4, 0.2)) for z in (0, 1)]
    seen = np.vstack([xyz[~hidden], post])
    found = overlay.ClearRoom.of(seen, np.arange(len(seen)) < np.count_nonzero(is_floor & ~hidden))
    claims = output_of([[1.55, 0.05, -0.5], [1.95, 0.05, -0.5], [2.55, 0.05, -0.5]])
    scores = overlay.score(found, xyz[:10], xyz, claims)
    assert (scores["beyond_cells"], scores["shadow_cells"]) == (3, 2)


def test_plane_is_compared_below_the_sensor_and_by_its_angle():
    tilted = (np.tan(np.arctan(0.02) + np.radians(0.4)), 0.0, -0.507)
    found = scored([[0.5, 0.5, -0.49]], floor_plane=tilted)
    assert found["plane_height"] == pytest.approx(-0.007)
    assert found["plane_tilt_deg"] == pytest.approx(0.4)


def test_plane_is_asked_for_where_floor_survives_over_a_metre():
    xyz, is_floor = square_room()
    floor = xyz[is_floor]
    near = floor[np.hypot(*floor[:, :2].T) < 1.0]
    assert scored(floor, survivors=floor)["plane_asked"]
    assert not scored(floor, survivors=near)["plane_asked"]
    assert not scored(floor, survivors=floor[::100])["plane_asked"]


def test_sigma_is_held_against_the_clear_plane_cell_by_cell():
    """Two cells with a sigma of 9 mm: one whose points lie 50 mm above and 50 mm below the plane,
    one whose points lie 20 mm above it."""
    offsets = ((1, 0.05), (1, -0.05), (-1, 0.02), (-1, 0.02))
    surface = [[x + 0.05, 0.55, 0.02 * (x + 0.05) - 0.5 + error] for x, error in offsets]
    found = scored(surface, sigma=np.full(4, 0.009))
    assert found["height_max"] == pytest.approx(0.02)
    assert found["within_2_sigma"] == pytest.approx(0.5)


def open_recording(path):
    return overlay.Recording.open(f"{SENSORS[path.parent.name]}={path}", "qt128")


def test_clear_scan_against_itself_is_whole(real_scan):
    recording = open_recording(real_scan)
    xyz = recording.recorded.directions * recording.recorded.ranges[:, None]
    floor = xyz[recording.room.is_floor]
    output = output_of(floor, floor_plane=recording.room.plane)
    found = overlay.score(recording.room, floor, xyz, output)
    assert (found["recovered@0.2"], found["raw@0.1"]) == (1.0, 1.0)
    assert (found["knowable@0.2"], found["recovered_knowable@0.2"]) == (1.0, 1.0)
    assert found["plane_height"] == 0.0
    assert found["beyond_cells"] < 5  # cells of the two farthest returns of a column


def test_heavy_smoke_leaves_two_thirds_of_the_clear_floor_cells(real_scan):
    """Within the dice of the scan's own beams: 70 to 700 cells."""
    recording = open_recording(real_scan)
    scan, extinction = recording.in_smoke("heavy", 0)
    left = len(overlay.cells_of(overlay.survivors_of(scan), 0.2))
    xyz = recording.recorded.directions * recording.recorded.ranges[:, None]
    whole = len(overlay.cells_of(xyz[recording.room.is_floor], 0.2))
    assert left / whole == pytest.approx(0.66, abs=0.08)
    assert extinction > 0


def test_recorded_room_is_recovered_by_a_method(real_scan, capsys, tmp_path):
    text = f"{SENSORS[real_scan.parent.name]}={real_scan}"
    arguments = ["evaluate", "room_boundary", "--overlay", text, "--seeds", "1"]
    assert cli.main([*arguments, "--output", str(tmp_path)]) == 0
    assert real_scan.parent.name in capsys.readouterr().out
    record = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["records"][0]
    scores = record["scores"]
    assert 0.5 < scores["recovered@0.2"] <= 1.0
    assert abs(scores["plane_height"]) < 0.015
    assert "http" not in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--overlay", "nowhere.npz"], "nowhere.npz"),
        (["--overlay", "moon=nowhere.npz"], "nowhere.npz"),
        (["--overlay", "x.npz", "--scenes", "ramp"], "give either --scenes or --overlay"),
        (["--overlay", "x.npz", "--seeds", "0"], "--seeds must be at least 1, not 0"),
    ],
)
def test_bad_overlays_end_in_one_line(capsys, arguments, text):
    assert cli.main(["evaluate", "raw_cloud", *arguments]) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert text in lines[0]
