"""The floor as a robust plane with its uncertainty, from all low returns of a scan.

Thesis: Section 3.4 step 3 takes the lowest point of each wall, which lies low by several times the
range noise; here every low return votes, and what is not floor (wall feet, furniture, smoke) is
weighted out.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

_BOUND = 0.15  # the floor lies this near to the mounting height beneath the sensor [m]
_STEEPEST = 6  # ... and is no steeper, floor and mounting together [deg]
_NEAREST, _FARTHEST = 0.3, 15.0  # planar range of the returns that vote [m]
_VOTES = 4000  # returns that take part in the search of the tilt
_SLOT = 0.01  # heights are voted for in slots of this size [m]
_CELL = 0.1  # and each cell of the floor has about one vote [m]
_PRIOR_SLOPE = math.tan(math.radians(3.0))  # one sigma of the prior
_PRIOR_HEIGHT = 0.05
_SCALES = (0.05, 0.03, 0.02)  # of the residuals, coarse to fine, before those of the noise [m]
_STEPS = 4  # of reweighting by the noise
_TUKEY = 3.0  # residuals beyond so many scales have no weight
_UNEVEN = 0.003  # no floor is flatter, one sigma [m]
_NOISE_LEAST, _NOISE_MOST = 0.002, 0.03  # of a range [m]
_MAD = 1.4826  # a sigma in median absolute deviations
_FEWEST = 50.0  # returns that make a plane
_NARROWEST = 0.6  # and the length they must span across, two sigma [m]


class FloorSource(IntEnum):
    """Where the plane comes from."""

    MEASURED = 0
    MEASURED_BEFORE = 1
    MOUNTING = 2


@dataclass(frozen=True)
class FloorModel:
    """The plane z = a x + b y + c in the level frame.

    Attributes
    ----------
    plane : (3,) float64
        a, b [1] and c [m].
    covariance : (3, 3) float64
        Of the plane; that of the prior where nothing was measured.
    weight : float
        Number of returns behind it, each counted by its Tukey weight.
    noise : float
        One sigma of a return's range [m].
    uneven : float
        One sigma of the floor's own height about the plane [m].
    source : FloorSource
    height_error : float
        Measured less given height of the sensor over the floor [m].
    """

    plane: np.ndarray
    covariance: np.ndarray
    weight: float
    noise: float
    uneven: float
    source: FloorSource
    height_error: float = 0.0

    def heights(self, xyz):
        """Heights (N,) of points (N, 3) above the plane, along z [m]."""
        a, b, c = self.plane
        return xyz[:, 2] - (a * xyz[:, 0] + b * xyz[:, 1] + c)

    def sigma(self, x, y):
        """One sigma of the floor's height at (x, y): the plane's and the unevenness about it [m].

        Biases common to all returns (range walk) are below the unevenness of at least 3 mm.
        """
        at = np.stack([x, y, np.ones_like(x)], axis=-1)
        return np.sqrt(np.einsum("...i,ij,...j->...", at, self.covariance, at) + self.uneven**2)


def fit_floor(xyz, sensor_height, before=None):
    """The floor of one scan.

    A search over tilts finds the height that most floor cells agree on; iteratively reweighted
    least squares (Tukey) with a weak prior at the mounting height refines it. Heights more than
    0.15 m off the mounting height beneath the sensor are never looked at: ceilings and table tops
    do not become floor.

    Parameters
    ----------
    xyz : (N, 3) float64
        Returns in the level frame [m], finite.
    sensor_height : float
        [m]
    before : FloorModel, optional
        The last good one, taken where this scan shows too little floor.

    Returns
    -------
    FloorModel
    """
    low = _low_returns(xyz, sensor_height)
    if len(low) >= _FEWEST:
        found = _refined(low, _coarse(low, sensor_height), sensor_height)
        if found is not None:
            return found
    if before is not None:
        return replace(
            before,
            covariance=4.0 * before.covariance,
            weight=0.0,
            source=FloorSource.MEASURED_BEFORE,
            height_error=0.0,
        )
    plane = np.array([0.0, 0.0, -sensor_height])
    return FloorModel(plane, _prior_covariance(), 0.0, 0.01, _UNEVEN, FloorSource.MOUNTING)


def _prior_covariance():
    return np.diag([_PRIOR_SLOPE**2, _PRIOR_SLOPE**2, _PRIOR_HEIGHT**2])


def _low_returns(xyz, sensor_height):
    planar = np.sqrt(xyz[:, 0] ** 2 + xyz[:, 1] ** 2)
    reach = _BOUND + math.tan(math.radians(_STEEPEST)) * planar
    is_low = np.abs(xyz[:, 2] + sensor_height) < reach
    return xyz[is_low & (planar > _NEAREST) & (planar < _FARTHEST)]


def _coarse(low, sensor_height):
    """Tilt and height that most cells of the floor vote for; slight tilts win ties."""
    low = low[:: max(1, len(low) // _VOTES)]
    cell = np.floor(low[:, :2] / _CELL).astype(np.int64)
    key = cell[:, 0] * 1000003 + cell[:, 1]
    _, of, count = np.unique(key, return_inverse=True, return_counts=True)
    vote = 1.0 / np.sqrt(count[of])
    slots = int(round(2 * _BOUND / _SLOT))
    best, plane = -1.0, None
    for along_x in range(-_STEEPEST, _STEEPEST + 1):
        for along_y in range(-_STEEPEST, _STEEPEST + 1):
            a, b = math.tan(math.radians(along_x)), math.tan(math.radians(along_y))
            residual = low[:, 2] + sensor_height - a * low[:, 0] - b * low[:, 1]
            slot = np.floor((residual + _BOUND) / _SLOT)
            inside = (slot >= 0) & (slot < slots)
            votes = np.bincount(slot[inside].astype(int), vote[inside], slots)
            votes = np.convolve(votes, np.ones(3), "same")
            most = votes.max() * (1.0 - 0.002 * (abs(along_x) + abs(along_y)))
            if most > best:
                height = -sensor_height - _BOUND + (votes.argmax() + 0.5) * _SLOT
                best, plane = most, np.array([a, b, height])
    return plane


def _refined(low, plane, sensor_height):
    """Tukey's reweighted least squares; None where too little floor is left.

    A range's noise lifts a return by noise times the sine of the grazing angle: far returns tell
    heights best, and what lies a little above the floor there (wall feet) is told from it.
    """
    design = np.column_stack([low[:, :2], np.ones(len(low))])
    sine = np.abs(low[:, 2]) / np.sqrt((low * low).sum(axis=1))
    for scale in _SCALES:
        plane, weight, _ = _reweighted(low, design, plane, np.full(len(low), scale), sensor_height)
    for _ in range(_STEPS):
        noise, uneven = _noise(low[:, 2] - design @ plane, sine)
        scale = np.sqrt((noise * sine) ** 2 + uneven**2)
        plane, weight, normal = _reweighted(low, design, plane, scale, sensor_height)
    total = weight.sum()
    if total < _FEWEST or _width(low, weight) < _NARROWEST:
        return None
    error = -plane[2] - sensor_height
    if abs(error) > _BOUND:
        return None
    return FloorModel(
        plane, np.linalg.inv(normal), total, noise, uneven, FloorSource.MEASURED, error
    )


def _reweighted(low, design, plane, scale, sensor_height):
    """One step: the plane, the Tukey weights about the last one, and the inverse covariance."""
    u = (low[:, 2] - design @ plane) / (_TUKEY * scale)
    weight = np.where(np.abs(u) < 1.0, (1.0 - u * u) ** 2, 0.0)
    inverse = weight / (scale * scale)
    prior = np.linalg.inv(_prior_covariance())
    normal = design.T @ (inverse[:, None] * design) + prior
    right = design.T @ (inverse * low[:, 2]) + prior @ [0.0, 0.0, -sensor_height]
    return np.linalg.solve(normal, right), weight, normal


def _noise(residual, sine):
    """One sigma of a range, and of the floor's own unevenness [m].

    A height's variance is (noise sine)^2 + unevenness^2; the medians of the steeper and of the
    flatter half of the returns tell both.
    """
    near = np.abs(residual) < _TUKEY * _SCALES[-1]
    residual, sine = residual[near], sine[near]
    if len(sine) < _FEWEST:
        return _NOISE_LEAST, _UNEVEN
    steep = sine >= np.median(sine)
    variance = [(_MAD * np.median(np.abs(residual[half]))) ** 2 for half in (steep, ~steep)]
    square = [np.median(sine[half]) ** 2 for half in (steep, ~steep)]
    slope = (variance[0] - variance[1]) / max(square[0] - square[1], 1e-6)
    noise = math.sqrt(min(max(slope, _NOISE_LEAST**2), _NOISE_MOST**2))
    uneven = variance[1] - noise * noise * square[1]
    return noise, math.sqrt(max(uneven, _UNEVEN**2))


def _width(low, weight):
    """Two sigma of the returns' spread in the direction in which they spread least [m]."""
    mean = (weight[:, None] * low[:, :2]).sum(axis=0) / weight.sum()
    centred = low[:, :2] - mean
    spread = centred.T @ (weight[:, None] * centred) / weight.sum()
    return 2.0 * math.sqrt(max(0.0, np.linalg.eigvalsh(spread)[0]))
