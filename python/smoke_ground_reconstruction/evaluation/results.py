"""From records to a file for machines and a page for people."""

import json
import math
from dataclasses import asdict

import numpy as np

from smoke_ground_reconstruction.evaluation import charts, figures, report, tables, world
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.summary import grouped, summarise

FORMAT = 1
"""Raised whenever a name in the JSON changes its meaning."""


def collect(plan, records):
    """All that is known of a run, as plain data.

    Args:
        plan: runner.Plan.
        records: of runner.run.

    Returns:
        A dict with format, plan, methods, scenes, smoke, summary and records.
    """
    cells = [f"{cell:g}" for cell in plan.cells]
    return {
        "format": FORMAT,
        "plan": asdict(plan),
        "methods": {name: _about(name) for name in plan.methods},
        "scenes": {
            scene: {"title": world.title(scene), "bounded": world.is_bounded(scene)}
            for scene in plan.scenes
        },
        "smoke": calibrations(plan),
        "summary": summarise(records, cells),
        "records": records,
    }


def _about(name):
    chosen = method(name)
    return {"kind": chosen.kind, "about": chosen.about}


def calibrations(plan):
    """The smoke of each scene, pose and level of a plan."""
    return [
        dict(
            world.calibration(scene, plan.sensor, pose, level), scene=scene, pose=pose, level=level
        )
        for scene in plan.scenes
        for pose in world.poses(scene, plan.poses)
        for level in plan.levels
    ]


def write_json(found, path):
    """Write what collect() returned; numbers that are not finite become null."""
    text = json.dumps(_finite(found), sort_keys=True, separators=(",", ":"))
    path.write_text(text + "\n", encoding="utf-8")


def _finite(value):
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, (np.integer, np.bool_)):
        return value.item()
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value


def write_report(found, plan, path):
    """Write the HTML page.

    Returns:
        The tables that say most, for the terminal.
    """
    cells = [f"{cell:g}" for cell in plan.cells]
    overview = tables.floor_table("Floor, over scenes", _overview(found["summary"]), cells)
    sections = [("What was run", _intro(found, plan))]
    sections.append(("Floor", _floor_section(found, overview, cells)))
    shown = [overview] if overview.rows else []
    for name in _pipelines(plan):
        thesis_tables, html = _thesis_section(found, plan, name)
        shown += thesis_tables
        sections.append((f"Beside the thesis: {name}", html))
    feature = tables.feature_table(_overview(found["summary"]))
    if feature.rows:
        shown.append(feature)
        sections.append(("The 30 mm feature", report.table_html(feature)))
    title = "Visibility: the smoke's extinction as told and as it is"
    visibility = tables.visibility_table(title, found["summary"])
    if visibility.rows:
        shown.append(tables.visibility_table(title, _overview(found["summary"])))
        sections.append(("Visibility", report.table_html(visibility)))
    title = "Points: denoising and segmentation"
    points = tables.point_table(title, found["summary"])
    if points.rows:
        shown.append(tables.point_table(title, _overview(found["summary"])))
        html = report.table_html(points) + _ranges(found["records"])
        sections.append(("Denoising and segmentation", html + _curves(plan)))
    smoke = report.table_html(tables.smoke_table(found["smoke"])) + _effects(plan)
    sections.append(("Smoke", smoke))
    failures = _failures(found["records"])
    if failures:
        sections.append(("Scans that a method refused", failures))
    path.write_text(report.page("Evaluation on simulated rooms", sections), encoding="utf-8")
    return shown


def _overview(summary):
    groups = [row for row in summary if row["scene"].endswith(" scenes")]
    return groups or summary


def _pipelines(plan):
    """Methods whose figures stand beside the thesis's, where its room was run."""
    has_room = figures.BASIC in plan.scenes and "heavy" in plan.levels
    return [name for name in plan.methods if has_room and method(name).kind == "pipeline"]


def _intro(found, plan):
    methods = "; ".join(f"{name}: {entry['about']}" for name, entry in found["methods"].items())
    open_scenes = [name for name, entry in found["scenes"].items() if not entry["bounded"]]
    return "".join(
        report.paragraph(text)
        for text in (
            f"{len(found['records'])} results: {len(plan.scenes)} scenes, smoke"
            f" {', '.join(plan.levels)}, {plan.seeds} seeds, sensor {plan.sensor}.",
            f"Methods: {methods}.",
            "Simulated smoke, not real smoke. Truth is the floor in line of sight without furniture"
            " and people; floor out of sight counts neither way; a claim beyond the floor or over a"
            " hole is a false positive. Cells of 0.2 m compare with the thesis, 0.1 m are harder.",
            f"Scenes that are not bounded: {', '.join(open_scenes) or 'none'}.",
        )
    )


def _floor_section(found, overview, cells):
    if not overview.rows:
        return report.paragraph("No method that was run claims a floor.")
    parts = [report.table_html(overview)]
    parts.append(
        report.figure_html(
            charts.iou_by_level(_overview(found["summary"]), cells),
            "IoU of the floor by smoke level: mean (line) and worst scan (dots)",
        )
    )
    scenes = [row for row in found["summary"] if not row["scene"].endswith(" scenes")]
    for level, rows in grouped(scenes, "level").items():
        table = tables.floor_table(f"Floor, {level[0]}", rows, cells)
        parts.append(report.details(f"Scene by scene: {level[0]}", report.table_html(table)))
    return "".join(parts)


def _thesis_section(found, plan, name):
    """Tables 5.1 and 5.2, the heights and figures 5.5 to 5.7 for one pipeline."""
    request = figures.Request(name, plan.sensor)
    scores = figures.thesis_scores(request)
    times = next(
        row["milliseconds"]
        for row in found["summary"]
        if (row["method"], row["scene"], row["level"]) == (name, figures.BASIC, "heavy")
    )
    shown = [
        tables.thesis_table_5_1(name, scores),
        tables.thesis_heights(name, scores[figures.RECONSTRUCTED]),
        tables.thesis_table_5_2(name, times),
    ]
    html = "".join(report.table_html(table) for table in shown)
    html += "".join(report.paragraph(text) for text in tables.WHY_OURS_DIFFERS)
    numbers = ["5.2", "5.5", "5.6", "5.7"]
    if figures.COMPLEX in plan.scenes:
        numbers += ["5.3", "5.4"]
    for number in numbers:
        drawn, _ = figures.FIGURES[number](request)
        html += report.figure_html(drawn, f"As Figure {number} of the thesis: {name}")
    return shown, html


def _ranges(records):
    """Denoising by range of each method, scene and level, folded away."""
    scored = [record for record in records if "denoising" in record.get("scores", {})]
    parts = []
    for (name, scene, level), group in grouped(scored, "method", "scene", "level").items():
        table = tables.range_table(f"{name}, {scene}, {level}", group)
        parts.append(report.table_html(table))
    return report.details("Denoising by range", "".join(parts)) if parts else ""


def _effects(plan):
    """What smoke does to a scan (Figure 2.1), where its room was run."""
    if figures.BASIC not in plan.scenes or "heavy" not in plan.levels:
        return ""
    drawn, numbers = figures.FIGURES["2.1"](figures.Request(sensor=plan.sensor))
    text = (
        f"In heavy smoke the basic room's scan loses {100 * numbers['floor_points_lost']:.0f} % of"
        f" its floor points; {100 * numbers['smoke_share_of_returns']:.0f} % of all returns are"
        " smoke. One scan."
    )
    return report.paragraph(text) + report.figure_html(drawn, "As Figure 2.1 of the thesis")


def _curves(plan):
    """The curves of all denoisers, where a denoiser was run on their room."""
    has_denoiser = any(method(name).kind == "denoiser" for name in plan.methods)
    if not has_denoiser or figures.BASIC not in plan.scenes or "heavy" not in plan.levels:
        return ""
    drawn, _ = figures.FIGURES["agdor"](figures.Request(sensor=plan.sensor))
    return report.figure_html(drawn, "Smoke removed against floor kept, over each parameter")


def _failures(records):
    lines = [
        f"{r['method']} on {r['scene']}, {r['level']}, seed {r['seed']}: {r['error']}"
        for r in records
        if "error" in r
    ]
    return "".join(report.paragraph(line) for line in lines)
