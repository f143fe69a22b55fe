"""The figures of the thesis, one function each, on simulated rooms.

Every function takes a Request and returns a matplotlib figure and the numbers behind it as a plain
dict. Where the thesis shows a photograph the floor plan stands in its place.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import ListedColormap, to_rgba

from smoke_ground_reconstruction.evaluation import (
    certainty,
    denoising_curves,
    drawing,
    thesis_table,
    world,
)
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.grids import CellGrid, occupancy
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.point_scores import RANGE_EDGES, share
from smoke_ground_reconstruction.evaluation.scoring import score_output
from smoke_ground_reconstruction.evaluation.world import Truth
from smoke_ground_reconstruction.reference.label import Label

BASIC, COMPLEX = "basic_room", "complex_room"
CELL = 0.2


@dataclass(frozen=True)
class Request:
    """What to draw a figure with: method that reconstructs, sensor, seed of the smoke."""

    method: str = "polar_segments"
    sensor: str = "qt128"
    seed: int = 0

    def scan(self, scene, pose, level):
        return world.scan(scene, self.sensor, pose, level, self.seed)


def figure_2_1(request):
    """What smoke does: clouds by intensity, intensity by class, floor lost and smoke by range."""
    pose = centre_pose()
    clear, heavy = (request.scan(BASIC, pose, level) for level in ("clear", "heavy"))
    figure, axes = drawing.new_figure(2, 2)
    _draw_by_intensity(axes[0, 0], clear, "(a) Without smoke")
    _draw_by_intensity(axes[0, 1], heavy, "(b) Heavy smoke")
    for panel in axes[0]:
        drawing.intensity_bar(figure, panel)
    numbers = {"by_class": _intensity_by_class(axes[1, 0], clear, heavy)}
    numbers["by_range"] = _loss_by_range(axes[1, 1], clear, heavy)
    floor_clear, floor_heavy = (np.count_nonzero(s.truth == Truth.FLOOR) for s in (clear, heavy))
    numbers["floor_points_lost"] = 1.0 - floor_heavy / floor_clear
    numbers["smoke_share_of_returns"] = float(np.mean(heavy.truth == Truth.SMOKE))
    drawing.finish(figure)
    return figure, numbers


def _draw_by_intensity(axes, scan, title, kept=None):
    shown = scan.truth != Truth.CEILING
    if kept is not None:
        shown &= kept
    colours = drawing.intensity_colours(scan.intensity[shown])
    drawing.draw_cloud(axes, scan.to_level(scan.xyz[shown]), colours, f"{title}, ceiling left out")


def _intensity_by_class(axes, clear, heavy):
    rows = []
    cases = [
        ("floor, clear", clear, Truth.FLOOR, "floor", "-"),
        ("floor, heavy smoke", heavy, Truth.FLOOR, "floor", "--"),
        ("wall, clear", clear, Truth.WALL, "wall", "-"),
        ("wall, heavy smoke", heavy, Truth.WALL, "wall", "--"),
        ("smoke", heavy, Truth.SMOKE, "smoke", "-"),
    ]
    bins = np.arange(0, 257, 2)
    for name, scan, truth, colour, style in cases:
        values = scan.intensity[scan.truth == truth]
        if len(values):
            weights = np.full(len(values), 1.0 / len(values))
            colour = drawing.CLASS_COLOURS[colour]
            axes.hist(
                values, bins, weights=weights, histtype="step", label=name, color=colour, ls=style
            )
            low, median, high = np.percentile(values, [5, 50, 95])
            rows.append({"class": name, "p5": low, "median": median, "p95": high})
    axes.axvline(25, color="grey", lw=1)
    axes.text(26, axes.get_ylim()[1] * 0.9, "threshold 25", fontsize=8, color="grey")
    axes.set_xlabel("intensity")
    axes.set_ylabel("share of the class's points")
    axes.set_title("(c) Intensity by class", fontsize=10)
    axes.legend(fontsize=8)
    return rows


def _loss_by_range(axes, clear, heavy):
    rows = []
    for near, far in zip(RANGE_EDGES[:-1], RANGE_EDGES[1:]):
        in_clear, in_heavy = ((s.ranges >= near) & (s.ranges < far) for s in (clear, heavy))
        before = np.count_nonzero(in_clear & (clear.truth == Truth.FLOOR))
        after = np.count_nonzero(in_heavy & (heavy.truth == Truth.FLOOR))
        rows.append(
            {
                "from": near,
                "to": far if np.isfinite(far) else None,
                "floor_lost": 1.0 - after / before if before else None,
                "false_positives": share(heavy.truth == Truth.SMOKE, in_heavy),
            }
        )
    place = np.arange(len(rows))
    for shift, key, colour, text in (
        (-0.2, "floor_lost", "floor", "floor points lost"),
        (0.2, "false_positives", "smoke", "returns that are smoke"),
    ):
        heights = [row[key] or 0.0 for row in rows]
        axes.bar(place + shift, heights, 0.38, color=drawing.CLASS_COLOURS[colour], label=text)
    axes.set_xticks(place)
    axes.set_xticklabels([_range_name(row) for row in rows])
    axes.set_xlabel("range [m]")
    axes.set_ylim(0, 1)
    axes.set_title("(d) What heavy smoke takes and adds", fontsize=10)
    axes.legend(fontsize=8)
    return rows


def _range_name(row):
    return f"{row['from']:g}-{row['to']:g}" if row["to"] else f"> {row['from']:g}"


def figure_2_3(request):
    """Intensity threshold against AGDOR in heavy smoke."""
    return _compare_denoisers(
        request, [("(a) Intensity threshold", "intensity_threshold"), ("(b) AGDOR", "agdor")]
    )


def _compare_denoisers(request, panels):
    scan = request.scan(BASIC, centre_pose(), "heavy")
    figure, axes = drawing.new_figure(len(panels))
    numbers = {}
    for panel, (title, name) in zip(axes[0], panels):
        output = method(name).run(scan)
        numbers[name] = score_output(output, scan, {})["denoising"]
        shown = output.kept & (scan.truth != Truth.CEILING)
        _draw_by_class(panel, scan, shown, f"{title}: what is kept, ceiling left out")
    drawing.finish(figure, drawing.CLASS_COLOURS, ("floor", "wall", "furniture", "smoke"))
    return figure, numbers


def _draw_by_class(axes, scan, shown, title):
    xyz, truth = scan.to_level(scan.xyz[shown]), scan.truth[shown]
    colours = np.full((len(xyz), 4), (0.7, 0.7, 0.7, 1.0))
    for name, colour in drawing.CLASS_COLOURS.items():
        colours[truth == Truth[name.upper()]] = to_rgba(colour)
    drawing.draw_cloud(axes, xyz, colours, title)


def figure_3_2(request):
    """Before and after AGDOR in heavy smoke, by intensity."""
    scan = request.scan(BASIC, centre_pose(), "heavy")
    output = method("agdor").run(scan)
    figure, axes = drawing.new_figure(2)
    _draw_by_intensity(axes[0, 0], scan, "(a) Before AGDOR")
    _draw_by_intensity(axes[0, 1], scan, "(b) After AGDOR", output.kept)
    for panel in axes[0]:
        drawing.intensity_bar(figure, panel)
    drawing.finish(figure)
    return figure, score_output(output, scan, {})["denoising"]


def figure_2_5(request):
    """Patchwork++, where it is installed, against the channel-based method without smoke."""
    first = "(a) Patchwork++", "patchworkpp"
    try:
        method(first[1]).require()
    except BaselineUnavailableError:
        first = "(a) RANSAC plane (Patchwork++ not installed)", "ransac_plane_low"
    return _compare_ground(request, "clear", [first, ("(b) Channel-based", "channel_original")])


def figure_2_6(request):
    """The channel-based method without and with the 30 mm feature in heavy smoke."""
    panels = [("(a) Original", "channel_original"), ("(b) With the 30 mm feature", "channel")]
    return _compare_ground(request, "heavy", panels)


def _compare_ground(request, level, panels):
    scan = request.scan(BASIC, centre_pose(), level)
    figure, axes = drawing.new_figure(len(panels))
    numbers = {}
    for panel, (title, name) in zip(axes[0], panels):
        chosen = method(name)
        chosen.require()
        output = chosen.run(scan)
        score = score_output(output, scan, {})["ground"]
        numbers[name] = score
        title = f"{title}: precision {score['precision']:.2f}, recall {score['recall']:.2f}"
        _draw_ground(panel, scan, output, title)
    names = ("true positive", "false positive", "false negative")
    drawing.finish(figure, drawing.OUTCOME_COLOURS, names)
    return figure, numbers


def _draw_ground(axes, scan, output, title):
    """Kept points by what the segmentation made of them; neither ground nor called so: grey."""
    shown = output.kept & (scan.truth != Truth.CEILING)
    xyz = scan.to_level(scan.xyz[shown])
    called, true = output.labels[shown] == Label.GROUND, scan.truth[shown] == Truth.FLOOR
    colours = np.full((len(xyz), 4), (0.85, 0.85, 0.85, 0.6))
    for mask, name in (
        (called & true, "true positive"),
        (called & ~true, "false positive"),
        (~called & true, "false negative"),
    ):
        colours[mask] = to_rgba(drawing.OUTCOME_COLOURS[name])
    drawing.draw_cloud(axes, xyz, colours, title)


def figure_5_1(request):
    """Basic room, clear: plan, floor merged from four positions, output from the third."""
    positions = corner_poses()
    scan = request.scan(BASIC, positions[2], "clear")
    figure, axes = drawing.new_figure(3)
    _draw_plan(axes[0, 0], request, BASIC, positions[2])
    merged = thesis_table.merge_floor_points(
        [floor_and_pose(request.scan(BASIC, pose, "clear")) for pose in positions],
        scan.T_world_sensor,
    )
    drawing.draw_cloud(
        axes[0, 1], merged, drawing.CLASS_COLOURS["floor"], "(b) Floor merged from positions 1-4"
    )
    numbers = _draw_output(axes[0, 2], request, BASIC, scan, positions[2], "clear", "(c)")
    drawing.finish(figure, _SURFACE_COLOURS)
    return figure, numbers


def figure_5_2(request):
    """Basic room in heavy smoke, from the centre."""
    return _scenario(request, BASIC, centre_pose(), "heavy")


def figure_5_3(request):
    """Complex room without smoke."""
    return _scenario(request, COMPLEX, world.poses(COMPLEX)[0], "clear")


def figure_5_4(request):
    """Complex room in heavy smoke."""
    return _scenario(request, COMPLEX, world.poses(COMPLEX)[0], "heavy")


def _scenario(request, scene, pose, level):
    scan = request.scan(scene, pose, level)
    figure, axes = drawing.new_figure(3)
    _draw_plan(axes[0, 0], request, scene, pose)
    _draw_by_intensity(axes[0, 1], scan, "(b) Raw cloud by intensity")
    numbers = _draw_output(axes[0, 2], request, scene, scan, pose, level, "(c)")
    drawing.finish(figure, _SURFACE_COLOURS)
    return figure, numbers


_SURFACE_COLOURS = {"measured": "#1d7874", "reconstructed": "#7fb7e6", "wall points": "#264653"}


def _draw_output(axes, request, scene, scan, pose, level, letter):
    """The surface by provenance with the segmented wall points, and its score as numbers."""
    output = method(request.method).run(scan)
    surface = scan.to_level(output.surface)
    reconstructed = np.zeros(len(surface), dtype=bool)
    if output.provenance is not None:
        reconstructed = output.provenance == 1
    walls = np.zeros((0, 3))
    if output.labels is not None:
        walls = scan.to_level(scan.xyz[output.labels == Label.WALL])
    rgba = to_rgba
    colours = np.vstack(
        [
            np.where(
                reconstructed[:, None],
                rgba(_SURFACE_COLOURS["reconstructed"]),
                rgba(_SURFACE_COLOURS["measured"]),
            ),
            np.tile(rgba(_SURFACE_COLOURS["wall points"], 0.25), (len(walls), 1)),
        ]
    )
    score = score_output(
        output, scan, {CELL: world.truth(scene, request.sensor, pose, CELL, level, request.seed)}
    )
    floor = score["floor"][f"{CELL:g}"]
    title = f"{letter} {request.method}: IoU {floor['iou']:.2f}, precision {floor['precision']:.2f}"
    drawing.draw_cloud(axes, np.vstack([surface, walls]), colours, title)
    return floor


_PLAN_COLOURS = {"floor in sight": "#2a9d8f", "floor out of sight": "#bfe3dd", "drop": "#d62828"}


def _draw_plan(axes, request, scene, pose):
    truth = world.truth(scene, request.sensor, pose, 0.05, "clear")
    image = np.full(truth.visible_floor.shape, np.nan)
    for value, cells in enumerate((truth.visible_floor, truth.out_of_sight, truth.hole)):
        image[cells & np.isnan(image)] = value
    cmap = ListedColormap(list(_PLAN_COLOURS.values()))
    title = f"(a) Plan of {scene}: true floor\nsensor at '{pose}'"
    drawing.draw_cells(axes, CellGrid.of(truth), image, title, cmap=cmap, vmin=-0.5, vmax=2.5)


def figure_5_5(request):
    """Four binary occupancy grids: ideal, clear cloud, cloud in smoke, reconstructed."""
    truth, outputs = thesis_outputs(request)
    grid = CellGrid.of(truth)
    figure, axes = drawing.new_figure(2, 2)
    panels = [("(a) Ideal, from positions 1-4", truth.visible_floor)]
    for letter, name in zip("bcd", (CLEAR_CLOUD, SMOKE_CLOUD, RECONSTRUCTED)):
        level_xyz, height = outputs[name]
        filled = thesis_table.fill_disc(level_xyz, truth, -height)
        panels.append((f"({letter}) {name}", occupancy(grid, filled).cells))
    for panel, (title, cells) in zip(axes.ravel(), panels):
        drawing.draw_cells(panel, grid, cells, title, cmap="Greys", vmin=0, vmax=1)
    drawing.finish(figure)
    return figure, {title: int(np.count_nonzero(cells)) for title, cells in panels}


def figure_5_6(request):
    """Classification grids of the clear cloud, the cloud in smoke and the reconstruction."""
    scores = thesis_scores(request)
    figure, axes = drawing.new_figure(3, height=5.0)
    for panel, letter, name in zip(axes[0], "abc", (CLEAR_CLOUD, SMOKE_CLOUD, RECONSTRUCTED)):
        score = scores[name]
        title = f"({letter}) {name}\nIoU {score.counts.iou:.2f}"
        drawing.draw_classification(panel, score.grid, score.classification, title)
    drawing.finish(figure, drawing.OUTCOME_COLOURS)
    return figure, {name: score.counts.to_dict() for name, score in scores.items()}


def figure_5_7(request):
    """Height differences of the reconstruction: box plot and heat map."""
    score = thesis_scores(request)[RECONSTRUCTED]
    figure, axes = drawing.new_figure(2)
    millimetres = 1e3 * score.heights.cells
    axes[0, 0].boxplot(millimetres[np.isfinite(millimetres)], showmeans=True, widths=0.4)
    axes[0, 0].axhline(0, color="grey", lw=0.8)
    axes[0, 0].set_xticks([])
    axes[0, 0].set_ylabel("claimed minus true height [mm]")
    axes[0, 0].set_title("(a) All true-positive cells (triangle: mean)", fontsize=10)
    limit = max(float(np.nanmax(np.abs(millimetres))), 1.0) if score.heights.values.size else 1.0
    shown = drawing.draw_cells(
        axes[0, 1],
        score.grid,
        millimetres,
        "(b) By cell; white: not a true positive",
        cmap="RdBu_r",
        vmin=-limit,
        vmax=limit,
    )
    figure.colorbar(shown, ax=axes[0, 1], label="[mm]", shrink=0.8)
    drawing.finish(figure)
    return figure, score.heights.to_dict()


CLEAR_CLOUD = "Point cloud without smoke"
SMOKE_CLOUD = "Point cloud in smoke"
TRUE_FLOOR = ", true floor points"
RECONSTRUCTED = "Reconstructed ground surface in smoke"


def thesis_outputs(request):
    """The truth and the three outputs of the thesis's Table 5.1.

    Returns:
        MergedTruth, and by row name the output's points in the level frame of the centre position
        with the sensor's height. The raw clouds come twice: cut by height as the thesis did it,
        and, with TRUE_FLOOR after the row's name, the points whose truth is floor.
    """
    clear = request.scan(BASIC, centre_pose(), "clear")
    heavy = request.scan(BASIC, centre_pose(), "heavy")
    merged = thesis_table.merge_floor_points(
        [floor_and_pose(request.scan(BASIC, pose, "clear")) for pose in corner_poses()],
        clear.T_world_sensor,
    )
    scene = world.truth(BASIC, request.sensor, centre_pose(), CELL, "clear")
    merged = thesis_table.without_outliers(merged, scene)
    truth = thesis_table.merged_truth(merged, CELL, blind_radius(clear) + CELL)
    sources = [
        (CLEAR_CLOUD, "raw_cloud_band", clear),
        (CLEAR_CLOUD + TRUE_FLOOR, "raw_cloud", clear),
        (SMOKE_CLOUD, "raw_cloud_band", heavy),
        (SMOKE_CLOUD + TRUE_FLOOR, "raw_cloud", heavy),
        (RECONSTRUCTED, request.method, heavy),
    ]
    outputs = {
        row: (scan.to_level(method(name).run(scan).surface), scan.sensor_height)
        for row, name, scan in sources
    }
    return truth, outputs


def thesis_scores(request):
    """FloorScore by row of thesis_outputs, made as the thesis made its Table 5.1."""
    truth, outputs = thesis_outputs(request)
    return {
        row: thesis_table.score_as_thesis(xyz, truth, height)
        for row, (xyz, height) in outputs.items()
    }


def blind_radius(scan):
    """Radius of the disc under a level sensor that its lowest beam does not reach [m]."""
    return scan.sensor_height / np.tan(np.deg2rad(-min(scan.elevation_deg)))


def floor_and_pose(scan):
    """Floor points of a scan (truth) in the sensor frame, and its T_world_sensor."""
    return scan.xyz[scan.truth == Truth.FLOOR].astype(np.float64), scan.T_world_sensor


def corner_poses():
    """The basic room's positions 1 to 4."""
    return world.poses(BASIC)[:4]


def centre_pose():
    """The basic room's position 5, near the centre."""
    return world.poses(BASIC)[4]


def figure_agdor(request):
    """Smoke removed against floor kept, AGDOR over its parameters beside every baseline."""
    scan = request.scan(BASIC, centre_pose(), "heavy")
    agdor = denoising_curves.agdor_curves(scan)
    baselines = denoising_curves.baseline_curves(scan)
    figure = denoising_curves.draw_curves(agdor, baselines, "basic room, heavy smoke")
    return figure, {"agdor": agdor, "baselines": baselines}


FIGURES = {
    "2.1": figure_2_1,
    "2.3": figure_2_3,
    "2.5": figure_2_5,
    "2.6": figure_2_6,
    "3.2": figure_3_2,
    "5.1": figure_5_1,
    "5.2": figure_5_2,
    "5.3": figure_5_3,
    "5.4": figure_5_4,
    "5.5": figure_5_5,
    "5.6": figure_5_6,
    "5.7": figure_5_7,
    "agdor": figure_agdor,
    "calibration": certainty.figure_calibration,
    "visibility": certainty.figure_visibility,
}
