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
    methods = list(dict.fromkeys(method for method, _ in lines))
    for panel, cell in zip(axes[0], cells):
        for (method, scene), by_level in lines.items():
            style = "--" if scene == "all scenes" else "-"
            colour = f"C{methods.index(method) % 10}"
            _line(panel, colour, style, f"{method}, {scene}", by_level, f"iou@{cell}")
        panel.set_ylim(0, 1.02)
        panel.set_ylabel("IoU of the floor")
        panel.set_title(f"{cell} m cells", fontsize=10)
        panel.grid(alpha=0.3)
    drawing.finish(figure, handles=axes[0, 0].get_legend_handles_labels()[0], columns=3)
    return figure


def _line(axes, colour, style, label, by_level, name):
    levels = [level for level in world.LEVELS if name in by_level.get(level, {})]
    if levels:
        means = [by_level[level][name]["mean"] for level in levels]
        worst = [by_level[level][name]["worst"] for level in levels]
        axes.plot(levels, means, style, color=colour, label=label)
        axes.plot(levels, worst, "o", color=colour, markersize=4)
