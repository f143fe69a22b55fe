"""The thesis's own table (5.1) and heights (5.2.2), made the way the thesis made them.

Ground truth is the floor seen in clear air from four positions, merged, cleaned of what is no floor
and filled where nobody saw it; the disc under the sensor is filled in. That differs from the
yardstick, which knows the true floor, so these figures stand in a table of their own.
"""

from dataclasses import dataclass
from typing import Tuple

import numpy as np
from scipy.ndimage import binary_fill_holes

from smoke_ground_reconstruction.evaluation.grids import CellGrid, mean_height, occupancy
from smoke_ground_reconstruction.evaluation.yardstick import level_rotation, score_floor

MARGIN = 0.3
"""Around the merged floor's bounding box [m]."""


@dataclass(frozen=True)
class MergedTruth:
    """A FloorTruth as the thesis made it; every attribute as FloorTruth's, no cell is ignored."""

    origin: Tuple[float, float]
    cell: float
    visible_floor: np.ndarray
    floor_z: np.ndarray
    under_sensor_disc: np.ndarray

    @property
    def _none(self):
        return np.zeros_like(self.visible_floor)

    out_of_sight = under_sensor = hole = hole_rim = edge_crossing = _none

    @property
    def knowable(self):
        return self.visible_floor


def merge_floor_points(scans_and_poses, reference_pose):
    """Floor points of several scans in the level frame of one position.

    Args:
        scans_and_poses: pairs of (M, 3) floor points in the sensor frame [m] and T_world_sensor.
        reference_pose: T_world_sensor of the position to look from.

    Returns:
        (K, 3) float64 [m].
    """
    R_level_world = level_rotation(reference_pose) @ reference_pose[:3, :3].T
    merged = [
        (points @ pose[:3, :3].T + pose[:3, 3] - reference_pose[:3, 3]) @ R_level_world.T
        for points, pose in scans_and_poses
    ]
    return np.vstack(merged)


def without_outliers(points, truth):
    """The points that lie in cells of true floor: the thesis removed the others by hand.

    Args:
        points: (K, 3) in the level frame [m].
        truth: FloorTruth of the position to look from.

    Returns:
        (L, 3) float64 [m].
    """
    grid = CellGrid.of(truth)
    rows, columns = grid.rows_columns(points)
    keep = grid.contains(rows, columns)
    is_floor = truth.visible_floor | truth.out_of_sight
    keep[keep] = is_floor[rows[keep], columns[keep]]
    return points[keep]


def merged_truth(points, cell, disc_radius):
    """Ideal occupancy grid of merged floor points (thesis Figure 5.5a).

    Args:
        points: (K, 3) floor points in the level frame of the position to look from [m].
        cell: edge of a cell [m].
        disc_radius: of the blind disc under the sensor [m].

    Returns:
        MergedTruth; cells that nobody saw but that lie inside the floor are filled, their height
        is unknown (NaN) and not scored.
    """
    low = np.floor((points[:, :2].min(axis=0) - MARGIN) / cell).astype(np.int64)
    high = np.ceil((points[:, :2].max(axis=0) + MARGIN) / cell).astype(np.int64)
    shape = (int(high[1] - low[1]), int(high[0] - low[0]))
    grid = CellGrid((float(low[0] * cell), float(low[1] * cell)), cell, shape)
    x, y = grid.centres()
    disc = x**2 + y**2 <= disc_radius**2
    seen = occupancy(grid, points).cells
    return MergedTruth(
        origin=grid.origin,
        cell=cell,
        visible_floor=binary_fill_holes(seen | disc),
        floor_z=mean_height(grid, points),
        under_sensor_disc=disc,
    )


def fill_disc(xyz, truth, z):
    """Add a point at the centre of each cell of the disc under the sensor, at height z [m]."""
    x, y = CellGrid.of(truth).centres()
    disc = truth.under_sensor_disc
    filled = np.stack([x[disc], y[disc], np.full(np.count_nonzero(disc), float(z))], axis=1)
    return np.vstack([np.asarray(xyz, dtype=np.float64), filled])


def score_as_thesis(xyz, truth, sensor_height):
    """Score an output against the merged truth, the disc under the sensor filled in.

    Args:
        xyz: (N, 3) points in the level frame [m].
        truth: MergedTruth.
        sensor_height: [m].

    Returns:
        yardstick.FloorScore.
    """
    score = score_floor(fill_disc(xyz, truth, -sensor_height), truth)
    plain = score_floor(xyz, truth)  # heights of the output alone, without what was filled in
    return type(score)(**{**vars(score), "heights": plain.heights})
