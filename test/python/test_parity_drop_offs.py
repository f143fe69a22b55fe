"""Drops: the compiled core and the reference agree to the last bit."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.drop_offs import find_drop_offs
from smoke_ground_reconstruction.reference.predicates import Direction

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


def assert_parity(core, column, planar, height, is_floor, walls):
    as_float64 = planar.astype(np.float64), height.astype(np.float64)
    expected = find_drop_offs(column, *as_float64, is_floor, SENSOR_HEIGHT, DIRECTIONS, walls)
    actual = core.find_drop_offs(
        column.astype(np.uint16), planar, height, is_floor.astype(np.uint8), SENSOR_HEIGHT,
        DIRECTIONS, walls,
    )  # fmt: skip
    for found, wanted in zip(actual, (expected.begin, expected.end, expected.floor_to)):
        np.testing.assert_array_equal(found, wanted)
    return expected


@pytest.mark.parametrize("walls", [WALLS, []], ids=["walls", "no walls"])
@pytest.mark.parametrize("seed", range(12))
def test_seeded_drops(core, seed, walls):
    drops = assert_parity(core, *seeded_drop(seed), walls)
    assert np.isfinite(drops.begin).any()


def test_some_seeds_have_sure_edges_and_floor_beyond(core):
    found = [assert_parity(core, *seeded_drop(seed), WALLS) for seed in range(12)]
    assert any(np.any(drops.floor_to > 0.0) for drops in found)
    assert any(np.isfinite(drops.end).any() for drops in found)


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_few_returns(core, count):
    column, planar, height, is_floor = seeded_drop(1)
    lowest = np.argsort(height, kind="stable")[:count]
    assert_parity(core, column[lowest], planar[lowest], height[lowest], is_floor[lowest], WALLS)


def test_a_column_without_direction_is_refused(core):
    one = np.zeros(1, np.float32)
    with pytest.raises(ValueError, match="a column has no direction: 900"):
        core.find_drop_offs(
            np.array([900], np.uint16), one, one, np.ones(1, np.uint8), 0.7, DIRECTIONS
        )
