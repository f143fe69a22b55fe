"""Smoke: a drifting, patchy extinction field, as numbers of a user and as a compiled field."""

import math
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

from .._core import simulation as _simulation

SOOT_BACKSCATTER_RATIO = 0.005
"""beta / alpha [1/sr] of soot-like absorbing particles (lidar ratio 200 sr)."""


@dataclass(frozen=True)
class Smoke:
    """Parameters of the smoke; SI units, angles none.

    alpha(x) = mean_extinction exp(sigma_ln n(x) - sigma_ln^2 / 2) g(z) plume(x), where n is three
    octaves of gradient noise of unit variance. Defaults of what is not known are assumptions:
    overlap, pulse length, patchiness and drift.

    Parameters
    ----------
    mean_extinction : float
        At 905-940 nm, one way [1/m].
    sigma_ln, correlation_length : float
        Patchiness: standard deviation of ln alpha, and wavelength of its coarsest octave [m].
    drift : tuple
        Velocity of the pattern, world frame [m/s].
    backscatter_ratio : float
        beta / alpha [1/sr]; 0.03 for water droplets, SOOT_BACKSCATTER_RATIO for soot.
    pulse_length : float
        L_p = c tau_p / 2 [m].
    overlap_begin, overlap_end : float
        Ranges [m] between which the receiver begins to see the beam.
    range_jitter : float
        Standard deviation [m] of the range of the smoke's own returns.
    layer_height, layer_thickness, below_layer : float
        The smoke's lower edge: its middle z and width [m] (0: none), and the share of smoke below.
    plume_centre, plume_radius, plume_gain
        The source: alpha is (1 + gain) times as high at its centre, falling off as a Gaussian.
    """

    mean_extinction: float = 0.42
    sigma_ln: float = 0.6
    correlation_length: float = 0.8
    drift: tuple = (0.10, 0.05, 0.02)
    backscatter_ratio: float = 0.03
    pulse_length: float = 0.6
    overlap_begin: float = 0.2
    overlap_end: float = 0.8
    range_jitter: float = 0.04
    layer_height: float = 0.0
    layer_thickness: float = 0.0
    below_layer: float = 1.0
    plume_centre: tuple = (0.0, 0.0, 0.0)
    plume_radius: float = 0.0
    plume_gain: float = 0.0

    @classmethod
    def of_scene(cls, scene, **values):
        """Smoke with the scene's own source and layer."""
        return cls(**{**scene.smoke, **values})

    def with_extinction(self, mean_extinction):
        """The same smoke, thicker or thinner [1/m]."""
        return replace(self, mean_extinction=mean_extinction)

    def params(self):
        """As the compiled simulator takes it."""
        params = _simulation.SmokeParams()
        for key, value in asdict(self).items():
            setattr(params, key, value)
        return params

    def field(self, seed):
        """The compiled extinction field of one seed."""
        return _field(self, int(seed))


@lru_cache(maxsize=2)
def _field(smoke, seed):
    return _simulation.SmokeField(smoke.params(), seed)


def meteorological_range(extinction):
    """MOR [m]: where 5 % of the light is left, ln(20) / alpha; infinite in clear air."""
    return math.log(20.0) / extinction if extinction > 0 else math.inf


def optical_density(extinction):
    """Optical density per metre, alpha / ln(10), as fire engineers quote it."""
    return extinction / math.log(10.0)
