"""The picture's content: what each cell and each edge says of the floor."""

import numpy as np

from smoke_ground_reconstruction import view
from smoke_ground_reconstruction.io.clouds import Floor


def floor_of(points, provenance, walls=None):
    count = len(points)
    return Floor(
        xyz=np.array(points, np.float32).reshape(-1, 3),
        ring=np.zeros(count, np.uint16),
        provenance=np.array(provenance, np.uint8),
        confidence=np.ones(count, np.float32),
        intensity=np.zeros(count, np.float32),
        walls=None if walls is None else np.array(walls, np.float32).reshape(-1, 3),
    )


def cell_at(floor, x, y):
    corner, cells = view.floor_cells(floor)
    i, j = np.floor(np.array([x, y]) / view.CELL).astype(int) - corner
    return cells[i, j]


def test_a_cell_says_the_surest_thing_known_of_it():
    points = [[1.01, 0, 0], [1.02, 0, 0], [2.01, 0, 0], [3.01, 0, 0], [3.02, 0, 0]]
    floor = floor_of(points, [1, 0, 1, 1, 2])
    assert cell_at(floor, 1.05, 0.05) == view.MEASURED
    assert cell_at(floor, 2.05, 0.05) == view.RECONSTRUCTED
    assert cell_at(floor, 3.05, 0.05) == view.MEASURED_BEFORE
    assert cell_at(floor, 1.5, 0.05) == view.UNKNOWN


def test_a_wall_hides_a_floor_in_its_cell():
    floor = floor_of([[1.01, -0.5, 0]], [0], walls=[[1.05, -0.45, 1.0]])
    assert cell_at(floor, 1.05, -0.45) == view.WALL


def test_without_a_floor_all_is_unknown_and_said_so():
    floor = floor_of([], [])
    _, cells = view.floor_cells(floor)
    assert (cells == view.UNKNOWN).all()
    (axes,) = view.draw_floor(floor, "empty").axes
    assert "NO FLOOR FOUND" in axes.get_title()


def test_a_stray_point_far_away_does_not_shrink_the_picture():
    floor = floor_of([[1, 0, 0], [5000, 0, 0]], [0, 0])
    assert view.floor_cells(floor)[1].size < 100_000


def test_the_less_certain_end_speaks_for_an_edge():
    kinds = view.edge_kinds(np.array([0, 0, 1, 2], np.uint8))
    np.testing.assert_array_equal(kinds, [0, 1, 2, 2])


def test_forward_is_up_and_left_is_left():
    floor = floor_of([[2, 0, 0], [0, 1, 0]], [0, 1])
    (axes,) = view.draw_floor(floor, "axes").axes
    image = axes.get_images()[0]
    left, right, low, high = image.get_extent()
    rows, columns = image.get_array().shape
    values = np.asarray(image.get_array())
    row, column = np.argwhere(values == view.MEASURED)[0]  # the point ahead
    assert low + (row + 0.5) / rows * (high - low) > 1.9
    row, column = np.argwhere(values == view.RECONSTRUCTED)[0]  # the point to the left
    assert left + (column + 0.5) / columns * (right - left) < -0.9
