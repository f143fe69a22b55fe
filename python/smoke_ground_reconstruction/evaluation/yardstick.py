"""The one yardstick: the score of a floor against the true floor of the scene.

Truth is the floor in line of sight with furniture and people removed and walls kept. True floor
out of sight counts neither way; a claim outside the floor, over a hole or beyond the grid is a
false positive. Cells are 0.2 m (comparable with the thesis) and 0.1 m (hard).
"""

from dataclasses import dataclass

import numpy as np

from smoke_ground_reconstruction.evaluation import grids
from smoke_ground_reconstruction.evaluation.heights import HeightErrors, height_errors
from smoke_ground_reconstruction.evaluation.metrics import Counts, ratio

CELL_SIZES = (0.2, 0.1)
"""Edges of the cells that every accuracy figure is given for [m]."""


@dataclass(frozen=True)
class FloorScore:
    """One output on one truth.

    Attributes:
        grid: CellGrid of all arrays.
        claimed: grids.Occupancy of the output.
        classification: grids.Classification.
        counts: Counts of its cells.
        heights: HeightErrors of its true-positive cells.
        knowable_recall: share of the knowable floor cells that are claimed; None where none is.
        knowable_iou: IoU with the unknowable floor counting neither way; None as above.
        hole_cells, hole_claimed: cells wholly without floor over a drop, and how many are claimed.
        rim_cells, rim_claimed: cells beside a drop, and how many are claimed: no fault, but where
            a robot looks first.
        hole_precision: precision over the cells of the drops and of their 0.3 m rim alone; None
            where nothing of them is claimed.
    """

    grid: grids.CellGrid
    claimed: grids.Occupancy
    classification: grids.Classification
    counts: Counts
    heights: HeightErrors
    knowable_recall: object
    knowable_iou: object
    hole_cells: int
    hole_claimed: int
    rim_cells: int
    rim_claimed: int
    hole_precision: object

    def to_dict(self):
        """Plain numbers by name, lengths in metres."""
        result = self.counts.to_dict()
        result.update(
            beyond_grid=self.classification.beyond,
            knowable_recall=self.knowable_recall,
            knowable_iou=self.knowable_iou,
            hole_cells=self.hole_cells,
            hole_claimed=self.hole_claimed,
            rim_cells=self.rim_cells,
            rim_claimed=self.rim_claimed,
            hole_precision=self.hole_precision,
            height=self.heights.to_dict(),
        )
        return result


def score_floor(xyz, truth):
    """Score an output against a truth.

    Args:
        xyz: (N, 3) points of the claimed floor in the truth's level, sensor-centred frame [m];
            non-finite ones are left out.
        truth: FloorTruth.

    Returns:
        FloorScore.

    Raises:
        ValueError: xyz is not (N, 3).
    """
    xyz = grids.finite_points(xyz)
    grid = grids.CellGrid.of(truth)
    claimed = grids.occupancy(grid, xyz)
    ignored = grids.ignored_cells(truth)
    classification = grids.classify(claimed, truth.visible_floor, ignored)
    hole = truth.hole & ~truth.visible_floor & ~ignored
    rim = truth.hole_rim & ~ignored
    recall, iou = _knowable(claimed, truth, ignored)
    return FloorScore(
        grid=grid,
        claimed=claimed,
        classification=classification,
        counts=Counts.of_cells(classification),
        heights=height_errors(grid, xyz, truth, classification.true_positive),
        knowable_recall=recall,
        knowable_iou=iou,
        hole_cells=int(np.count_nonzero(hole)),
        hole_claimed=int(np.count_nonzero(hole & claimed.cells)),
        rim_cells=int(np.count_nonzero(rim)),
        rim_claimed=int(np.count_nonzero(rim & claimed.cells)),
        hole_precision=_precision_within(hole | rim, classification),
    )


def _precision_within(cells, classification):
    right = int(np.count_nonzero(cells & classification.true_positive))
    wrong = int(np.count_nonzero(cells & classification.false_positive))
    return ratio(right, right + wrong) if right + wrong else None


def _knowable(claimed, truth, ignored):
    """Recall and IoU with the visible floor that the scan cannot tell of counting neither way."""
    unknowable = truth.visible_floor & ~truth.knowable
    if not np.any(truth.visible_floor & truth.knowable & ~ignored):
        return None, None
    counts = Counts.of_cells(grids.classify(claimed, truth.visible_floor, ignored | unknowable))
    return counts.recall, counts.iou


def cell_share(xyz, clear_xyz, truth):
    """Share of the floor cells reached by one cloud that another still reaches.

    This defines the smoke levels: xyz are the floor points of a scan in smoke, clear_xyz those of
    the same pose in clear air, both (N, 3) in the level frame [m].
    """
    grid = grids.CellGrid.of(truth)
    counts = truth.visible_floor & ~grids.ignored_cells(truth)
    clear = grids.occupancy(grid, clear_xyz).cells & counts
    kept = grids.occupancy(grid, xyz).cells & clear
    return ratio(int(np.count_nonzero(kept)), int(np.count_nonzero(clear)))


def level_rotation(T_world_sensor):
    """R_level_sensor, (3, 3) float64: takes out roll and pitch, keeps the heading.

    Args:
        T_world_sensor: (4, 4) or (3, 3) pose of the sensor; the world's z points up.
    """
    R = np.asarray(T_world_sensor, dtype=np.float64)[:3, :3]
    length = np.hypot(R[0, 0], R[1, 0])
    if length < 1e-9:
        raise ValueError("the sensor's x axis is vertical, so its heading is not defined")
    c, s = R[0, 0] / length, R[1, 0] / length
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ R


def to_level(xyz, T_world_sensor):
    """Sensor frame to level, sensor-centred frame: (N, 3) float64 [m]."""
    return np.asarray(xyz, dtype=np.float64) @ level_rotation(T_world_sensor).T
