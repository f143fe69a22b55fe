"""Tables of the evaluation as rows of text, for the terminal and the report alike."""

from dataclasses import dataclass
from typing import List

from smoke_ground_reconstruction.evaluation import printed, timing

NOTHING = "–"


@dataclass(frozen=True)
class Table:
    """A title, a row of column names, rows of cells (all text) and a note under it."""

    title: str
    columns: List[str]
    rows: List[List[str]]
    note: str = ""

    def text(self):
        """Fixed-width text."""
        lines = [self.columns] + self.rows
        widths = [max(len(line[i]) for line in lines) for i in range(len(self.columns))]
        shown = [
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip()
            for line in lines
        ]
        shown.insert(1, "  ".join("-" * width for width in widths))
        return "\n".join([self.title] + shown + ([self.note] if self.note else []))


def number(value, digits=2):
    return NOTHING if value is None else f"{value:.{digits}f}"


def millimetres(metres):
    return NOTHING if metres is None else f"{1e3 * metres:+.1f}"


def mean_worst(row, name, digits=2):
    """'mean / worst' of a figure of a summary row."""
    figure = row.get(name)
    if figure is None:
        return NOTHING
    return f"{figure['mean']:.{digits}f} / {figure['worst']:.{digits}f}"


def mean_worst_mm(row, name):
    """'mean / worst' of a length of a summary row in millimetres."""
    figure = row.get(name)
    if figure is None:
        return NOTHING
    return f"{1e3 * figure['mean']:+.1f} / {1e3 * figure['worst']:+.1f}"


def floor_table(title, rows, cells):
    """Floor figures of summary rows, mean and worst scan."""
    columns = ["method", "scene", "smoke", "scans"]
    for cell in cells:
        columns += [f"IoU {cell} m", f"precision {cell} m", f"recall {cell} m"]
    columns += ["knowable recall", "height mean [mm]", "height p95 [mm]"]
    columns += ["holes claimed", "precision at holes"]
    shown = []
    for row in rows:
        if f"iou@{cells[0]}" in row:
            shown.append(_floor_row(row, cells))
    note = (
        "mean / worst scan; heights in 0.2 m cells where scored; precision at holes: over their"
        " own cells and a rim of 0.3 m."
    )
    return Table(title, columns, shown, note)


def _floor_row(row, cells):
    first = cells[0]
    shown = [row["method"], row["scene"], row["level"], _scans(row)]
    for cell in cells:
        shown += [mean_worst(row, f"{name}@{cell}") for name in ("iou", "precision", "recall")]
    shown += [
        mean_worst(row, f"knowable_recall@{first}"),
        mean_worst_mm(row, f"height_mean@{first}"),
        mean_worst_mm(row, f"height_p95@{first}"),
    ]
    holes = row.get(f"hole_claimed@{first}")
    shown.append(NOTHING if holes is None else f"{holes['worst']:.0f}")
    return shown + [mean_worst(row, f"hole_precision@{first}")]


def _scans(row):
    failed = f" ({row['failed']} failed)" if row["failed"] else ""
    return f"{row['scans']}{failed}"


def point_table(title, rows):
    """Denoising and segmentation figures of summary rows, mean and worst scan."""
    names = {
        "smoke_removed": "smoke removed",
        "floor_kept": "floor kept",
        "walls_kept": "walls kept",
        "ground_precision": "ground precision",
        "ground_recall": "ground recall",
        "walls_precision": "wall precision",
        "walls_recall": "wall recall",
    }
    shown = [
        [row["method"], row["scene"], row["level"], _scans(row)]
        + [mean_worst(row, name) for name in names]
        for row in rows
        if any(name in row for name in names)
    ]
    note = "mean / worst scan; shares of points; segmentation among the points it was given."
    return Table(title, ["method", "scene", "smoke", "scans"] + list(names.values()), shown, note)


def visibility_table(title, rows):
    """The extinction that methods tell beside the true one, of summary rows."""
    columns = ["method", "scene", "smoke", "scans", "true [1/m]"]
    for name in ("after clear air", "at first sight"):
        columns += [f"{name} [1/m]", "told", "error"]
    shown = []
    for row in rows:
        if "true_extinction" not in row:
            continue
        true = row["true_extinction"]["mean"]
        cells = [row["method"], row["scene"], row["level"], _scans(row), f"{true:.3f}"]
        for name in ("extinction_after_clear", "extinction"):
            told = row.get(name)
            cells += [NOTHING if told is None else f"{told['mean']:.3f}"]
            cells += [f"{0 if told is None else told['scans']}", mean_worst(row, f"{name}_error")]
        shown.append(cells)
    note = (
        "mean over scans; told: scans that tell an extinction; error: absolute, as a share of the"
        " true one, mean / worst scan that tells one."
    )
    return Table(title, columns, shown, note)


def feature_table(rows):
    """Ground precision and recall without and with the 30 mm feature, by scene and smoke.

    Args:
        rows: of summary.summarise; those of `channel` and `channel_original` are used.
    """
    by_method = {(row["method"], row["scene"], row["level"]): row for row in rows}
    shown = []
    for (method, scene, level), with_feature in by_method.items():
        without = by_method.get(("channel_original", scene, level))
        if method == "channel" and without and "ground_precision" in without:
            pair = (without, with_feature)
            shown.append(
                [scene, level]
                + [f"{row['ground_precision']['mean']:.4f}" for row in pair]
                + [f"{row['ground_recall']['mean']:.4f}" for row in pair]
            )
    columns = ["scene", "smoke", "precision without", "with", "recall without", "with"]
    note = "Ground points after AGDOR, mean over scans; recall among the points AGDOR kept."
    return Table("The thesis's 30 mm range-step feature", columns, shown, note)


def range_table(title, records):
    """Denoising by range: records of one method, scene and level, pooled over scans."""
    pooled = []
    for rings in zip(*(record["scores"]["denoising"]["by_range"] for record in records)):
        to = "" if rings[0]["to"] is None else f"{rings[0]['to']:g}"
        row = [f"{rings[0]['from']:g} – {to}"]
        for points, kept in (
            ("smoke_points", "smoke_removed"),
            ("floor_points", "floor_kept"),
            ("wall_points", "walls_kept"),
        ):
            total = sum(ring[points] for ring in rings)
            hits = sum(ring[points] * ring[kept] for ring in rings if ring[points])
            row += [number(hits / total if total else None), str(total)]
        pooled.append(row)
    columns = ["range [m]", "smoke removed", "of", "floor kept", "of", "walls kept", "of"]
    return Table(title, columns, pooled)


def thesis_table_5_1(method, scores):
    """Table 5.1 beside the printed one.

    Args:
        method: name of the method in the last row.
        scores: yardstick.FloorScore by row name, those of printed.TABLE_5_1 among them.
    """
    rows = []
    for name, score in scores.items():
        label = f"{name} ({method})" if name.startswith("Reconstructed") else name
        ours = [getattr(score.counts, column) for column in printed.TABLE_5_1_COLUMNS]
        rows.append([label, "ours"] + [number(figure) for figure in ours])
        if name in printed.TABLE_5_1:
            rows.append([label, "printed"] + [number(figure) for figure in printed.TABLE_5_1[name]])
    columns = ["classification grid", "", *printed.TABLE_5_1_COLUMNS]
    note = (
        "Ground truth merged from positions 1-4 and filled, disc under the sensor filled in, raw"
        " clouds cut by height, 0.2 m cells: as in Section 5.2.1. One simulated scan."
    )
    return Table("Thesis Table 5.1: basic training room, heavy smoke", columns, rows, note)


def thesis_heights(method, score):
    """Section 5.2.2 beside the printed figures."""
    ours = score.heights.to_dict()
    rows = [
        ["mean", millimetres(ours["mean"]), millimetres(printed.HEIGHT_MEAN)],
        ["median", millimetres(ours["median"]), millimetres(printed.HEIGHT_MEDIAN)],
        ["mean absolute", millimetres(ours["mean_abs"]), NOTHING],
        ["95th percentile of the absolute", millimetres(ours["p95"]), NOTHING],
    ]
    title = "Thesis Section 5.2.2: height of the reconstructed floor minus the true one"
    return Table(title, ["", f"{method} [mm]", "printed [mm]"], rows)


def thesis_table_5_2(method, milliseconds):
    """Table 5.2 beside the printed one.

    Args:
        method: name of the method.
        milliseconds: of a summary row: median by stage.
    """
    medians = {stage: value["median"] for stage, value in milliseconds.items()}
    rows = [
        [
            row["component"],
            f"{row['seconds']:.4f}",
            number(row["hz"], 1),
            f"{100 * row['share']:.1f} %",
            f"{row['printed_seconds']:.2f}",
        ]
        for row in timing.table_5_2(medians)
    ]
    columns = ["component", f"{method}, median [s]", "Hz", "share", "printed [s]"]
    note = (
        "Ours: wall time on this machine, whatever else it did; the method's own line above tells"
        " its engine. Printed: a Jetson Orin Nano with a Python denoiser."
        " The reconstruction's row holds the clustering, for which the thesis prints no row."
    )
    return Table("Thesis Table 5.2: computational speed", columns, rows, note)


def smoke_table(calibrations):
    """The smoke behind each level, one row a scene, pose and level.

    Args:
        calibrations: dicts with scene, pose, level, mean_extinction, visibility, share.
    """
    rows = [
        [
            entry["scene"],
            entry["pose"],
            entry["level"],
            number(entry["mean_extinction"], 3),
            number(entry["visibility"], 1),
            number(entry["share"], 3),
            number(entry["wanted"], 2),
        ]
        for entry in calibrations
    ]
    columns = [
        "scene",
        "pose",
        "smoke",
        "mean extinction [1/m]",
        "meteorological range [m]",
        "floor cells kept",
        "wanted",
    ]
    note = "Share of the pose's clear-air floor cells (0.2 m) that the raw cloud keeps, over seeds."
    return Table("The smoke of each level", columns, rows, note)


WHY_OURS_DIFFERS = (
    "Why these figures are not the printed ones. The thesis measured one scan of one real room that"
    " it does not give the dimensions of; this is a simulated room of our own size, with simulated"
    " smoke. Its listing leaves open the neighbour radius, which side of the density test is kept,"
    " the cluster tolerance and the ring count, and every open point is settled by a stated default"
    " that a parameter can change.",
    "One loss belongs to the method and not to its tuning: one wall distance for a 10 degree"
    " segment, the smallest, cuts off the corners of the floor. The height has two causes that work"
    " against each other: the lowest of many noisy wall points lies below the wall's foot, which"
    " pulls the floor down; where smoke hides the foot, the lowest wall point seen lies above it,"
    " which tilts the floor up.",
)
