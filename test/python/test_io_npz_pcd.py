"""Scans and floors in .npz and .pcd files come back as they went in; bad files are named."""

import numpy as np
import pytest

from box_room import box_room
from smoke_ground_reconstruction.io import DataError, files, npz, pcd, replacing
from smoke_ground_reconstruction.io.clouds import Floor


def a_floor() -> Floor:
    return Floor(
        xyz=np.array([[1, 0, -0.5], [0, 1, -0.5], [-1, 0, -0.5], [0, 0, -0.5]], np.float32),
        ring=np.array([3, 4, 5, 65535], np.uint16),
        provenance=np.array([0, 1, 2, 0], np.uint8),
        confidence=np.array([1, 0.25, 0.5, 1], np.float32),
        intensity=np.array([12, 0, 7, 255], np.float32),
        boundary=np.array([[1, 0, -0.5], [0, 1, -0.5], [-1, 0, -0.5]], np.float32),
        boundary_kind=np.array([0, 1, 2], np.uint8),
        floor_plane=np.array([0.0, 0.0, -0.5]),
    )


def assert_same_scan(a, b):
    for name in ("xyz", "intensity", "ring", "t"):
        got, expected = getattr(a, name), getattr(b, name)
        assert got.dtype == expected.dtype
        np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize("ending", [".npz", ".pcd"])
def test_a_scan_survives_the_file(tmp_path, ending):
    path = str(tmp_path / f"scan{ending}")
    scan = box_room(rings=4, steps=10)
    files.write_scans(path, [scan])
    (read,) = files.open_scans(path)
    assert_same_scan(read, scan)
    assert not files.holds_floors(path)


def test_a_floor_survives_an_archive(tmp_path):
    path = str(tmp_path / "floor.npz")
    files.write_floors(path, [a_floor()])
    (read,) = files.open_floors(path)
    for name, expected in vars(a_floor()).items():
        if name == "intensity":  # not in the format: 0 is read
            assert not read.intensity.any()
        elif isinstance(expected, np.ndarray):
            np.testing.assert_allclose(getattr(read, name), expected, atol=1e-7)
    assert files.holds_floors(path)


def test_the_archive_of_a_floor_has_the_documented_arrays(tmp_path):
    path = str(tmp_path / "floor.npz")
    npz.write_floor(path, a_floor())
    with np.load(path) as archive:
        shapes = {name: (archive[name].dtype.str, archive[name].shape) for name in archive.files}
    assert shapes == {
        "x": ("<f4", (4,)),
        "y": ("<f4", (4,)),
        "z": ("<f4", (4,)),
        "ring": ("<u2", (4,)),
        "provenance": ("|u1", (4,)),
        "confidence": ("<f4", (4,)),
        "boundary": ("<f4", (3, 2)),
        "boundary_kind": ("|u1", (3,)),
        "floor_plane": ("<f8", (3,)),
    }


def test_a_floor_in_a_pcd_keeps_its_points(tmp_path):
    path = str(tmp_path / "floor.pcd")
    files.write_floors(path, [a_floor()])
    (read,) = files.open_floors(path)
    for name in ("xyz", "ring", "provenance", "confidence", "intensity"):
        np.testing.assert_array_equal(getattr(read, name), getattr(a_floor(), name))
    assert len(read.boundary) == 0 and read.floor_plane is None


def test_an_ascii_pcd_of_another_tool_is_read(tmp_path):
    path = tmp_path / "ascii.pcd"
    path.write_text(
        "# .PCD v.7\nVERSION .7\nFIELDS x y z intensity ring\nSIZE 4 4 4 4 2\nTYPE F F F F U\n"
        "COUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
        "1 2 3 4 5\nnan -1.5 0 25 127\n"
    )
    scan = pcd.read_scan(str(path))
    np.testing.assert_array_equal(scan.xyz, np.array([[1, 2, 3], [np.nan, -1.5, 0]], np.float32))
    np.testing.assert_array_equal(scan.intensity, [4, 25])
    np.testing.assert_array_equal(scan.ring, [5, 127])


def test_rings_are_told_from_elevation_where_there_are_none(tmp_path, capsys):
    scan = box_room(rings=5, steps=20)
    path = str(tmp_path / "no_ring.npz")
    np.savez(path, x=scan.xyz[:, 0], y=scan.xyz[:, 1], z=scan.xyz[:, 2], intensity=scan.intensity)
    read = npz.read_scan(path)
    np.testing.assert_array_equal(read.ring, scan.ring)
    assert capsys.readouterr().err.count("no 'ring'") == 1


def arrays(**changes):
    values = {name: np.ones(3, np.float32) for name in ("x", "y", "z", "intensity")}
    values["ring"] = np.ones(3, np.uint16)
    values.update(changes)
    return {name: value for name, value in values.items() if value is not None}


@pytest.mark.parametrize(
    "changes, complaint",
    [
        ({"z": None}, "no 'z'; it holds 'intensity', 'ring', 'x', 'y'"),
        ({"intensity": None}, "no 'intensity'"),
        ({"y": np.ones(2)}, r"'y' has shape \(2,\), 'x' has \(3,\)"),
        ({"y": np.ones((3, 1))}, r"'y' has shape \(3, 1\)"),
        ({"x": np.array(["a", "b", "c"])}, "'x' is of type <U1"),
        ({"ring": np.ones(3)}, "'ring' is of type float64"),
        ({"ring": np.array([0, 1, -1])}, "'ring' goes from -1 to 1"),
        ({"ring": np.array([0, 1, 65536])}, "'ring' goes from 0 to 65536"),
    ],
)
def test_bad_arrays_are_named(tmp_path, changes, complaint):
    path = str(tmp_path / "bad.npz")
    np.savez(path, **arrays(**changes))
    with pytest.raises(DataError, match=complaint) as error:
        npz.read_scan(path)
    assert path in str(error.value)


def test_whatever_is_no_archive_is_refused(tmp_path):
    path = tmp_path / "text.npz"
    path.write_text("this is no archive")
    with pytest.raises(DataError, match="not an archive of NumPy arrays"):
        npz.read_scan(str(path))
    np.savez(path, x=np.array([{}], dtype=object))
    with pytest.raises(DataError, match="not an archive of NumPy arrays"):
        npz.read_scan(str(path))


@pytest.mark.parametrize(
    "content, complaint",
    [
        ("nothing of the kind", "header is invalid"),
        ("FIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n", "differ in number"),
        ("FIELDS x\nSIZE 4\nTYPE F\nWIDTH 9\nHEIGHT 1\nDATA binary\nabc", "cut off"),
        ("SIZE 4\nFIELDS x\nTYPE F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1\n", "out of place"),
        ("FIELDS x\nSIZE 4\nTYPE F\nWIDTH -1\nHEIGHT 1\nDATA ascii\n1\n", "no number"),
        ("FIELDS x\nSIZE 3\nTYPE F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n1\n", "type F and size 3"),
    ],
)
def test_broken_pcd_files_are_refused(tmp_path, content, complaint):
    path = tmp_path / "broken.pcd"
    path.write_text(content)
    with pytest.raises(DataError, match=complaint):
        pcd.read_scan(str(path))


def test_other_endings_are_refused():
    with pytest.raises(DataError, match=r"scan.txt: the ending must be one of .bag, .npz, .pcd"):
        files.open_scans("scan.txt")


def test_a_failed_run_leaves_the_older_file(tmp_path):
    target = tmp_path / "result.npz"
    target.write_text("older")
    with pytest.raises(RuntimeError), replacing(str(target)) as part:
        open(part, "w").close()
        raise RuntimeError
    assert target.read_text() == "older"
    assert [entry.name for entry in tmp_path.iterdir()] == ["result.npz"]
    with pytest.raises(DataError, match="no directory"), replacing(str(tmp_path / "no" / "a.npz")):
        pass
