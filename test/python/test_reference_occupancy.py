"""Cells of the occupancy grid, worked out by hand."""

import numpy as np
import pytest

from rooms import tilt, view_of
from smoke_ground_reconstruction.reference.floor_surface import FloorSurface, OccupancyGrid
from smoke_ground_reconstruction.reference.occupancy import rasterize
from smoke_ground_reconstruction.reference.scan import Mounting

UNKNOWN, FLOOR, WALL = OccupancyGrid.UNKNOWN, OccupancyGrid.FLOOR, OccupancyGrid.WALL


def surface_of(points):
    xyz = view_of(points).xyz
    n = len(xyz)
    return FloorSurface(
        xyz, np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n),
        np.zeros((0, 3)), np.zeros(0), np.zeros(3),
    )  # fmt: skip


def grid_of(floor, walls, resolution=0.5, mounting=None):
    return rasterize(surface_of(floor), view_of(walls), mounting or Mounting(), resolution)


def test_floor_wall_and_unknown():
    grid = grid_of([(0.2, 0.2, -0.7), (0.7, 0.2, -0.7)], [(1.2, 0.7, 0.0)])
    assert grid.cells.tolist() == [[FLOOR, FLOOR, UNKNOWN], [UNKNOWN, UNKNOWN, WALL]]
    assert (grid.first_column, grid.first_row, grid.width, grid.height) == (0, 0, 3, 2)
    assert grid.cells.dtype == np.int8


def test_a_wall_wins_a_shared_cell():
    assert grid_of([(0.2, 0.2, -0.7)], [(0.3, 0.3, 0.0)]).cells.tolist() == [[WALL]]


def test_cells_are_aligned_to_multiples_of_the_resolution():
    grid = grid_of([(-0.2, 1.3, 0)], [])
    assert (grid.first_column, grid.first_row) == (-1, 2)
    # The edge x = 0.5 belongs to the cell that begins there.
    assert grid_of([(0.5, 0, 0)], []).first_column == 1


def test_what_is_out_of_reach_or_no_return_is_left_out():
    strays = [(50.1, 0, 0), (0, -1e5, 0), (np.nan, 0, 0), (0, 0, 0)]
    assert grid_of(strays + [(49.9, 0, 0)], strays).cells.shape == (1, 1)


def test_nothing_gives_an_empty_grid():
    assert grid_of([], []).cells.shape == (0, 0)


def test_cells_lie_in_the_level_frame():
    # Pitched nose down by 90 deg: the sensor's -x axis points up, its z forward.
    mounting = Mounting(tilt(0.0, 90.0))
    grid = grid_of([(0.7, 0.2, 3.2)], [], mounting=mounting)
    assert (grid.first_column, grid.first_row) == (6, 0)


@pytest.mark.parametrize("resolution", [0.0, 0.009, -1.0, np.nan, np.inf])
def test_a_bad_resolution_is_refused(resolution):
    with pytest.raises(ValueError, match="occupancy_resolution must be >= 0.01"):
        grid_of([], [], resolution)
