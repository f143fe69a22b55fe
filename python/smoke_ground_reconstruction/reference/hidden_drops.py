"""How far there is floor for certain where smoke may hide a drop.

A drop is told by what lies below the floor. In smoke so thick that the floor itself is seen but a
few sensor heights away, that is hidden as well. A wall that is seen low down shows that beams get
there, and would have met what lies lower. Where the boundary breaks off, or a drop does, floor goes
on up to such a wall; before it floor is certain no farther than it is measured. Not in the thesis.
"""

import numpy as np

_THICK = 3.0  # sensor heights: floor seen no farther than this leaves drops unseen
_FARTHEST_SHARE = 0.9  # of the columns see the floor no farther than it is seen
_OPEN = 0.5  # columns tell how far it is seen if their wall stands so far behind it [m]
_FLOOR_BESIDE = 12  # columns to either side that share what they measure
_GOES_ON = 0.3  # floor goes on so far beyond what is measured [m]
_WALL_BESIDE = 2  # columns to either side that share what they see of the wall
_WALL_RETURNS = 4  # from low down


def certain_floor(floor, distance, drops, low_wall, sensor_height):
    """How far floor may be claimed (columns,) [m]; infinite where nothing speaks against it.

    Parameters
    ----------
    floor : (columns,) float64
        How far floor is measured in each column alone [m]; 0 where it is not.
    distance : (columns,) float64
        Planar range of the boundary [m]; 0 where none is known.
    drops : DropOffs
    low_wall : (columns,) int64
        Returns of the boundary's walls from low down.
    sensor_height : float
        Above the floor [m].
    """
    certain = np.full(len(floor), np.inf)
    falls = np.isfinite(drops.begin)
    is_open = (distance == 0.0) | falls
    if not is_open.any() or not _is_thick(floor, distance, falls, sensor_height):
        return certain
    doubted = (distance == 0.0) | _beside(is_open, _around(low_wall, _WALL_BESIDE, np.sum))
    near = _around(floor, _FLOOR_BESIDE, np.max)[doubted] + _GOES_ON
    certain[doubted] = np.maximum(near, drops.floor_to[doubted])
    return certain


def _is_thick(floor, distance, falls, sensor_height):
    """Does smoke, not a wall or a drop, end the floor's view too near to tell of drops?"""
    free = (floor > 0.0) & ~falls & ((distance == 0.0) | (distance > floor + _OPEN))
    reach = np.sort(floor[free])
    return len(reach) > 0 and reach[int(_FARTHEST_SHARE * len(reach))] < _THICK * sensor_height


def _around(values, beside, fold):
    return fold([np.roll(values, k) for k in range(-beside, beside + 1)], axis=0)


def _beside(is_open, low_wall):
    """Columns between an open one and the first one to either side that sees its wall low down."""
    columns, found = len(is_open), np.zeros(len(is_open), bool)
    for c in np.flatnonzero(is_open):
        for step in (1, -1):
            at = (c + step) % columns
            while not is_open[at] and not found[at] and low_wall[at] < _WALL_RETURNS:
                found[at] = True
                at = (at + step) % columns
    return found
