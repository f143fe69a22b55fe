"""The floor that comes out, and its occupancy grid."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Optional

import numpy as np


class Provenance(IntEnum):
    """Where a surface point comes from: the values of the field ``provenance``."""

    MEASURED = 0
    RECONSTRUCTED = 1
    MEASURED_BEFORE = 2


class BoundaryKind(IntEnum):
    """What ends the floor at a vertex of its outline: the values of msg/FloorBoundary.msg."""

    WALL_SEEN = 0
    WALL_INFERRED = 1
    LIMIT_OF_KNOWLEDGE = 2


@dataclass
class FloorSurface:
    """The floor: points in the sensor frame, one entry per point in every array.

    Attributes
    ----------
    xyz : (M, 3) float32
        [m].
    intensity : (M,) float32
        0 where reconstructed.
    ring : (M,) uint16
    provenance : (M,) uint8
        Provenance.
    confidence : (M,) float32
        0..1.
    boundary : (K, 3) float32
        Closed counter-clockwise outline of the claimed floor [m]; the last vertex joins the first.
        Empty where no floor is claimed.
    boundary_kind : (K,) uint8
        BoundaryKind per vertex.
    floor_plane : (3,) float64
        a, b, c of z = a x + b y + c.
    sigma : (M,) float32, optional
        One sigma of the point's height as that of the floor [m]; None where a method states none.
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    provenance: np.ndarray
    confidence: np.ndarray
    boundary: np.ndarray
    boundary_kind: np.ndarray
    floor_plane: np.ndarray
    sigma: Optional[np.ndarray] = None

    def __len__(self):
        return len(self.xyz)


@dataclass
class OccupancyGrid:
    """Map of square cells in the level frame, row by row from the corner of smallest x and y.

    Attributes
    ----------
    resolution : float
        Edge of a cell [m].
    first_column, first_row : int
        x and y of the grid's corner in cells: ``first_column * resolution`` [m].
    cells : (height, width) int8
        FLOOR, WALL or UNKNOWN; row along y, column along x.
    """

    FLOOR = 0
    WALL = 100
    UNKNOWN = -1

    resolution: float
    first_column: int
    first_row: int
    cells: np.ndarray

    @property
    def width(self) -> int:
        """Cells along x."""
        return self.cells.shape[1]

    @property
    def height(self) -> int:
        """Cells along y."""
        return self.cells.shape[0]
