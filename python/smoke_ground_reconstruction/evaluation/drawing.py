"""How the figures look: colours, cloud views and cell maps, the same in every picture."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

INTENSITY_LIMIT = 100.0
"""Intensity at the upper end of the colour scale: smoke and floor lie far below."""

CLASS_COLOURS = {
    "floor": "#2a9d8f",
    "wall": "#264653",
    "ceiling": "#adb5bd",
    "furniture": "#8d6e63",
    "person": "#6a4c93",
    "smoke": "#f4a261",
}

OUTCOME_COLOURS = {
    "true positive": "#2a9d8f",
    "false positive": "#d62828",
    "false negative": "#f4a261",
    "true negative": "#ffffff",
    "ignored": "#d0d0d0",
}

VIEW_AZIMUTH_DEG = -60.0
VIEW_ELEVATION_DEG = 38.0


def new_figure(columns, rows=1, width=5.0, height=4.4):
    """A figure and its axes, (rows, columns) as a 2-D array."""
    figure = Figure(figsize=(columns * width, rows * height), dpi=130)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def finish(figure, colours=None, names=None, handles=(), columns=5):
    """Fit the panels, above a legend if there is one.

    Args:
        figure: matplotlib figure.
        colours: colour by name, for a legend of patches.
        names: those of the legend; all by default.
        handles: labelled artists, for a legend of them instead.
        columns: entries of the legend side by side.
    """
    if colours:
        handles = [
            Patch(facecolor=colours[name], edgecolor="grey", label=name)
            for name in (names or colours)
        ]
    rows = -(-len(handles) // columns)
    if handles:
        labels = [handle.get_label() for handle in handles]
        figure.legend(
            handles,
            labels,
            loc="lower center",
            ncol=min(columns, len(handles)),
            fontsize=9,
            frameon=False,
        )
    figure.tight_layout(rect=(0, (0.1 + 0.22 * rows) / figure.get_figheight(), 1, 0.97))


def oblique(xyz):
    """Points as seen from above at an angle: right, up and depth [m], each (N,)."""
    azimuth, elevation = np.deg2rad([VIEW_AZIMUTH_DEG, VIEW_ELEVATION_DEG])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    towards = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    up = np.cross(towards, right)
    xyz = np.asarray(xyz, dtype=np.float64)
    return xyz @ right, xyz @ up, xyz @ towards


def draw_cloud(axes, xyz, colours, title, size=0.35):
    """Draw points obliquely from above, the near ones last.

    Args:
        axes: matplotlib axes.
        xyz: (N, 3) [m].
        colours: (N, 3 or 4) RGB(A), or one colour.
        title: of the panel.
        size: of a point.
    """
    right, up, depth = oblique(xyz)
    order = np.argsort(depth, kind="stable")
    if not isinstance(colours, str):
        colours = np.asarray(colours)[order]
    axes.scatter(right[order], up[order], s=size, c=colours, linewidths=0, rasterized=True)
    _plain(axes, title)
    _scale_bar(axes)


def _plain(axes, title):
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=10)


def _scale_bar(axes, length=2.0):
    axes.plot([0.04, 0.04], [0, 0], alpha=0)  # keeps autoscale from collapsing on one point
    left, _ = axes.get_xlim()
    bottom, _ = axes.get_ylim()
    axes.plot([left, left + length], [bottom, bottom], color="black", lw=2, clip_on=False)
    axes.text(left + length / 2, bottom, f"{length:g} m", ha="center", va="bottom", fontsize=8)


def intensity_colours(intensity):
    """(N, 4) RGBA of intensities, from dark (none) to yellow (INTENSITY_LIMIT and more)."""
    return _intensity_scale().to_rgba(intensity)


def _intensity_scale():
    return ScalarMappable(Normalize(0, INTENSITY_LIMIT, clip=True), "viridis")


def intensity_bar(figure, axes):
    """A colour bar for intensity_colours."""
    scale = _intensity_scale()
    scale.set_array([])
    figure.colorbar(scale, ax=axes, label="intensity", shrink=0.7)


def draw_classification(axes, grid, classification, title):
    """Draw the outcome of each cell (thesis Figure 5.6), with the sensor as a cross."""
    image = np.full(grid.shape, 3)
    for value, name in enumerate(("true_positive", "false_positive", "false_negative")):
        image[getattr(classification, name)] = value
    image[classification.ignored] = 4
    colours = ListedColormap(list(OUTCOME_COLOURS.values()))
    draw_cells(axes, grid, image, title, cmap=colours, vmin=-0.5, vmax=4.5)


def draw_cells(axes, grid, image, title, **options):
    """Draw one value a cell from above, x to the right [m], the sensor as a cross."""
    shown = axes.imshow(
        image, origin="lower", extent=grid.extent, interpolation="nearest", **options
    )
    axes.plot(0, 0, "k+", markersize=9)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("x [m]", fontsize=8)
    axes.set_ylabel("y [m]", fontsize=8)
    axes.tick_params(labelsize=8)
    return shown
