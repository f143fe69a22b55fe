"""What room_boundary says about its own certainty, over all scenes and smoke levels.

Each scene begins in clear air, as a robot does that drives into smoke.
"""

import numpy as np

from smoke_ground_reconstruction.evaluation import drawing, world
from smoke_ground_reconstruction.evaluation.calibration import Reliability, cell_confidence
from smoke_ground_reconstruction.reference.room_boundary import RoomBoundary
from smoke_ground_reconstruction.reference.scan import Mounting, ScanView
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

CELL = 0.1
TOLERANCE = 0.2  # of the extinction
LEVEL_COLOURS = {
    "clear": "#2a9d8f",
    "light": "#8ab17d",
    "heavy": "#e9c46a",
    "very_heavy": "#f4a261",
    "extreme": "#d62828",
}
_SHARES = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.2, 0.5, 1.0)  # of wrong cells, edges of the bins
_LEAST_CELLS = 20  # of a bin that is drawn


def _results(request):
    """Scene, level, pose, scan and RoomBoundaryResult of each scan."""
    for scene in world.scenes():
        method, pose = RoomBoundary(), world.poses(scene, "main")[0]
        for level in LEVEL_COLOURS:
            scan = request.scan(scene, pose, level)
            sensor = SensorModel.from_elevations(scan.elevation_deg)
            view = ScanView(scan.xyz, scan.intensity, scan.ring)
            sensor.observe(view)
            mounting = Mounting(sensor_height=scan.sensor_height)
            yield scene, level, pose, scan, method.reconstruct(view, sensor, mounting)


def figure_calibration(request):
    """Wrong cells by the share of wrong cells that the confidence says."""
    confidence, right = [], []
    for scene, level, pose, scan, found in _results(request):
        truth = world.truth(scene, request.sensor, pose, CELL, level, request.seed)
        xyz = scan.to_level(found.surface.xyz)
        _, sure, floor = cell_confidence(xyz, found.surface.confidence, truth)
        confidence.append(sure)
        right.append(floor)
    confidence, right = np.concatenate(confidence), np.concatenate(right)
    rows = _by_share(1.0 - confidence, ~right)
    figure, axes = drawing.new_figure(2)
    _draw_reliability(axes[0, 0], rows)
    _draw_counts(axes[0, 1], rows)
    drawing.finish(figure)
    return figure, {"all": Reliability.of(confidence, right).summary(), "bins": rows}


def _by_share(said, wrong):
    slot = np.clip(np.digitize(said, _SHARES) - 1, 0, len(_SHARES) - 2)
    return [
        {
            "from": _SHARES[k],
            "to": _SHARES[k + 1],
            "cells": int(np.count_nonzero(slot == k)),
            "wrong": int(np.count_nonzero(wrong[slot == k])),
            "said": float(said[slot == k].mean()) if np.any(slot == k) else None,
        }
        for k in range(len(_SHARES) - 1)
    ]


def _draw_reliability(axes, rows):
    rows = [row for row in rows if row["cells"] >= _LEAST_CELLS]
    said = np.array([row["said"] for row in rows])
    cells = np.array([row["cells"] for row in rows])
    wrong = np.array([row["wrong"] for row in rows])
    share = (wrong + 0.5) / (cells + 1.0)
    error = np.sqrt(share * (1.0 - share) / cells)
    axes.plot([1e-6, 1], [1e-6, 1], color="grey", lw=1, label="as said")
    axes.errorbar(said, share, yerr=np.minimum(2 * error, 0.9 * share), fmt="o", color="#264653")
    axes.set(xscale="log", yscale="log", xlim=(1e-6, 1), ylim=(1e-6, 1))
    axes.set_xlabel("1 - confidence: share of wrong cells that is said")
    axes.set_ylabel("share of wrong cells, 2 sigma")
    axes.set_title("(a) Claimed cells of 0.1 m, all scenes and levels", fontsize=10)
    axes.legend(fontsize=8)


def _draw_counts(axes, rows):
    place = np.arange(len(rows))
    axes.bar(place - 0.2, [row["cells"] for row in rows], 0.38, color="#2a9d8f", label="cells")
    axes.bar(place + 0.2, [row["wrong"] for row in rows], 0.38, color="#d62828", label="wrong")
    axes.set_yscale("log")
    axes.set_xticks(place)
    axes.set_xticklabels([f"{row['to']:g}" for row in rows])
    axes.set_xlabel("1 - confidence, up to")
    axes.set_title("(b) Number of cells", fontsize=10)
    axes.legend(fontsize=8)


def figure_visibility(request):
    """The extinction told from the walls beside the true one."""
    rows = []
    for scene, level, pose, _, found in _results(request):
        true = world.calibration(scene, request.sensor, pose, level)["mean_extinction"]
        told = found.visibility
        is_told = bool(np.isfinite(told.extinction))
        rows.append(
            {
                "scene": scene,
                "level": level,
                "true": true,
                "told": told.extinction if is_told else None,
                "sigma": told.sigma if is_told else None,
            }
        )
    figure, axes = drawing.new_figure(1)
    _draw_visibility(axes[0, 0], rows)
    drawing.finish(figure)
    return figure, {"within": _within(rows), "scans": rows}


def _within(rows):
    """Number of scans within TOLERANCE, and of all, by level."""
    counts = {}
    for level in LEVEL_COLOURS:
        of_level = [row for row in rows if row["level"] == level and row["true"] > 0.0]
        good = [
            row
            for row in of_level
            if row["told"] is not None and abs(row["told"] - row["true"]) <= TOLERANCE * row["true"]
        ]
        if of_level:
            counts[level] = [len(good), len(of_level)]
    return counts


def _draw_visibility(axes, rows):
    most = 1.1 * max(row["true"] for row in rows)
    axes.fill_between([0, most], 0, [0, most * (1 + TOLERANCE)], color="#dddddd")
    axes.fill_between([0, most], 0, [0, most * (1 - TOLERANCE)], color="white")
    axes.plot([0, most], [0, most], color="grey", lw=1)
    for level, colour in LEVEL_COLOURS.items():
        of_level = [row for row in rows if row["level"] == level and row["told"] is not None]
        axes.errorbar(
            [row["true"] for row in of_level],
            [row["told"] for row in of_level],
            yerr=[row["sigma"] for row in of_level],
            fmt="o",
            ms=4,
            lw=1,
            color=colour,
            label=level.replace("_", " "),
        )
    axes.set(xlim=(0, most), ylim=(0, most))
    axes.set_xlabel("true mean extinction [1/m]")
    axes.set_ylabel("extinction told, 1 sigma [1/m]")
    axes.set_title("Begun in clear air; grey: within 20 %", fontsize=10)
    axes.legend(fontsize=8)
