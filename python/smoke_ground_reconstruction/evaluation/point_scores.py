"""Scores of points: what a denoiser keeps, and how ground and walls are told apart."""

import numpy as np

from smoke_ground_reconstruction.evaluation.metrics import Counts

RANGE_EDGES = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0, np.inf)
"""Limits of the rings of range that scores are split by [m]."""


def share(part, whole):
    """Share of the points of `whole` that are in `part`, both (N,) bool; None if there are none."""
    count = int(np.count_nonzero(whole))
    return float(np.count_nonzero(part & whole)) / count if count else None


def denoising_score(kept, ranges, is_smoke, is_floor, is_wall):
    """How much smoke goes and how much of the room stays.

    Args:
        kept: (N,) bool, the denoiser's answer.
        ranges: (N,) distance to the sensor [m].
        is_smoke, is_floor, is_wall: (N,) bool, the truth.

    Returns:
        smoke_removed, floor_kept, walls_kept in 0..1 (None without such points), precision of what
        is kept (share that is no smoke), and by_range: the same three and the numbers of points
        for each ring of range.
    """
    score = _shares(kept, is_smoke, is_floor, is_wall)
    score["kept_precision"] = share(~is_smoke, kept)
    score["by_range"] = []
    for near, far in zip(RANGE_EDGES[:-1], RANGE_EDGES[1:]):
        ring = (ranges >= near) & (ranges < far)
        row = {"from": near, "to": far if np.isfinite(far) else None}
        row.update(_shares(kept, is_smoke & ring, is_floor & ring, is_wall & ring))
        score["by_range"].append(row)
    return score


def _shares(kept, is_smoke, is_floor, is_wall):
    return {
        "smoke_points": int(np.count_nonzero(is_smoke)),
        "floor_points": int(np.count_nonzero(is_floor)),
        "wall_points": int(np.count_nonzero(is_wall)),
        "smoke_removed": share(~kept, is_smoke),
        "floor_kept": share(kept, is_floor),
        "walls_kept": share(kept, is_wall),
    }


def segmentation_score(predicted, true, candidates=None):
    """How well a class of points is told apart.

    Args:
        predicted, true: (N,) bool.
        candidates: (N,) bool, the points the segmentation was given; all by default. Recall is of
            the true points among them, so that a segmentation does not answer for its denoiser.

    Returns:
        The counts and figures of metrics.Counts by name.
    """
    if candidates is None:
        candidates = np.ones(len(true), dtype=bool)
    return Counts.of_points(predicted[candidates], true[candidates]).to_dict()
