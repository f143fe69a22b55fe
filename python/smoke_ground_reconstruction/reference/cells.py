"""Square cells of the floor, as numbers."""

import numpy as np


def cell_keys(xyz, size):
    """One number (N,) per cell of a grid aligned to the sensor, for points (N, 2 or 3) [m]."""
    return cell_numbers(np.floor(xyz[:, :2] / size).astype(np.int64))


def cell_numbers(cell):
    """One number (N,) per cell, from columns and rows (N, 2)."""
    return cell[:, 0] * 1000003 + cell[:, 1]
