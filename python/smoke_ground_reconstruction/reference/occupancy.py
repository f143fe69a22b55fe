"""Occupancy of the cells around the sensor."""

import numpy as np

from .floor_surface import FloorSurface, OccupancyGrid
from .predicates import is_return, planar_range
from .scan import Mounting, ScanView

_MOST_CELLS = 10000.0  # from the sensor to the edge of the grid


def rasterize(
    surface: FloorSurface,
    walls: ScanView,
    mounting: Mounting,
    resolution: float,
    max_range: float = 50.0,
) -> OccupancyGrid:
    """Floor where a surface point lies, wall where a wall point lies, else unknown.

    Wall wins in a shared cell. Cells are aligned to multiples of the resolution in the level frame,
    so grids of successive scans match. Points beyond ``max_range`` of the sensor are left out: one
    stray return must not allocate a hall.

    Parameters
    ----------
    surface : FloorSurface
    walls : ScanView
        Wall points in the sensor frame.
    mounting : Mounting
    resolution : float
        Edge of a cell [m], at least 0.01.
    max_range : float
        Along the ground, at most 10,000 cells [m].

    Raises ValueError on a resolution or reach out of these limits.
    """
    if not 0.01 <= resolution < np.inf:
        raise ValueError(f"occupancy_resolution must be >= 0.01, is {resolution:g}")
    if not 0.0 < max_range <= _MOST_CELLS * resolution:
        raise ValueError(f"max_range must be > 0 and at most 10000 cells, is {max_range:g}")
    floor = _cells_of(surface.xyz, mounting, resolution, max_range)
    wall = _cells_of(walls.xyz, mounting, resolution, max_range)
    occupied = np.concatenate([floor, wall])
    if len(occupied) == 0:
        return OccupancyGrid(resolution, 0, 0, np.zeros((0, 0), np.int8))
    corner = occupied.min(axis=0)
    width, height = occupied.max(axis=0) - corner + 1
    cells = np.full((height, width), OccupancyGrid.UNKNOWN, np.int8)
    for columns_rows, value in ((floor, OccupancyGrid.FLOOR), (wall, OccupancyGrid.WALL)):
        column, row = (columns_rows - corner).T
        cells[row, column] = value
    return OccupancyGrid(resolution, int(corner[0]), int(corner[1]), cells)


def _cells_of(xyz, mounting, resolution, max_range):
    level = mounting.to_level(xyz[is_return(xyz)])
    level = level[planar_range(level) <= max_range]
    return np.floor(level[:, :2].astype(np.float64) / resolution).astype(np.int64)
