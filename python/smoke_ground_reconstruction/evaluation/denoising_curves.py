"""Smoke removed against floor kept, as curves over the parameters of every denoiser."""

import numpy as np

from smoke_ground_reconstruction.evaluation import drawing
from smoke_ground_reconstruction.evaluation.baselines import denoisers
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.point_scores import share
from smoke_ground_reconstruction.evaluation.world import Truth
from smoke_ground_reconstruction.params import AgdorParams
from smoke_ground_reconstruction.reference.agdor_filter import count_neighbors
from smoke_ground_reconstruction.reference.scan import Scan, ScanView

NEIGHBORS = (0, 1, 2, 3, 5, 8, 12, 20, 35, 60, 100, 170, 300, 500, 800, 1300, 2000)

AGDOR_SETS = {
    "AGDOR 0.2 r (printed alpha, theta in degrees)": {"alpha": 0.5, "theta_unit": "degrees"},
    "AGDOR 0.1 r": {"alpha": 0.25, "theta_unit": "degrees"},
    "AGDOR 0.05 r": {"alpha": 0.125, "theta_unit": "degrees"},
    "AGDOR 3 theta r (theta in radians)": {"alpha": 3.0, "theta_unit": "radians"},
    "AGDOR 0.5 theta r (printed alpha, radians)": {"alpha": 0.5, "theta_unit": "radians"},
}
"""Search radii of the curves; each curve runs over the least number of neighbours to be kept."""

BASELINES = {
    "intensity threshold": (denoisers.intensity_threshold, "threshold", (2, 3, 5, 8, 12, 18, 25)),
    "ROR": (denoisers.ror, "radius", (0.02, 0.03, 0.05, 0.08, 0.1, 0.15)),
    "SOR": (denoisers.sor, "std_mul", (-0.5, 0.0, 0.5, 1.0, 2.0)),
    "DROR": (denoisers.dror, "min_radius", (0.0, 0.01, 0.02, 0.04, 0.06)),
    "DSOR": (denoisers.dsor, "range_mul", (0.05, 0.1, 0.2, 0.4, 0.8, 1.5)),
    "LIOR": (denoisers.lior, "radius", (0.02, 0.03, 0.05, 0.08, 0.1, 0.15)),
    "AORI-like": (denoisers.aori_like, "margin", (0.002, 0.005, 0.01, 0.02, 0.05, 0.1)),
}
"""Function, the parameter that its curve runs over, and the values."""


def agdor_curves(scan):
    """What AGDOR does to a scan over its parameters.

    Neighbours are counted once a radius; keeping the denser or the sparser neighbourhoods (the
    listing and the text of the thesis) follows from the same counts.

    Returns:
        By name of the curve a list of rows: parameter, smoke_removed, floor_kept, walls_kept.
    """
    view = Scan(ScanView(scan.xyz, scan.intensity, scan.ring))
    suspects = np.flatnonzero(scan.intensity < AgdorParams().intensity_threshold)
    curves = {}
    for name, changes in AGDOR_SETS.items():
        counts = count_neighbors(view, suspects, AgdorParams(**changes).radius_per_range())
        curves[name] = [
            _row(scan, least, _without(scan, suspects[counts <= least])) for least in NEIGHBORS
        ]
        if name.startswith("AGDOR 0.2 r"):
            curves["AGDOR 0.2 r, sparse kept (the text's reading)"] = [
                _row(scan, most, _without(scan, suspects[counts > most])) for most in NEIGHBORS
            ]
    return curves


def baseline_curves(scan):
    """The same for every baseline that can run here."""
    curves = {}
    for name, (keep, parameter, values) in BASELINES.items():
        try:
            curves[name] = [
                _row(scan, value, keep(scan.xyz, scan.intensity, scan.ring, **{parameter: value}))
                for value in values
            ]
        except BaselineUnavailableError:
            continue
    return curves


def _without(scan, removed):
    kept = np.ones(len(scan), dtype=bool)
    kept[removed] = False
    return kept


def _row(scan, value, kept):
    return {
        "parameter": value,
        "smoke_removed": share(~kept, scan.truth == Truth.SMOKE),
        "floor_kept": share(kept, scan.truth == Truth.FLOOR),
        "walls_kept": share(kept, scan.truth == Truth.WALL),
    }


def draw_curves(agdor, baselines, title):
    """Both families of curves in one picture; the upper right corner is what one wants."""
    figure, axes = drawing.new_figure(2, width=6.0, height=5.2)
    for panel, curves, heading in zip(
        axes[0], (agdor, baselines), ("AGDOR over its neighbour threshold", "Baselines")
    ):
        for index, (name, rows) in enumerate(curves.items()):
            _draw_curve(panel, f"C{index}", name, rows)
        panel.set_title(f"{heading}\n{title}", fontsize=10)
        panel.set_xlabel("share of floor points kept")
        panel.set_ylabel("share of smoke points removed")
        panel.set_xlim(-0.02, 1.02)
        panel.set_ylim(-0.02, 1.02)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7, loc="center", framealpha=0.7)
    drawing.finish(figure)
    return figure


def _draw_curve(panel, colour, name, rows):
    """One curve; its point nearest to the corner that one wants is marked with its parameter."""
    kept = np.array([row["floor_kept"] for row in rows])
    removed = np.array([row["smoke_removed"] for row in rows])
    best = int(np.argmin(np.hypot(1.0 - kept, 1.0 - removed)))
    label = f"{name}; best at {rows[best]['parameter']:g}"
    panel.plot(kept, removed, "-o", color=colour, markersize=3, label=label)
    panel.plot(kept[best], removed[best], "o", color=colour, markersize=9, fillstyle="none")
