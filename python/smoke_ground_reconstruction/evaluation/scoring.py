"""All scores of one method on one scan, as plain numbers."""

from smoke_ground_reconstruction.evaluation.calibration import reliability
from smoke_ground_reconstruction.evaluation.heights import covered_share
from smoke_ground_reconstruction.evaluation.point_scores import denoising_score, segmentation_score
from smoke_ground_reconstruction.evaluation.world import Truth
from smoke_ground_reconstruction.evaluation.yardstick import score_floor
from smoke_ground_reconstruction.reference.label import Label


def score_output(output, scan, truths, extinction=None):
    """Score what a method said of a scan.

    Args:
        output: methods.Output.
        scan: ScanInput.
        truths: FloorTruth by edge of its cells [m].
        extinction: of the smoke, in the mean [1/m]; None where it is not known.

    Returns:
        A dict with those of "floor", "calibration" and "coverage" (by edge of the cells, as
        text), "visibility", "denoising", "ground" and "walls" that the output speaks of, and
        "times" in milliseconds by stage.
    """
    scores = {"times": {name: float(value) for name, value in output.times.items()}}
    if output.surface is not None:
        level = scan.to_level(output.surface)
        scores["floor"] = {
            f"{cell:g}": score_floor(level, truth).to_dict() for cell, truth in truths.items()
        }
        if output.confidence is not None:
            scores["calibration"] = {
                f"{cell:g}": reliability(level, output.confidence, truth).to_dict()
                for cell, truth in truths.items()
            }
        if output.sigma is not None:
            scores["coverage"] = {
                f"{cell:g}": covered_share(level, output.sigma, truth)
                for cell, truth in truths.items()
            }
    if output.extinction is not None or output.extinction_after_clear is not None:
        scores["visibility"] = visibility_score(output, extinction)
    if output.kept is not None:
        scores["denoising"] = _denoising(output.kept, scan)
    if output.labels is not None:
        kept, labels, truth = output.kept, output.labels, scan.truth
        scores["ground"] = segmentation_score(labels == Label.GROUND, truth == Truth.FLOOR, kept)
        scores["walls"] = segmentation_score(labels == Label.WALL, truth == Truth.WALL, kept)
    return scores


def visibility_score(output, true):
    """The extinction that an Output tells beside the true one.

    Returns:
        A dict with "true", and "extinction", "sigma" [1/m] and "error" (absolute, as a share of the
        true one) of the scan alone; under "after_clear_air" these three of a method that began
        there. None where nothing is told; no error where there is no smoke.
    """
    return {
        "true": true,
        **_told(output.extinction, true),
        "after_clear_air": _told(output.extinction_after_clear, true),
    }


def _told(extinction, true):
    if extinction is None:
        return {"extinction": None, "sigma": None, "error": None}
    told, sigma = (float(value) for value in extinction)
    error = abs(told - true) / true if true else None
    return {"extinction": told, "sigma": sigma, "error": error}


def _denoising(kept, scan):
    truth = scan.truth
    return denoising_score(
        kept, scan.ranges, truth == Truth.SMOKE, truth == Truth.FLOOR, truth == Truth.WALL
    )
