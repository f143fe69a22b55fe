"""How far the sensor can see: the smoke's extinction from the walls of one scan.

A wall's intensity falls as cos(incidence) exp(-2 alpha R), whatever the scale of the sensor. How
bright walls are in clear air is learned from scans in clear air; from then on each wall tells how
much of that is left. Before, only the slope of the logarithm against range tells alpha, and patches
of smoke tilt it. Not in the thesis.

Thick smoke shows a wall through its thin places only: the mean of what is seen lies above the mean
of all by as much as a normal distribution (of the logarithm) cut off at the detection limit.
"""

import math
from dataclasses import dataclass

import numpy as np

_BIN = 0.2  # of range [m]
_FEWEST = 8  # returns of a bin
_FEWEST_BINS = 5
_SPAN = 0.6  # least spread of range [m]
_GRAZING = 0.2  # least cosine of incidence
_PATCHES = 0.32  # sigma of the optical depth over extinction and root of range [sqrt(m)]
_FAINTEST_SHARE = 0.02  # of the far half of the returns lies at the detection limit or below
_DIMMEST = 0.5  # an intensity of 0 was rounded from up to this
_STEPS = 8
_MOST_HIDDEN = 2.5  # that the correction for what is not seen may be
_EVEN = 0.15  # sigma over mean of a bin's intensities in clear air; smoke is patchy
_SHARED = 0.1  # sigma of an extinction for patches near the sensor that all beams pass
_TILTED = 0.3  # ... and for those that tilt the slope
_CLEAREST = 0.06  # extinction of what passes for clear air [1/m]


@dataclass(frozen=True)
class Visibility:
    """What the smoke lets through.

    Attributes
    ----------
    extinction : float
        Mean along the beams to the walls [1/m]; NaN where the walls do not tell.
    sigma : float
        One sigma of the extinction, from how far the bins disagree [1/m].
    """

    extinction: float
    sigma: float

    @property
    def meteorological_range(self):
        """MOR [m]: where 5 % of the light is left."""
        return math.log(20.0) / self.extinction if self.extinction > 0.0 else math.inf


UNKNOWN = Visibility(math.nan, math.nan)


class VisibilityEstimator:
    """Keeps how bright walls are in clear air; use one per sensor."""

    def __init__(self):
        self.clear_level = math.nan
        """ln of a wall's intensity at normal incidence in clear air, as learned; NaN before."""

    def estimate(self, wall, ranges, intensity, cosine):
        """The extinction from returns of walls.

        Parameters
        ----------
        wall : (N,) int64
            Which wall a return belongs to.
        ranges, intensity, cosine : (N,) float64
            [m]; on the sensor's scale; of the angle of incidence.

        Returns
        -------
        Visibility
        """
        tells = cosine > _GRAZING
        bins = _bins(wall[tells], ranges[tells], intensity[tells], cosine[tells])
        if bins is None:
            return UNKNOWN
        self._learn(bins)
        found = UNKNOWN
        if not math.isnan(self.clear_level):
            found = _solve(bins, self.clear_level)
        elif np.ptp(bins.at) >= _SPAN:
            found = _visibility(*_slope(bins, bins.level), _TILTED)
        return found

    def _learn(self, bins):
        """Take over the level of a scan in clear air; brighter walls win."""
        if np.ptp(bins.at) < _SPAN or np.median(bins.spread) > _EVEN:
            return
        extinction = max(0.0, _slope(bins, bins.level)[0])
        level = float(np.median(bins.level + 2.0 * extinction * bins.at))
        if extinction < _CLEAREST and not level < self.clear_level:
            self.clear_level = level


@dataclass(frozen=True)
class _Bins:
    """Walls by range: mean range [m], ln of the mean of I / cos, ln of the faintest I / cos that
    can be seen there, sigma of I / cos over its mean, and number of returns; all (B,) float64."""

    at: np.ndarray
    level: np.ndarray
    limit: np.ndarray
    spread: np.ndarray
    weight: np.ndarray


def _bins(wall, ranges, intensity, cosine):
    """Of returns on walls; None where there are too few."""
    key = wall * 1000 + (ranges / _BIN).astype(np.int64)
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    bright = intensity / cosine
    sums = [np.bincount(of, values) for values in (ranges, bright, bright * bright, cosine)]
    whole = (count >= _FEWEST) & (sums[1] > 0.0) if len(count) > 0 else np.zeros(0, bool)
    if np.count_nonzero(whole) < _FEWEST_BINS:
        return None
    count = count[whole].astype(np.float64)
    at, mean, square, cosine = (values[whole] / count for values in sums)
    spread = np.sqrt(np.maximum(0.0, square - mean * mean)) / mean
    limit = _faintest(ranges, intensity) * at * at / cosine
    return _Bins(at, np.log(mean), np.log(limit), spread, count)


def _faintest(ranges, intensity):
    """Detection limit of I / R^2: intensity is corrected for range, what is received is not."""
    far = ranges >= np.sort(ranges)[len(ranges) // 2]
    received = np.sort(np.maximum(intensity[far], _DIMMEST) / (ranges[far] * ranges[far]))
    return float(received[int(_FAINTEST_SHARE * len(received))])


def _solve(bins, clear_level):
    """Extinction and what it hides, each from the other."""
    extinction, sigma = _from_level(bins, bins.level, clear_level)
    for _ in range(_STEPS):
        hidden = _hidden(bins, max(extinction, 0.01))
        found, sigma = _from_level(bins, bins.level - hidden, clear_level)
        extinction = 0.5 * (extinction + found)
    return _visibility(extinction, sigma, _SHARED)


def _visibility(extinction, sigma, share):
    """With a sigma that counts what the bins have in common, a share of the extinction."""
    extinction = max(0.0, extinction)
    return Visibility(extinction, math.sqrt(sigma * sigma + (share * extinction) ** 2))


def _hidden(bins, extinction):
    """How far ln of the mean of what is seen lies above the mean of ln of all, per bin.

    A log-normal distribution with the sigma that patches make, cut off at the limit.
    """
    sigma = 2.0 * _PATCHES * extinction * np.sqrt(bins.at)
    hidden = np.zeros(len(bins.at))
    centre = bins.level - 0.5 * sigma * sigma  # a first guess; the seen mean bounds it from above
    for _ in range(3):
        above = (centre - bins.limit) / sigma
        hidden = 0.5 * sigma * sigma + _log_share(above + sigma) - _log_share(above)
        hidden = np.minimum(hidden, _MOST_HIDDEN)
        centre = bins.level - hidden
    return hidden


def _log_share(above):
    """ln of the share of a normal distribution that lies above `-above` sigmas."""
    return np.array([math.log(max(0.5 * math.erfc(-v / math.sqrt(2.0)), 1e-9)) for v in above])


def _from_level(bins, level, clear_level):
    """Extinction from what is left of the level in clear air, and its sigma."""
    weight = bins.weight * bins.at * bins.at
    each = (clear_level - level) / (2.0 * bins.at)
    mean = float(np.average(each, weights=weight))
    return mean, math.sqrt(float(np.average((each - mean) ** 2, weights=weight)) / len(each))


def _slope(bins, level):
    """Half the negative slope by weighted least squares, and its sigma from the residuals."""
    weight = bins.weight
    off = bins.at - np.average(bins.at, weights=weight)
    square = (weight * off * off).sum()
    slope = float((weight * off * level).sum() / square)
    mean = np.average(level, weights=weight)
    residual = level - mean - slope * off
    sigma = math.sqrt((weight**2 * off**2 * residual**2).sum()) / square
    return -0.5 * slope, 0.5 * sigma
