"""The floor as a robust plane with its uncertainty, from all low returns of a scan.

Thesis: Section 3.4 step 3 takes the lowest point of each wall, which lies low by several times the
range noise; here every low return votes, and what is not floor (wall feet, furniture, smoke) is
weighted out.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from ..params import RoomBoundaryParams
from .cells import cell_numbers
from .ordered import least_axis, ordered_sum, symmetric_inverse, times
from .sample import sample

_NEAREST, _FARTHEST = np.float32(0.3), np.float32(15.0)  # planar range of the returns that vote [m]
_FITTED = 2500  # returns, at least, that stand for all low ones
_FIRST_VOTES = 200  # ... of these, in the search among all tilts
_TILT_STEP = 2  # [deg]
_SLOTS_PER_METRE = 100.0  # of heights that are voted for
_CELL = 0.1  # and each cell of the floor has about one vote [m]
_VOTE = 1024.0  # a cell with one return
_PRIOR_SLOPE = 0.0524  # one sigma of the prior: 3 deg
_PRIOR_HEIGHT = 0.05
_SCALES = (0.05, 0.03, 0.02)  # of the residuals, coarse to fine, before those of the noise [m]
_STEPS = 4  # of reweighting by the noise, at most
_STILL = 2e-4  # ... and none once the plane moves less, [m] and over _STILL_WITHIN
_STILL_WITHIN = 5.0  # [m]
_TAKEN = 0.25  # residuals from the winner of the votes that the fit looks at [m]
_TUKEY = 3.0  # residuals beyond so many scales have no weight
_UNEVEN = 0.003  # no floor is flatter, one sigma [m]
_ROUGH = 0.01  # a floor more uneven may be two of different heights [m]
_SMOOTHER = 0.5  # times the whole's unevenness has the one that the robot stands on
_NOISE_LEAST, _NOISE_MOST = 0.002, 0.1  # of a range [m]
_MAD = 1.4826  # a sigma in median absolute deviations
_SINES, _LENGTHS = 1024.0, 20000.0  # steps in which medians are taken [1, 1/m]
_MOST_STEPS = 1201  # up to 0.06 m
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
        Number of returns it was fitted to, each counted by its Tukey weight.
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

    def measured_sigma(self, sine):
        """One sigma of a return's height as that of the floor, by the sine of its grazing angle
        [m]: the range's noise, and what of the unevenness may be errors that neighbouring returns
        have in common; one scan cannot tell which."""
        lift = self.noise * sine
        common = max(0.0, self.uneven * self.uneven - _UNEVEN * _UNEVEN)
        return np.sqrt(lift * lift + common)


def fit_floor(xyz, sensor_height, before=None, params=None):
    """The floor of one scan.

    A search over tilts finds the height that most floor cells agree on; iteratively reweighted
    least squares (Tukey) with a weak prior at the mounting height refines it, on 2500 returns or
    more that stand for all. Heights more than `max_height_deviation` off the mounting height
    beneath the sensor are never looked at: ceilings and table tops do not become floor.

    Parameters
    ----------
    xyz : (N, 3) float64
        Returns in the level frame [m], finite.
    sensor_height : float
        [m]
    before : FloorModel, optional
        The last good one, taken where this scan shows too little floor.
    params : RoomBoundaryParams, optional

    Returns
    -------
    FloorModel
    """
    params = params or RoomBoundaryParams()
    low = _low_returns(xyz, sensor_height, params)
    if len(low) >= _FEWEST:
        plane = _coarse(low[sample(len(low), _FITTED)], sensor_height, params)
        found = _refined_by_some(low, plane, sensor_height, params)
        if found is not None and found.uneven > _ROUGH:
            found = _nearer(low, found, sensor_height, params)
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


def _low_returns(xyz, sensor_height, params):
    x, y, z = xyz.astype(np.float32).T
    planar = np.sqrt(x * x + y * y)
    bound, steepest = np.float32(params.max_height_deviation), _slope(params.max_floor_tilt_deg)
    is_low = np.abs(z + np.float32(sensor_height)) < bound + np.float32(steepest) * planar
    return xyz[is_low & (planar > _NEAREST) & (planar < _FARTHEST)]


def _coarse(low, sensor_height, params):
    """Tilt and height that most cells of the floor vote for.

    Some of the votes tell which tilt about, all of them which of those beside it.
    """
    vote = np.floor(_VOTE / np.sqrt(_together(low)) + 0.5)
    bound, steepest = params.max_height_deviation, params.max_floor_tilt_deg
    # In single precision: slots are 10 mm high.
    x, y, z = low.astype(np.float32).T
    votes = np.stack([x, y, (z + np.float32(sensor_height)) + np.float32(bound)]), vote
    slots = math.floor(2.0 * bound * _SLOTS_PER_METRE + 0.5)
    some = sample(len(low), _FIRST_VOTES)
    even = steepest // _TILT_STEP * _TILT_STEP
    about = range(-even, even + 1, _TILT_STEP)
    tilt, _ = _strongest_tilt(*(values[..., some] for values in votes), slots, about, about)
    beside = (range(max(-steepest, t - 1), min(steepest, t + 1) + 1) for t in tilt)
    tilt, slot = _strongest_tilt(*votes, slots, *beside)
    height = -sensor_height - bound + (slot + 0.5) / _SLOTS_PER_METRE
    return np.array([*map(_slope, tilt), height])


def _strongest_tilt(place, vote, slots, tilts_x, tilts_y):
    """The tilts along x and y and the slot of height that most votes agree on; slight ones win
    ties."""
    x, y, over_lowest = place
    best, found = -1.0, None
    for along_x in tilts_x:
        turned = over_lowest - np.float32(_slope(along_x)) * x
        for along_y in tilts_y:
            turned_twice = turned - np.float32(_slope(along_y)) * y
            slot = np.floor(turned_twice * np.float32(_SLOTS_PER_METRE))
            inside = (slot >= 0.0) & (slot < slots)
            votes = np.bincount(slot[inside].astype(np.int64) + 1, vote[inside], slots + 2)
            around = (votes[:-2] + votes[1:-1]) + votes[2:]
            most = around.max() * (500 - (abs(along_x) + abs(along_y)))
            if most > best:
                best, found = most, ((along_x, along_y), int(around.argmax()))
    return found


def _slope(degrees):
    # Rounded, for libraries that differ in the last bit.
    return float(np.float32(math.tan(math.radians(degrees))))


def _refined_by_some(low, plane, sensor_height, params):
    """What is too little among some of the low returns may be enough among all."""
    for fewest in (_FITTED, len(low)):
        some = low[sample(len(low), fewest)]
        found = _refined(some, plane, sensor_height, params)
        if found is not None:
            return found
    return None


def _refined(low, plane, sensor_height, params):
    """Tukey's reweighted least squares; None where too little floor is left.

    A range's noise lifts a return by noise times the sine of the grazing angle: far returns tell
    heights best, and what lies a little above the floor there (wall feet) is told from it.
    """
    near = np.abs(_residuals(low, plane)) < _TAKEN
    together, low = _together(low)[near], low[near]
    x, y, z = low.T
    sine = np.abs(z) / np.sqrt((x * x + y * y) + z * z)
    for scale in _SCALES:
        scale = np.full(len(low), scale)
        plane, _, _ = _reweighted(low, plane, scale, scale * scale * together, sensor_height)
    for _ in range(_STEPS):
        noise, uneven = _noise(np.abs(_residuals(low, plane)), sine, scale)
        lift = noise * sine
        scale = np.sqrt(lift * lift + uneven * uneven)
        variance = lift * lift + (uneven * uneven) * together
        before = plane
        plane, weight, covariance = _reweighted(low, plane, scale, variance, sensor_height)
        moved = np.abs(plane - before)
        if max(_STILL_WITHIN * max(moved[0], moved[1]), moved[2]) < _STILL:
            break
    total = ordered_sum(weight)
    if total < _FEWEST or _width(low, weight, total) < _NARROWEST:
        return None
    steepest = _slope(params.max_floor_tilt_deg + 1)  # a step of the search more
    if plane[0] * plane[0] + plane[1] * plane[1] > steepest * steepest:
        return None
    error = -float(plane[2]) - sensor_height
    if abs(error) > params.max_height_deviation:
        return None
    return FloorModel(plane, covariance, total, noise, uneven, FloorSource.MEASURED, error)


def _nearer(low, found, sensor_height, params):
    """The plane of the nearer half of the returns where that is far more even: the floor is the
    one that the robot stands on, not the mean of it and of a terrace behind glass."""
    square = low[:, 0] * low[:, 0] + low[:, 1] * low[:, 1]
    near = low[square <= np.sort(square)[len(square) // 2]]
    nearer = _refined_by_some(near, found.plane, sensor_height, params)
    is_better = nearer is not None and nearer.uneven < _SMOOTHER * found.uneven
    return nearer if is_better else found


def _together(low):
    """How many returns share each one's cell: its height above the plane is common to them."""
    cell = np.floor(low[:, :2] / _CELL).astype(np.int64)
    _, of, count = np.unique(cell_numbers(cell), return_inverse=True, return_counts=True)
    return count[of].astype(np.float64)


def _residuals(low, plane):
    return low[:, 2] - ((plane[0] * low[:, 0] + plane[1] * low[:, 1]) + plane[2])


def _reweighted(low, plane, scale, variance, sensor_height):
    """One step: the plane, the Tukey weights about the last one, and the covariance."""
    u = _residuals(low, plane) / (_TUKEY * scale)
    rest = 1.0 - u * u
    weight = np.where(np.abs(u) < 1.0, rest * rest, 0.0)
    inverse = weight / variance
    x, y, z = low.T
    wx, wy = inverse * x, inverse * y
    sx, sy, s, sz = (ordered_sum(values) for values in (wx, wy, inverse, inverse * z))
    xx, xy, xz = (ordered_sum(wx * other) for other in (x, y, z))
    yy, yz = ordered_sum(wy * y), ordered_sum(wy * z)
    slope, height = 1.0 / (_PRIOR_SLOPE * _PRIOR_SLOPE), 1.0 / (_PRIOR_HEIGHT * _PRIOR_HEIGHT)
    normal = np.array([[xx + slope, xy, sx], [xy, yy + slope, sy], [sx, sy, s + height]])
    covariance = symmetric_inverse(normal)
    return times(covariance, (xz, yz, sz - sensor_height * height)), weight, covariance


def _noise(residual, sine, scale):
    """One sigma of a range, and of the floor's own unevenness [m].

    A height's variance is (noise sine)^2 + unevenness^2; the medians of the steeper and of the
    flatter half of the returns tell both. Residuals beyond three of the scales (N,) of the step
    before tell nothing.
    """
    near = residual < _TUKEY * np.maximum(scale, _SCALES[-1])
    residual, sine = residual[near], sine[near]
    if len(sine) < _FEWEST:
        return _NOISE_LEAST, _UNEVEN
    middle = _median(sine, _SINES)
    steep = sine >= middle
    if steep.all() or not steep.any():
        return _NOISE_LEAST, _UNEVEN
    deviation = [_MAD * _median(residual[half], _LENGTHS) for half in (steep, ~steep)]
    median_sine = [_median(sine[half], _SINES) for half in (steep, ~steep)]
    high, low = (value * value for value in deviation)
    steeper, flatter = (value * value for value in median_sine)
    slope = (high - low) / max(steeper - flatter, 1e-6)
    noise = math.sqrt(min(max(slope, _NOISE_LEAST * _NOISE_LEAST), _NOISE_MOST * _NOISE_MOST))
    uneven = low - noise * noise * flatter
    return noise, math.sqrt(max(uneven, _UNEVEN * _UNEVEN))


def _median(values, per_unit):
    """Median of values >= 0, in steps of 1 / per_unit."""
    slot = np.minimum((values * per_unit).astype(np.int64), _MOST_STEPS)
    counts = np.cumsum(np.bincount(slot))
    return (np.argmax(counts > (counts[-1] - 1) // 2) + 0.5) / per_unit


def _width(low, weight, total):
    """Two sigma of the returns' spread in the direction in which they spread least [m]."""
    x = low[:, 0] - ordered_sum(weight * low[:, 0]) / total
    y = low[:, 1] - ordered_sum(weight * low[:, 1]) / total
    moments = (ordered_sum(weight * a * b) / total for a, b in ((x, x), (x, y), (y, y)))
    return 2.0 * math.sqrt(max(0.0, least_axis(*moments)[2]))
