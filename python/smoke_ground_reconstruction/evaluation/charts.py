"""Charts of an evaluation's summary."""

from smoke_ground_reconstruction.evaluation import drawing, world


def iou_by_level(rows, cells):
    """IoU against smoke level, one panel a cell size, one line a method and group of scenes.

    Args:
        rows: of summary.summarise.
        cells: edges of the cells as text.

    Returns:
        A matplotlib figure: the mean as a line, the worst scan as dots.
    """
    figure, axes = drawing.new_figure(len(cells), width=5.6)
    lines = {}
    for row in rows:
        lines.setdefault((row["method"], row["scene"]), {})[row["level"]] = row
    for panel, cell in zip(axes[0], cells):
        for index, ((method, scene), by_level) in enumerate(lines.items()):
            _line(panel, f"C{index % 10}", f"{method}, {scene}", by_level, f"iou@{cell}")
        panel.set_ylim(0, 1.02)
        panel.set_ylabel("IoU of the floor")
        panel.set_title(f"{cell} m cells", fontsize=10)
        panel.grid(alpha=0.3)
    axes[0, 0].legend(fontsize=8)
    drawing.finish(figure)
    return figure


def _line(axes, colour, label, by_level, name):
    levels = [level for level in world.LEVELS if name in by_level.get(level, {})]
    if levels:
        means = [by_level[level][name]["mean"] for level in levels]
        worst = [by_level[level][name]["worst"] for level in levels]
        axes.plot(levels, means, color=colour, label=label)
        axes.plot(levels, worst, "o", color=colour, markersize=4)
