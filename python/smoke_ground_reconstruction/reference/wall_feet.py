"""Where the foot of a wall shows that no drop lies before it.

A beam that falls into a drop before a wall meets the wall below the floor. Where a wall is seen
row by row right above the floor, at angles at which smoke hides little, and nothing of it below,
the beams that would have met it there were stopped by floor, seen or not. Not in the thesis.
"""

from dataclasses import dataclass

import numpy as np

LOWEST, HIGHEST = 0.1, 0.75  # heights of a wall's foot [m]
UP_TO = 0.35  # what stands so low down stands on a floor [m]
STEEPEST = 0.1  # it is no higher than this, per metre of range
OFF_WALL = 0.1  # and no farther before or behind the wall [m]

_NEIGHBORS = 2  # columns to either side that share what they see
_ROWS = 10  # returns of a foot that show that nothing is seen below it
_STEADY = 12  # columns side by side: smoke that hides what is lower is not so wide


@dataclass(frozen=True)
class WallFeet:
    """Returns of walls right above the floor, and how far the walls are.

    Attributes
    ----------
    column : (N,) int64
    height : (N,) float64
        Over the floor [m].
    distance : (columns,) float64
        Planar range of the boundary; 0 where none is known [m].
    """

    column: np.ndarray
    height: np.ndarray
    distance: np.ndarray


def sealed_floor(feet, is_open, sensor_height):
    """How far there is floor (columns,) [m] where no drop reaches the wall, else 0.

    A drop that begins nearer and reaches the wall would show as much of the wall below the floor
    as there is seen above it. Columns that see a drop, `is_open` (columns,), tell nothing.
    """
    columns = len(feet.distance)
    order = np.lexsort((feet.height, feet.column))
    begin = np.searchsorted(feet.column[order], np.arange(columns + 1))
    heights = feet.height[order]
    sealed = np.zeros(columns)
    for c in np.flatnonzero(feet.distance > 0.0):
        around = [(c + k) % columns for k in range(-_NEIGHBORS, _NEIGHBORS + 1)]
        rows = np.sort(np.concatenate([heights[begin[k] : begin[k + 1]] for k in around]))
        if len(rows) >= _ROWS and not is_open[around].any():
            sealed[c] = feet.distance[c] * (sensor_height / (sensor_height + rows[_ROWS - 1]))
    return sealed


def steadily(sealed):
    """What is sealed (columns,) in so many columns side by side that smoke cannot be why."""
    columns = len(sealed)
    gaps = np.flatnonzero(sealed == 0.0)
    if len(gaps) == 0:
        return sealed
    steady = np.zeros(columns)
    for a, b in zip(gaps, np.roll(gaps, -1)):
        run = (a + 1 + np.arange((b - a - 1) % columns)) % columns
        if len(run) >= _STEADY:
            steady[run] = sealed[run]
    return steady
