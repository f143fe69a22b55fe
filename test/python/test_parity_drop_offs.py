"""Drops: the compiled core and the reference agree to the last bit."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.drop_edges import DropTolerances
from smoke_ground_reconstruction.reference.drop_offs import find_drop_offs
from smoke_ground_reconstruction.reference.predicates import Direction
from smoke_ground_reconstruction.reference.wall_feet import WallFeet

COLUMNS = 900
DIRECTIONS = np.array([Direction.from_degrees(0.4 * (c + 0.5)) for c in range(COLUMNS)])
WALLS = [(1.0, 0.0), (0.0, 1.0)]
SENSOR_HEIGHT = 0.7


def seeded_drop(seed):
    """Returns around a straight edge, at a random place and angle, through random smoke."""
    rng = np.random.default_rng(seed)
    normal = Direction.from_degrees(rng.choice([0.0, 90.0, rng.uniform(0.0, 360.0)]))
    edge, width, depth = rng.uniform(1.2, 4.0), rng.uniform(0.6, 6.0), rng.uniform(0.15, 1.5)
    rings = np.arange(0.5, 8.0, rng.uniform(0.08, 0.3))
    column, planar = (axis.ravel() for axis in np.meshgrid(np.arange(COLUMNS), rings))
    seen = rng.uniform(size=len(column)) < np.exp(-planar * rng.uniform(0.0, 0.8))
    column, planar = column[seen], planar[seen] + rng.normal(0.0, 0.01, np.count_nonzero(seen))
    x, y = planar * DIRECTIONS[column, 0], planar * DIRECTIONS[column, 1]
    across = normal.cosine * x + normal.sine * y
    along = normal.cosine * y - normal.sine * x
    falls = (across > edge) & (across < edge + width) & (np.abs(along) < rng.uniform(0.5, 5.0))
    height = np.where(falls, -depth, rng.normal(0.0, 0.005, len(falls)))
    planar = np.where(falls, planar * (1.0 + depth / SENSOR_HEIGHT), planar)
    is_floor = np.abs(height) < 0.03
    return column, planar.astype(np.float32), height.astype(np.float32), is_floor


def seeded_feet(seed):
    """Feet of walls in runs of columns of many lengths, most of them seen row by row."""
    rng = np.random.default_rng(seed)
    distance = np.repeat(rng.uniform(2.0, 7.0, COLUMNS // 30), 30)
    distance[rng.integers(COLUMNS, size=5)] = 0.0
    rows = np.repeat(rng.integers(0, 7, COLUMNS // 20), 20)
    column = np.repeat(np.arange(COLUMNS), rows)
    height = (0.1 + rng.uniform(0.0, 0.1, len(column)) * distance[column]).astype(np.float32)
    return WallFeet(column, height, distance)


def assert_parity(core, column, planar, height, is_floor, walls, feet=None, lift=0.0, widening=1.0):
    as_float64 = planar.astype(np.float64), height.astype(np.float64)
    feet = seeded_feet(0) if feet is None else feet
    expected = find_drop_offs(
        column, *as_float64, is_floor, SENSOR_HEIGHT, DIRECTIONS, walls,
        WallFeet(feet.column, feet.height.astype(np.float64), feet.distance),
        DropTolerances(lift=lift, widening=widening),
    )  # fmt: skip
    actual = core.find_drop_offs(
        column.astype(np.uint16), planar, height, is_floor.astype(np.uint8), SENSOR_HEIGHT,
        DIRECTIONS, walls, feet.column.astype(np.uint16), feet.height, feet.distance, lift,
        widening,
    )  # fmt: skip
    for found, wanted in zip(actual, vars(expected).values()):
        np.testing.assert_array_equal(found, wanted)
    return expected


@pytest.mark.parametrize("walls", [WALLS, []], ids=["walls", "no walls"])
@pytest.mark.parametrize("seed", range(12))
def test_seeded_drops(core, seed, walls):
    drops = assert_parity(core, *seeded_drop(seed), walls)
    assert np.isfinite(drops.begin).any()


@pytest.mark.parametrize("first", [49, 84, 252, 413, 525, 700, 812])
def test_edges_that_may_run_either_way(core, first):
    """Beams fell through 3 m away in ten columns; to one side floor is measured beyond."""
    sees = np.repeat(first + np.arange(10), 2)
    column = np.concatenate([sees, sees[::2], first - 35 + np.arange(4)]) % COLUMNS
    planar = np.concatenate([np.tile([6.0, 6.4], 10), np.full(10, 1.5), np.full(4, 3.3)])
    below = np.arange(len(column)) < len(sees)
    height = np.where(below, -SENSOR_HEIGHT, 0.0).astype(np.float32)
    drops = assert_parity(core, column, planar.astype(np.float32), height, ~below, WALLS)
    assert drops.is_doubted.any()


@pytest.mark.parametrize("seed", range(24))
def test_seeded_feet_of_walls(core, seed):
    assert_parity(core, *seeded_drop(seed), WALLS, seeded_feet(seed))


@pytest.mark.parametrize("seed", range(12))
def test_a_sensor_of_much_range_noise(core, seed):
    column, planar, height, is_floor = seeded_drop(seed)
    height = height + np.random.default_rng(seed).normal(0.0, 0.03, len(height)).astype(np.float32)
    assert_parity(core, column, planar, height, is_floor, WALLS, None, 0.09, 1.7)


def test_feet_of_walls_keep_drops_from_spreading(core):
    none = WallFeet(np.zeros(0, np.int64), np.zeros(0, np.float32), np.zeros(COLUMNS))
    found = [
        [
            assert_parity(core, *seeded_drop(seed), WALLS, feet).begin
            for feet in (seeded_feet(seed), none)
        ]
        for seed in range(12)
    ]
    assert any(
        np.isfinite(with_feet).sum() < np.isfinite(without).sum() for with_feet, without in found
    )


def test_some_seeds_have_sure_edges_and_floor_beyond(core):
    found = [assert_parity(core, *seeded_drop(seed), WALLS) for seed in range(12)]
    assert any(np.any(drops.floor_to > 0.0) for drops in found)
    assert any(np.isfinite(drops.end).any() for drops in found)


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_few_returns(core, count):
    column, planar, height, is_floor = seeded_drop(1)
    lowest = np.argsort(height, kind="stable")[:count]
    assert_parity(core, column[lowest], planar[lowest], height[lowest], is_floor[lowest], WALLS)


def test_a_single_return_from_below(core):
    column, planar, height, is_floor = seeded_drop(0)
    keep = is_floor.copy()
    keep[np.flatnonzero(~is_floor)[0]] = True
    drops = assert_parity(core, column[keep], planar[keep], height[keep], is_floor[keep], WALLS)
    assert np.isfinite(drops.begin).any()


def test_a_column_without_direction_is_refused(core):
    one = np.zeros(1, np.float32)
    with pytest.raises(ValueError, match="a column has no direction: 900"):
        core.find_drop_offs(
            np.array([900], np.uint16), one, one, np.ones(1, np.uint8), 0.7, DIRECTIONS, [],
            np.zeros(0, np.uint16), one[:0], np.zeros(COLUMNS),
        )  # fmt: skip


def test_a_foot_without_direction_is_refused(core):
    one = np.zeros(1, np.float32)
    with pytest.raises(ValueError, match="a foot has no direction: 900"):
        core.find_drop_offs(
            np.zeros(1, np.uint16), one, one, np.ones(1, np.uint8), 0.7, DIRECTIONS, [],
            np.array([900], np.uint16), one, np.zeros(COLUMNS),
        )  # fmt: skip
