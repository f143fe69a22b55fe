"""The smoke's extinction: the compiled estimator against the reference, scan after scan."""

import numpy as np
import pytest

from smoke_ground_reconstruction.reference.visibility import VisibilityEstimator


def walls_in_smoke(extinction, seed, count=6000, level=150.0):
    """Three walls, patchy smoke, whole intensities, and what is too faint left out."""
    rng = np.random.default_rng(seed)
    wall = rng.integers(0, 3, count).astype(np.int32)
    ranges = rng.uniform(1.5, 6.5, count)
    cosine = rng.uniform(0.1, 1.0, count)
    patches = 0.64 * extinction * np.sqrt(ranges) * rng.standard_normal(count)
    intensity = np.round(level * cosine * np.exp(-2.0 * extinction * ranges + patches))
    seen = intensity >= 0.06 * ranges**2
    return wall[seen], ranges[seen], intensity[seen], cosine[seen]


@pytest.mark.parametrize("extinctions", [(0.0, 0.2, 0.7), (0.4, 0.0, 0.4), (0.7,), (0.05, 0.02)])
def test_scans_in_order(core, extinctions):
    compiled, reference = core.VisibilityEstimator(), VisibilityEstimator()
    for seed, extinction in enumerate(extinctions):
        scan = walls_in_smoke(extinction, seed)
        found = compiled.estimate(*scan)
        expected = reference.estimate(*scan)
        np.testing.assert_allclose(found.extinction, expected.extinction, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.sigma, expected.sigma, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(compiled.clear_level, reference.clear_level, rtol=1e-12)


def test_too_few_returns(core):
    compiled = core.VisibilityEstimator()
    assert np.isnan(compiled.estimate(*[part[:20] for part in walls_in_smoke(0.1, 0)]).extinction)
    empty = [part[:0] for part in walls_in_smoke(0.1, 0)]
    assert np.isnan(compiled.estimate(*empty).extinction)
    with pytest.raises(ValueError, match="wall must be"):
        compiled.estimate(np.zeros(3), *[np.zeros(3)] * 3)
