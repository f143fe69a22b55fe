"""Hand-made floor truths for the tests of the evaluation."""

from types import SimpleNamespace

import numpy as np

MARGIN = 2
"""Cells around the floor's bounding box: 0.4 m of 0.2 m cells."""


def rectangle_truth(columns=6, rows=4, cell=0.2, floor_z=-0.7):
    """A floor of columns x rows cells centred on the sensor, with MARGIN cells around it."""
    shape = (rows + 2 * MARGIN, columns + 2 * MARGIN)
    floor = np.zeros(shape, dtype=bool)
    floor[MARGIN:-MARGIN, MARGIN:-MARGIN] = True
    none = np.zeros(shape, dtype=bool)
    return SimpleNamespace(
        origin=(-cell * shape[1] / 2, -cell * shape[0] / 2),
        cell=cell,
        shape=shape,
        visible_floor=floor,
        out_of_sight=none.copy(),
        under_sensor=none.copy(),
        hole=none.copy(),
        hole_rim=none.copy(),
        edge_crossing=none.copy(),
        knowable=floor.copy(),
        wall=none.copy(),
        floor_z=np.where(floor, floor_z, np.nan),
    )


def points_of_cells(truth, cells, z=-0.7):
    """One point at the centre of each cell that is set, (N, 3) [m]."""
    rows, columns = np.nonzero(cells)
    x = truth.origin[0] + (columns + 0.5) * truth.cell
    y = truth.origin[1] + (rows + 0.5) * truth.cell
    return np.stack([x, y, np.full(x.shape, float(z))], axis=1)
