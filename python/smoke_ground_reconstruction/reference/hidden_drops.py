"""How far there is floor for certain where smoke may hide a drop.

A drop is told by what lies below the floor, a wall behind it by its returns. Where the boundary
breaks off, neither was seen, and a ceiling overhead tells nothing of what lies beneath: floor is
certain no farther than it is measured. So it is beside a gap or a drop, up to a wall that is seen
low down: beams get there, and would have met what lies lower. So they would before furniture seen
low down: what stands stands on a floor. A gap in which the floor is measured to rise is a ramp,
which leads to something. Not in the thesis.
"""

import numpy as np

from .azimuth_bins import around_columns

_WIDE = 12  # columns of a gap in which a drop can hide
_RISING_SHARE = 0.5  # of the columns of a gap in which a ramp leads on
_FLOOR_BESIDE = 12  # columns to either side that share what they measure
_GOES_ON = 0.3  # floor goes on so far beyond what is measured [m]
_WALL_BESIDE = 2  # columns to either side that share what they see of the wall
_WALL_RETURNS = 4  # from low down


def certain_floor(floor, distance, drops, low_wall, stands, rises):
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
    stands : (columns,) float64
        How far returns from low down are seen [m]; 0 where they are not.
    rises : (columns,) bool
        Is floor measured in the column that rises over the plane?
    """
    certain = np.full(len(floor), np.inf)
    gap = _hiding_gaps(distance == 0.0, around_columns(rises, _FLOOR_BESIDE, np.any))
    is_open = gap | np.isfinite(drops.begin)
    if not is_open.any():
        return certain
    measured = around_columns(floor, _FLOOR_BESIDE, np.max)
    ends = around_columns(low_wall, _WALL_BESIDE, np.sum) >= _WALL_RETURNS
    doubted = gap | drops.is_doubted | _beside(is_open, ends | (stands > measured))
    near = np.maximum(measured + _GOES_ON, stands)
    certain[doubted] = np.maximum(near, drops.floor_to)[doubted]
    return certain


def _hiding_gaps(is_unknown, rises):
    """Columns of those runs of unknown ones that are wide and in which most floor does not rise."""
    columns = len(is_unknown)
    known = np.flatnonzero(~is_unknown)
    found = np.zeros(columns, bool)
    # Runs from one known column to the next; all around where none is known.
    starts, ends = (known, np.roll(known, -1)) if len(known) else ([columns - 1], [columns - 1])
    for before, after in zip(starts, ends):
        length = (after - before - 1) % columns if len(known) else columns
        run = (before + 1 + np.arange(length)) % columns
        if length >= _WIDE and rises[run].sum() < _RISING_SHARE * length:
            found[run] = True
    return found


def _beside(is_open, ends):
    """Columns between an open one and the first one to either side at which doubt `ends`."""
    columns, found = len(is_open), np.zeros(len(is_open), bool)
    for c in np.flatnonzero(is_open):
        for step in (1, -1):
            at = (c + step) % columns
            while not is_open[at] and not found[at] and not ends[at]:
                found[at] = True
                at = (at + step) % columns
    return found
