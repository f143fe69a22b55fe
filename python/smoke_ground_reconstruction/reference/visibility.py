"""How far the sensor can see: the smoke's extinction from the walls of one scan.

A wall's intensity falls as cos(incidence) exp(-2 alpha R), whatever the scale of the sensor, so the
slope of its logarithm against range tells alpha. The walls of a room are taken to be of one
reflectivity. Where smoke is so thick that only its thin places show a wall, the estimate is too
low. Not in the thesis.
"""

import math
from dataclasses import dataclass

import numpy as np

_BIN = 0.2  # of range [m]
_FEWEST = 8  # returns of a bin
_FAINTEST = 2.0  # mean intensity of a bin: fainter ones have lost their faintest returns
_DIMMEST = 0.01  # ... or this share of the scan's bright returns, on larger scales
_SPAN = 0.6  # least spread of range [m]
_FEWEST_BINS = 5


@dataclass(frozen=True)
class Visibility:
    """What the smoke lets through.

    Attributes
    ----------
    extinction : float
        Mean along the beams to the walls [1/m]; NaN where the walls do not tell.
    sigma : float
        One sigma of the extinction, from how far the walls disagree with one slope [1/m].
    """

    extinction: float
    sigma: float

    @property
    def meteorological_range(self):
        """MOR [m]: where 5 % of the light is left."""
        return math.log(20.0) / self.extinction if self.extinction > 0.0 else math.inf


def estimate_visibility(wall, ranges, intensity, cosine):
    """The extinction from returns of walls.

    Parameters
    ----------
    wall : (N,) int64
        Which wall a return belongs to.
    ranges, intensity, cosine : (N,) float64
        [m]; on the sensor's scale; of the angle of incidence.
    """
    tells = cosine > 0.2
    wall, ranges = wall[tells], ranges[tells]
    intensity, cosine = intensity[tells], cosine[tells]
    if len(wall) == 0:
        return Visibility(math.nan, math.nan)
    faintest = max(_FAINTEST, _DIMMEST * float(np.percentile(intensity, 95.0)))
    at, level, weight = [], [], []
    for number in np.unique(wall):
        on = wall == number
        course = _course(ranges[on], intensity[on], cosine[on], faintest)
        for values, more in zip((at, level, weight), course):
            values.extend(more)
    if len(at) < _FEWEST_BINS or max(at) - min(at) < _SPAN:
        return Visibility(math.nan, math.nan)
    return _slope(np.array(at), np.array(level), np.array(weight))


def _slope(at, level, weight):
    """Weighted least squares: half the negative slope, and its sigma from the residuals."""
    off = at - np.average(at, weights=weight)
    square = (weight * off * off).sum()
    slope = (weight * off * level).sum() / square
    residual = level - np.average(level, weights=weight) - slope * off
    sigma = math.sqrt((weight**2 * off**2 * residual**2).sum()) / square
    return Visibility(max(0.0, -0.5 * float(slope)), 0.5 * sigma)


def _course(ranges, intensity, cosine, faintest):
    """Range, ln of the mean of I / cos and number of returns of each bin that is whole."""
    slot = (ranges / _BIN).astype(np.int64)
    at, level, weight = [], [], []
    for s in np.unique(slot):
        here = slot == s
        count = np.count_nonzero(here)
        if count >= _FEWEST and intensity[here].mean() >= faintest:
            at.append(float(np.median(ranges[here])))
            level.append(math.log(float((intensity[here] / cosine[here]).mean())))
            weight.append(float(count))
    return at, level, weight
