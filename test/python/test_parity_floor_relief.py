"""Relief: the compiled core and the reference agree to the last bit."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.floor_relief import find_relief


def seeded_floor(seed):
    """Floor, and by turns a ramp with its platform, a step, a podium that smoke hides, clutter."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-6.0, 6.0, (20000, 2))
    x = xy[:, 0]
    begin, slope = rng.uniform(0.8, 2.0), rng.uniform(0.06, 0.15)
    height = [
        np.clip((x - begin) * slope, 0.0, 0.35),
        np.where(x > begin, 0.16, 0.0),
        np.zeros(len(x)),
        np.where(np.abs(xy - 3.0).max(axis=1) < 0.8, 0.45, 0.0),
    ][seed % 4]
    hidden = x > begin + rng.uniform(0.5, 3.0)
    if seed % 4 == 2:
        hidden = x > begin
    xy, height = xy[~hidden], height[~hidden]
    wall = np.column_stack([np.full(4000, 6.0), rng.uniform(-6.0, 6.0, 4000)])
    riser = np.column_stack([np.full(1500, begin), rng.uniform(-2.0, 2.0, 1500)])
    standing = np.vstack([wall, riser] if seed % 4 in (1, 2) else [wall])
    tops = np.r_[np.full(len(wall), 2.0), np.full(len(standing) - len(wall), 0.16)]
    bottoms = np.r_[np.full(len(wall), rng.uniform(0.2, 0.4)), np.zeros(len(tops) - len(wall))]
    xy = np.vstack([xy, standing])
    height = np.r_[height, bottoms + (tops - bottoms) * rng.uniform(size=len(tops))]
    height = height + rng.normal(0.0, 0.006, len(height))
    return xy.astype(np.float32), height.astype(np.float32)


def assert_parity(core, xy, height):
    planar = np.sqrt((xy.astype(np.float64) ** 2).sum(axis=1)).astype(np.float32)
    places, over = xy.astype(np.float64), height.astype(np.float64)
    expected = find_relief(places, over, planar.astype(np.float64))
    actual = core.FloorRelief()
    actual.find(xy, height, planar)
    assert actual.is_flat() == expected.is_flat()
    at = np.random.default_rng(0).uniform(-16.0, 16.0, (3000, 2))
    np.testing.assert_array_equal(actual.at(at), expected.at(at))
    np.testing.assert_array_equal(actual.sigma(at), expected.sigma(at))
    np.testing.assert_array_equal(actual.carries(places, over), expected.carries(places, over))
    np.testing.assert_array_equal(actual.is_riser(places, over), expected.is_riser(places, over))
    return expected


@pytest.mark.parametrize("seed", range(12))
def test_seeded_floors(core, seed):
    relief = assert_parity(core, *seeded_floor(seed))
    assert relief.is_flat() == (seed % 4 == 3)
    assert (relief.step is not None) == (seed % 4 in (1, 2))


@pytest.mark.parametrize("seed", [0, 4, 8, 12])
def test_ramps_fitted_to_scattered_returns(core, seed):
    xy, height = seeded_floor(seed)
    planar = np.sqrt((xy.astype(np.float64) ** 2).sum(axis=1)).astype(np.float32)
    expected = find_relief(*(values.astype(np.float64) for values in (xy, height, planar)))
    actual = core.FloorRelief()
    actual.find(xy, height, planar)
    rng = np.random.default_rng(seed)
    places = rng.uniform(-6.0, 6.0, (300, 2))
    feet = np.column_stack([places, expected.at(places) + rng.uniform(-0.01, 0.02, 300)])
    floor = np.column_stack([xy, height]).astype(np.float64)[::50]
    normals = np.array([[0.0, 1.0], [1.0, 0.0]])
    before = expected.facets
    expected = expected.with_ramp_fitted(floor, feet, normals, 1.0 / 6.0)
    assert not np.array_equal(expected.facets, before)
    actual.fit_ramp(floor, feet, normals)
    at = rng.uniform(-16.0, 16.0, (3000, 2))
    np.testing.assert_array_equal(actual.at(at), expected.at(at))


@pytest.mark.parametrize("count", [0, 1, 3, 200])
def test_few_returns(core, count):
    xy, height = seeded_floor(0)
    assert_parity(core, xy[:count], height[:count])


def test_returns_at_the_rim_of_the_grid(core):
    xy = np.array([[12.79, 0.0], [12.8, 0.0], [-12.8, 0.0], [0.0, -12.79], [40.0, 40.0]] * 5)
    assert_parity(core, xy.astype(np.float32), np.zeros(len(xy), np.float32))
