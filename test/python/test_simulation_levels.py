"""Smoke levels: what is calibrated is what the scans then show."""

import numpy as np
import pytest

from simulation_rooms import write_scene

pytest.importorskip("smoke_ground_reconstruction._core")
from smoke_ground_reconstruction import simulation as sim  # noqa: E402
from smoke_ground_reconstruction.evaluation.yardstick import cell_share  # noqa: E402
from smoke_ground_reconstruction.simulation import cache  # noqa: E402


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    monkeypatch.setenv("SMOKE_GROUND_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(scope="module")
def sensor():
    return sim.load_sensor("qt128")


def test_scans_at_a_level_keep_its_share_of_the_clear_floor_cells(sensor):
    scene = sim.load_scene("empty_room")
    truth = sim.floor_truth(scene, sensor)
    found = sim.calibrate(scene, sensor, 0, "heavy", seeds=4)
    assert found.share == pytest.approx(0.66, abs=0.002)
    smoke = sim.Smoke.of_scene(scene, mean_extinction=found.mean_extinction)
    for seed in range(4):
        floors = []
        for medium in (smoke, None):
            scan = sim.simulate(scene, sensor, 0, medium, seed)
            floors.append(scan.level_xyz[scan.truth == sim.Truth.FLOOR])
        # one scan's dice against their expectation: 800 cells, most of them certain
        measured = cell_share(floors[0], floors[1], truth)
        assert measured == pytest.approx(found.share_by_seed[seed], abs=0.03)


def test_levels_are_ordered_and_clear_is_clear(sensor):
    scene = sim.load_scene("empty_room")
    found = [sim.calibrate(scene, sensor, 0, level, seeds=2) for level in sim.LEVELS]
    extinctions = [calibration.mean_extinction for calibration in found]
    assert extinctions[0] == 0.0 and found[0].share == 1.0
    assert extinctions == sorted(extinctions) and len(set(extinctions)) == 5
    assert found[2].meteorological_range == pytest.approx(2.9957 / extinctions[2], rel=1e-3)
    assert "MOR" in found[2].summary()


def test_the_course_of_the_bisection_is_kept(sensor):
    found = sim.calibrate(sim.load_scene("empty_room"), sensor, 0, "light", seeds=2)
    order = np.argsort(found.extinctions)
    assert (np.diff(found.shares[order]) <= 0).all()
    assert found.extinctions[-1] == pytest.approx(found.mean_extinction, abs=1e-3)


def test_calibration_tells_how_far_it_is_unless_the_cache_knows(sensor):
    seen = []

    def progress(seeds, number):
        for seed in seeds:
            seen.append((seed, number))
            yield seed

    for _ in range(2):
        sim.calibrate(sim.load_scene("empty_room"), sensor, 0, "light", seeds=2, progress=progress)
    assert seen == [(0, 2), (1, 2)]


def test_a_level_that_is_none_and_a_floor_that_is_not_seen(tmp_path, sensor):
    scene = sim.load_scene("empty_room")
    with pytest.raises(ValueError, match="level must be one of clear, light"):
        sim.calibrate(scene, sensor, 0, "dense")
    blind = write_scene(
        tmp_path,
        floor={"reflectivity": 0.001},
        poses=[{"name": "high", "at": [2.9, 2.4], "height": 20.0}],
        room={"outline": [[0, 0], [6, 0], [6, 5], [0, 5]], "ceiling": 50.0},
    )
    with pytest.raises(ValueError, match="pose high: the clear scan sees no floor"):
        sim.calibrate(sim.load_scene(blind), sensor)


def test_a_level_scan_comes_from_the_cache_as_it_went_in(folder):
    first = sim.level_scan("empty_room", "vlp16", 0, "heavy", 3)
    files = list((folder / "scans").glob("*.npz"))
    assert len(files) == 1
    again = sim.level_scan("empty_room", "vlp16", 0, "heavy", 3)
    for name in ("xyz", "intensity", "ring", "t", "truth", "step", "pose"):
        one, other = getattr(first, name), getattr(again, name)
        assert one.dtype == other.dtype and np.array_equal(one, other)
    assert again.extinction == first.extinction > 0
    sim.level_scan("empty_room", "vlp16", 0, "heavy", 4)
    assert len(list((folder / "scans").glob("*.npz"))) == 2


def test_a_broken_cache_file_is_made_anew(folder):
    made = []

    def compute():
        made.append(1)
        return {"a": np.arange(3)}

    cache.arrays("kind", {"k": 1}, compute)
    cache.arrays("kind", {"k": 1}, compute)
    assert len(made) == 1
    (next((folder / "kind").glob("*.npz"))).write_bytes(b"broken")
    assert cache.arrays("kind", {"k": 1}, compute)["a"].tolist() == [0, 1, 2]
    assert len(made) == 2


def test_level_truth_knows_less_than_it_sees():
    truth = sim.level_truth("empty_room", "qt128", 0, "extreme", 0)
    assert 0 < truth.knowable.sum() < truth.visible_floor.sum()
