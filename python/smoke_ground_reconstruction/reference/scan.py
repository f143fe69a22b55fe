"""A scan laid out once for all stages, and its columns."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .azimuth_bins import AzimuthBins
from .predicates import is_return
from .sensor_model import SensorModel

_IDENTITY = np.eye(3)


@dataclass
class Mounting:
    """How the sensor is mounted.

    Attributes
    ----------
    rotation : (3, 3) or (9,) float64
        R_level_sensor, row by row: levels the sensor frame (+x forward, +z up).
    sensor_height : float
        Height of the sensor's origin above the floor [m].
    """

    rotation: np.ndarray = field(default_factory=lambda: _IDENTITY.copy())
    sensor_height: float = 0.70

    def __post_init__(self):
        self.rotation = np.asarray(self.rotation, np.float64).reshape(3, 3)

    def is_level(self) -> bool:
        """Is the sensor frame the level frame?"""
        return bool(np.array_equal(self.rotation, _IDENTITY))

    def to_level(self, xyz):
        """Float32 (N, 3) points from the sensor frame to the level frame."""
        return xyz if self.is_level() else rotated(self.rotation, xyz)

    def to_sensor(self, xyz):
        """Float32 (N, 3) points from the level frame to the sensor frame."""
        return xyz if self.is_level() else rotated(self.rotation.T, xyz)


def rotated(matrix, xyz):
    """Float32 (N, 3) points turned by a matrix (3, 3)."""
    # Not xyz @ matrix.T: the order of the sums is part of the contract.
    x, y, z = (xyz[:, axis].astype(np.float64) for axis in range(3))
    with np.errstate(invalid="ignore"):  # points without a return may be infinite
        rows = [(row[0] * x + row[1] * y) + row[2] * z for row in matrix]
    return np.stack(rows, axis=1).astype(np.float32)


class ScanView(NamedTuple):
    """Points as the sensor sent them, in any order; non-finite and zero points may be among them.

    Attributes
    ----------
    xyz : (N, 3) float32
        Coordinates in the sensor frame [m].
    intensity : (N,) float32
        On the sensor's own scale.
    ring : (N,) uint16
        Laser row as the driver numbers it (the thesis's "channel").
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray

    def select(self, which) -> "ScanView":
        """The points of an index or bool array, in its order."""
        return ScanView(self.xyz[which], self.intensity[which], self.ring[which])


class Scan:
    """Points in input order, in the level frame; index i is the i-th input point everywhere.

    Parameters
    ----------
    view : ScanView
    mounting : Mounting, optional
        Levels the coordinates.

    Attributes
    ----------
    xyz, intensity, ring
        As in the view, `xyz` in the level frame.
    valid : (N,) bool
        `is_return` in the sensor frame.
    """

    def __init__(self, view: ScanView, mounting=None):
        self.xyz = (mounting or Mounting()).to_level(view.xyz)
        self.intensity = view.intensity
        self.ring = view.ring
        self.valid = is_return(view.xyz)

    def __len__(self):
        return len(self.xyz)


class ScanColumns:
    """The points of some labels, column by column, each from the lowest ring to the highest.

    Parameters
    ----------
    scan : Scan
    use : (N,) bool
        Takes part. Points whose ring has no rank do not.
    columns : AzimuthBins
    sensor : SensorModel

    Attributes
    ----------
    order : (M,) int64
        Point indices by column, then rank, then index.
    column, rank : (M,) int64
        Column and rank of ring of each entry of `order`.
    """

    def __init__(self, scan: Scan, use, columns: AzimuthBins, sensor: SensorModel):
        rank = sensor.rank(scan.ring).astype(np.int64)
        index = np.flatnonzero(use & scan.valid & (rank != SensorModel.NO_RANK))
        column = columns.index(scan.xyz[index, 0], scan.xyz[index, 1])
        by_column = np.lexsort((index, rank[index], column))
        self.order = index[by_column]
        self.column = column[by_column]
        self.rank = rank[self.order]
