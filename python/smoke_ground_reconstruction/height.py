"""Height of the sensor above the floor, estimated from the floor's own returns in one scan.

Not from the thesis, which prints a fixed -0.70 m: used where a user names no height.
"""

from typing import Tuple

import numpy as np

CELL = 0.1  # edge of the cells that stand for an area of floor [m]
LEVEL = 0.02  # height of one level [m]
MAX_RANGE = 12.0  # returns farther away say little about the height [m]
MAX_HEIGHT = 3.0  # largest sensor height looked for [m]
MIN_HEIGHT = 0.05  # smallest [m]
SLOPES = np.tan(np.radians(np.arange(-3.0, 3.1, 0.5)))  # of the floor along x and y
MIN_CELLS = 100  # area of floor that must be seen [cells]
MIN_SECTORS = 6  # directions of 10 deg in which it must be seen
MIN_CONTRAST = 2.5  # area of the floor over that of the levels 0.1 to 0.2 m above and below
MAX_SHARE_BELOW = 0.25  # cells below the floor (reflections) over those on it
BAND = 0.06  # distance from the plane within which a return belongs to the floor [m]


class HeightError(ValueError):
    """The scan shows no floor from which a height could be told."""


def estimate_sensor_height(xyz: np.ndarray) -> float:
    """Height of a roughly level sensor above the floor [m], from one scan.

    The floor is the plane, inclined by up to 3 deg, that covers the largest area below the sensor
    with next to nothing below it, if it stands out from the planes beside it: walls cover little
    area at any height, smoke much at every height. Area is counted in cells, so that the dense
    returns close by weigh no more than the sparse ones far away.

    Parameters
    ----------
    xyz : (N, 3) float array, sensor frame, +z up [m]; non-finite and zero points are left out.

    Returns
    -------
    float : height straight below the sensor [m], positive.

    Raises
    ------
    HeightError : no plane stands out; the text says why.
    """
    points = _one_per_cell(_below_sensor(np.asarray(xyz, dtype=np.float64)))
    slopes, level = _largest_plane(points)
    plane = _fit_plane(points, np.array([*slopes, -(level + 0.5) * LEVEL]))
    _check(points, plane)
    return -float(plane[2])


def _below_sensor(xyz: np.ndarray) -> np.ndarray:
    xyz = xyz[np.isfinite(xyz).all(axis=1)]
    near = xyz[:, 0] ** 2 + xyz[:, 1] ** 2 <= MAX_RANGE**2
    low = (xyz[:, 2] <= -MIN_HEIGHT) & (xyz[:, 2] >= -MAX_HEIGHT)
    return xyz[near & low]


def _one_per_cell(points: np.ndarray) -> np.ndarray:
    """The mean of the points in each cell of CELL x CELL x LEVEL."""
    cells = np.floor(points / [CELL, CELL, LEVEL]).astype(np.int64)
    _, cell_of_point, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    sums = [np.bincount(cell_of_point.ravel(), weights=points[:, k]) for k in range(3)]
    return np.column_stack(sums) / counts[:, None] if len(points) else points


def _largest_plane(points: np.ndarray) -> Tuple[Tuple[float, float], int]:
    """Slopes along x and y, and level below the sensor, of the most likely floor."""
    best, best_slopes, best_level = -np.inf, (0.0, 0.0), 0
    for a in SLOPES:
        for b in SLOPES:
            score = _floor_score(points[:, 2] - a * points[:, 0] - b * points[:, 1])
            level = int(np.argmax(score))
            if score[level] > best:
                best, best_slopes, best_level = score[level], (a, b), level
    return best_slopes, best_level


def _floor_score(z: np.ndarray) -> np.ndarray:
    """Cells per level, less those more than 0.1 m below it: under a floor there is nothing."""
    size = int(round(MAX_HEIGHT / LEVEL)) + 1
    below = -z[(z <= -MIN_HEIGHT) & (z > -MAX_HEIGHT)]
    level = (below / LEVEL).astype(np.int64)
    # Three levels together, so that a floor on the edge of two is not cut in half.
    area = np.bincount(level, minlength=size)
    at_or_below = np.cumsum(area[::-1])[::-1]
    gap = int(round(0.1 / LEVEL))
    below_level = np.append(at_or_below[gap:], np.zeros(gap, np.int64))
    return np.convolve(area, np.ones(3, np.int64), mode="same") - below_level


def _fit_plane(points: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """a, b, c of z = a x + b y + c by least squares, narrowing in on the floor's cells."""
    for band in (BAND, BAND / 2, BAND / 2):
        x, y, z = points[np.abs(_residual(points, plane)) < band].T
        if len(z) < 3:
            break
        design = np.column_stack([x, y, np.ones_like(x)])
        plane = np.linalg.lstsq(design, z, rcond=None)[0]
    return plane


def _residual(points: np.ndarray, plane: np.ndarray) -> np.ndarray:
    return points[:, 2] - (plane[0] * points[:, 0] + plane[1] * points[:, 1] + plane[2])


def _check(points: np.ndarray, plane: np.ndarray) -> None:
    residual = _residual(points, plane)
    floor = points[np.abs(residual) < BAND / 2]
    if len(floor) < MIN_CELLS:
        raise HeightError(
            f"the largest level area below the sensor has {len(floor)} cells of {CELL} m "
            f"(needed: {MIN_CELLS})"
        )
    # 0.2 m of height beside the plane, of the 0.06 m on it.
    beside = np.count_nonzero((np.abs(residual) >= 0.1) & (np.abs(residual) < 0.2))
    contrast = len(floor) / max(beside * BAND / 0.2, 1.0)
    if contrast < MIN_CONTRAST:
        raise HeightError(
            f"no floor stands out below the sensor: the best level has {contrast:.1f} times the "
            f"area of its neighbours (needed: {MIN_CONTRAST})"
        )
    below = np.count_nonzero(residual < -0.1)
    if below > MAX_SHARE_BELOW * len(floor):
        raise HeightError(
            f"the largest level area, {-plane[2]:.2f} m below the sensor, is no floor: {below} "
            f"cells of {CELL} m with returns lie below it"
        )
    sectors = np.unique(np.floor(np.degrees(np.arctan2(floor[:, 1], floor[:, 0])) / 10.0))
    if sectors.size < MIN_SECTORS:
        raise HeightError(
            f"the floor below the sensor is seen in {sectors.size} directions of 10 deg only "
            f"(needed: {MIN_SECTORS})"
        )
