"""Mean and worst of the scans' scores, by method, scene and smoke level."""

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Callable, Tuple

import numpy as np

from smoke_ground_reconstruction.evaluation.calibration import pooled


@dataclass(frozen=True)
class Figure:
    """One number of a record.

    Attributes:
        name: in the summary.
        path: keys down into the record's scores.
        worst: picks the worst of several values.
    """

    name: str
    path: Tuple[str, ...]
    worst: Callable


def _widest(values):
    return max(values, key=abs)


def figures(cells):
    """The figures that are summarised.

    Args:
        cells: edges of the cells as text, e.g. ("0.2", "0.1").
    """
    found = []
    for cell in cells:
        for name in ("iou", "recall", "accuracy", "f1", "knowable_recall", "knowable_iou"):
            found.append(Figure(f"{name}@{cell}", ("floor", cell, name), min))
        found.append(Figure(f"coverage@{cell}", ("coverage", cell), min))
        found.append(Figure(f"precision@{cell}", ("floor", cell, "precision"), min))
        found.append(Figure(f"hole_precision@{cell}", ("floor", cell, "hole_precision"), min))
        found.append(Figure(f"hole_claimed@{cell}", ("floor", cell, "hole_claimed"), max))
        for name in ("mean", "median"):
            found.append(Figure(f"height_{name}@{cell}", ("floor", cell, "height", name), _widest))
        for name in ("mean_abs", "p95"):
            found.append(Figure(f"height_{name}@{cell}", ("floor", cell, "height", name), max))
    visibility = ("visibility",), ("visibility", "after_clear_air")
    for name, path in zip(("extinction", "extinction_after_clear"), visibility):
        found.append(Figure(name, (*path, "extinction"), max))
        found.append(Figure(f"{name}_error", (*path, "error"), max))
    found.append(Figure("true_extinction", ("visibility", "true"), max))
    for name in ("smoke_removed", "floor_kept", "walls_kept"):
        found.append(Figure(name, ("denoising", name), min))
    for kind in ("ground", "walls"):
        for name in ("precision", "recall", "f1"):
            found.append(Figure(f"{kind}_{name}", (kind, name), min))
    return found


def lookup(scores, path):
    """The number at a path of keys; None where the scan has none.

    The precision of a scan that claims nothing is none either: it would count silence as error.
    """
    for key in path:
        if not isinstance(scores, dict) or scores.get(key) is None:
            return None
        if path[-1] == "precision" and key == "precision" and not _claims(scores):
            return None
        scores = scores[key]
    return scores


def _claims(scores):
    return scores["true_positive"] + scores["false_positive"] > 0


def statistics(records, cells):
    """Mean and worst of each figure over records, with the number of scans that have it."""
    result = {"scans": len(records)}
    for figure in figures(cells):
        values = [lookup(record["scores"], figure.path) for record in records]
        values = [value for value in values if value is not None and math.isfinite(value)]
        if values:
            result[figure.name] = {
                "mean": float(np.mean(values)),
                "worst": float(figure.worst(values)),
                "scans": len(values),
            }
    result["milliseconds"] = _times(records)
    for cell in cells:
        path = ("calibration", cell)
        found = pooled(filter(None, (lookup(record["scores"], path) for record in records)))
        if found is not None:
            result[f"calibration@{cell}"] = found.summary()
    return result


def _times(records):
    """Median and 99th percentile of each stage [ms]."""
    stages = sorted({stage for record in records for stage in record["scores"]["times"]})
    times = {}
    for stage in stages:
        values = [r["scores"]["times"][stage] for r in records if stage in r["scores"]["times"]]
        times[stage] = {
            "median": float(np.median(values)),
            "p99": float(np.percentile(values, 99)),
        }
    return times


def grouped(records, *keys):
    """Records by the values of some keys, in order of first appearance."""
    groups = OrderedDict()
    for record in records:
        groups.setdefault(tuple(record[key] for key in keys), []).append(record)
    return groups


def summarise(records, cells):
    """Rows by method, scene and level, then by method and level over groups of scenes.

    Args:
        records: of runner.run; those with an "error" are counted, not scored.
        cells: edges of the cells as text.

    Returns:
        List of dicts: method, scene, level, scans, failed and the figures. The scene of a group is
        "bounded scenes" or "all scenes", one of them where they are the same; every scan weighs
        the same.
    """
    rows = [
        _row(method, scene, level, group, cells)
        for (method, scene, level), group in grouped(records, "method", "scene", "level").items()
    ]
    for scene, chosen in _scene_groups(records):
        for (method, level), group in grouped(chosen, "method", "level").items():
            rows.append(_row(method, scene, level, group, cells))
    return rows


def _scene_groups(records):
    if len({record["scene"] for record in records}) < 2:
        return []
    bounded = [record for record in records if record["bounded"]]
    groups = [("bounded scenes", bounded)] if bounded else []
    return groups if len(bounded) == len(records) else [*groups, ("all scenes", records)]


def _row(method, scene, level, records, cells):
    scored = [record for record in records if "error" not in record]
    row = {"method": method, "scene": scene, "level": level, "failed": len(records) - len(scored)}
    row.update(statistics(scored, cells))
    return row
