"""The smoke's extinction from walls whose brightness is known by hand."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.visibility import VisibilityEstimator

ONE_WALL = np.zeros(4000, int)
RANGES = np.linspace(1.0, 5.0, 4000)
COSINE = np.full(4000, 0.8)


def brightness(extinction, level=200.0):
    """I = level cos exp(-2 alpha R)."""
    return level * COSINE * np.exp(-2.0 * extinction * RANGES)


def started_in_clear_air(level=200.0):
    estimator = VisibilityEstimator()
    clear = estimator.estimate(ONE_WALL, RANGES, brightness(0.0, level), COSINE)
    assert clear.extinction == pytest.approx(0.0, abs=1e-3)
    assert estimator.clear_level == pytest.approx(np.log(level), abs=1e-3)
    return estimator


def test_the_slope_tells_where_clear_air_was_never_seen():
    found = VisibilityEstimator().estimate(ONE_WALL, RANGES, brightness(0.4), COSINE)
    assert found.extinction == pytest.approx(0.4, rel=0.01)
    assert found.meteorological_range == pytest.approx(np.log(20.0) / 0.4, rel=0.01)
    assert found.sigma > 0.1  # patches may tilt it


@pytest.mark.parametrize("level", [20.0, 200.0, 6000.0])
def test_what_is_left_of_the_level_tells_on_every_scale(level):
    estimator = started_in_clear_air(level)
    # One range alone has no slope: a near and a far patch of wall, 0.3 m deep.
    some = (RANGES > 3.0) & (RANGES < 4.0)
    rng = np.random.default_rng(0)
    patchy = brightness(0.4, level) * np.exp(0.4 * rng.standard_normal(len(RANGES)))
    found = estimator.estimate(ONE_WALL[some], RANGES[some], patchy[some], COSINE[some])
    assert found.extinction == pytest.approx(0.4, rel=0.1)
    assert found.sigma < 0.06


def test_smoke_that_hides_the_faint_half_does_not_read_low():
    # ln I has a sigma of 2 * 0.32 * 0.6 * sqrt(R) about its mean; what is fainter than 0.06 R^2
    # is not detected. The seen mean alone says 0.53 /m.
    estimator = started_in_clear_air()
    rng = np.random.default_rng(1)
    ranges, cosine = np.tile(np.linspace(3.0, 5.0, 4000), 5), np.full(20000, 0.8)
    sigma = 0.64 * 0.6 * np.sqrt(ranges)
    log_part = -1.2 * ranges + sigma * rng.standard_normal(len(ranges))
    intensity = 200.0 * cosine * np.exp(log_part)
    seen = intensity > 0.06 * ranges**2
    assert 0.2 < np.mean(seen) < 0.8
    wall = np.zeros(np.count_nonzero(seen), int)
    found = estimator.estimate(wall, ranges[seen], intensity[seen], cosine[seen])
    naive = np.log(200.0 / np.mean((intensity / cosine)[seen])) / (2.0 * np.mean(ranges[seen]))
    assert naive < 0.54
    assert found.extinction == pytest.approx(0.6, rel=0.08)


def test_smoke_is_not_learned_as_clear_air():
    estimator = started_in_clear_air()
    before = estimator.clear_level
    rng = np.random.default_rng(2)
    patchy = brightness(0.05) * np.exp(0.4 * rng.standard_normal(len(RANGES)))
    estimator.estimate(ONE_WALL, RANGES, patchy, COSINE)
    assert estimator.clear_level == before
    fresh = VisibilityEstimator()
    fresh.estimate(ONE_WALL, RANGES, patchy, COSINE)
    assert np.isnan(fresh.clear_level)


def test_a_darker_room_does_not_replace_a_brighter_wall():
    estimator = started_in_clear_air()
    estimator.estimate(ONE_WALL, RANGES, brightness(0.0, 100.0), COSINE)
    assert estimator.clear_level == pytest.approx(np.log(200.0), abs=1e-3)


def test_no_walls_no_answer():
    assert np.isnan(VisibilityEstimator().estimate(*[np.zeros(0)] * 4).extinction)
    few = [values[::500] for values in (ONE_WALL, RANGES, brightness(0.2), COSINE)]
    assert np.isnan(VisibilityEstimator().estimate(*few).extinction)
