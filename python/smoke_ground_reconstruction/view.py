"""Pictures of a floor from above, made so that an operator cannot take one thing for another.

Forward (+x) is up and left (+y) is left, as the operator looks along the robot. What is not claimed
as floor is unknown and stays grey; nothing is smoothed or filled in.
"""

from typing import List, Tuple

import numpy as np

from smoke_ground_reconstruction.io.clouds import Floor, LidarScan

CELL = 0.1  # edge of a drawn cell [m]
MARGIN = 0.5  # unknown shown around what is known [m]
MAX_REACH = 30.0  # nothing farther from the sensor is drawn [m]
DPI = 150  # of the picture
SCREEN_DPI = 90  # of the window, which must fit a small screen

UNKNOWN, RECONSTRUCTED, MEASURED_BEFORE, MEASURED, WALL = range(5)
# Told apart by lightness alone, too.
COLORS = {
    UNKNOWN: "#9a9a9a",
    RECONSTRUCTED: "#f6cf71",
    MEASURED_BEFORE: "#8fd0c0",
    MEASURED: "#1c8a5a",
    WALL: "#1a1a1a",
}
NAMES = {
    MEASURED: "floor, measured",
    MEASURED_BEFORE: "floor, measured before",
    RECONSTRUCTED: "floor, reconstructed (not seen)",
    WALL: "wall, measured",
    UNKNOWN: "unknown: may be anything",
}
OUTLINES = (
    (0, "#1a1a1a", "-", "edge: wall seen"),
    (1, "#1a1a1a", ":", "edge: wall inferred"),
    (2, "#d7191c", "--", "edge: limit of knowledge, no wall seen"),
)


def draw_floor(floor: Floor, title: str):
    """Draws a floor from above.

    Parameters
    ----------
    floor : the floor
    title : first line over the picture

    Returns
    -------
    matplotlib.figure.Figure, not shown anywhere yet.
    """
    corner, cells = floor_cells(floor)
    figure, axes = _new_axes()
    _draw_cells(axes, corner, cells)
    kinds = _draw_outline(axes, floor)
    _draw_sensor(axes)
    _finish(axes, f"{title}\n{_summary(floor, cells)}", _legend(cells, kinds))
    return figure


def draw_scan(scan: LidarScan, title: str):
    """Draws the returns of a scan from above, dark below the sensor and light above it.

    Returns
    -------
    matplotlib.figure.Figure, not shown anywhere yet.
    """
    figure, axes = _new_axes()
    xyz = _in_reach(scan.xyz[np.isfinite(scan.xyz).all(axis=1) & (scan.xyz != 0).any(axis=1)])
    xyz = xyz[np.argsort(-xyz[:, 2])]  # the floor on top, not the ceiling
    dots = axes.scatter(-xyz[:, 1], xyz[:, 0], c=xyz[:, 2], s=0.3, cmap="viridis", vmin=-1, vmax=2)
    figure.colorbar(dots, ax=axes, shrink=0.6, label="height above the sensor [m]")
    _draw_sensor(axes)
    title = f"{title}\n{len(xyz)} returns as recorded, no floor reconstructed"
    _finish(axes, title, axes.get_legend_handles_labels()[0])
    return figure


def floor_cells(floor: Floor) -> Tuple[np.ndarray, np.ndarray]:
    """The picture's content: what each cell of CELL x CELL holds.

    A cell with a wall point is wall; else measured if any point in it was, then measured before,
    then reconstructed; without a point it is unknown.

    Returns
    -------
    corner : (2,) int, cell numbers of cells[0, 0] along x and y; cell (i, j) begins at
        (corner + (i, j)) * CELL [m]
    cells : (nx, ny) uint8, UNKNOWN to WALL
    """
    walls = np.zeros((0, 3)) if floor.walls is None else _in_reach(floor.walls)
    near = _is_in_reach(floor.xyz)
    points, provenance = floor.xyz[near], floor.provenance[near]
    known = np.vstack([points[:, :2], walls[:, :2], _in_reach(floor.boundary)[:, :2], [[0, 0]]])
    corner = np.floor((known.min(axis=0) - MARGIN) / CELL).astype(int)
    shape = np.floor((known.max(axis=0) + MARGIN) / CELL).astype(int) - corner + 1
    cells = np.zeros(shape, np.uint8)
    kind_of_provenance = np.array([MEASURED, RECONSTRUCTED, MEASURED_BEFORE], np.uint8)
    kind = kind_of_provenance[np.minimum(provenance, 2)]
    np.maximum.at(cells, _index(points, corner), kind)
    np.maximum.at(cells, _index(walls, corner), np.uint8(WALL))
    return corner, cells


def _index(points: np.ndarray, corner: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    column = np.floor(points[:, :2].astype(np.float64) / CELL).astype(int) - corner
    return column[:, 0], column[:, 1]


def _is_in_reach(xyz: np.ndarray) -> np.ndarray:
    return (np.abs(xyz[:, :2]) <= MAX_REACH).all(axis=1)


def _in_reach(xyz: np.ndarray) -> np.ndarray:
    return xyz[_is_in_reach(xyz)]


def _new_axes():
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 7.5), dpi=DPI, constrained_layout=True)
    return figure, figure.add_subplot()


def _draw_cells(axes, corner: np.ndarray, cells: np.ndarray) -> None:
    from matplotlib.colors import ListedColormap

    low, high = corner * CELL, (corner + cells.shape) * CELL
    axes.imshow(
        cells[:, ::-1],  # +y to the left
        origin="lower",
        extent=(-high[1], -low[1], low[0], high[0]),
        cmap=ListedColormap([COLORS[kind] for kind in sorted(COLORS)]),
        vmin=UNKNOWN,
        vmax=WALL,
        interpolation="nearest",
    )


def edge_kinds(boundary_kind: np.ndarray) -> np.ndarray:
    """What ends the floor along each edge, from vertex i to vertex i + 1, (M,) uint8.

    The less certain of its ends speaks for an edge.
    """
    return np.maximum(boundary_kind, np.roll(boundary_kind, -1))


def _draw_outline(axes, floor: Floor) -> List[int]:
    """Draws the outline by kind; returns the kinds that occur."""
    from matplotlib.collections import LineCollection

    ends = np.roll(floor.boundary, -1, axis=0)
    edges = np.stack([floor.boundary[:, :2], ends[:, :2]], axis=1)
    edges = np.stack([-edges[:, :, 1], edges[:, :, 0]], axis=2)
    kinds = edge_kinds(floor.boundary_kind)
    for kind, color, style, _ in OUTLINES:
        lines = edges[kinds == kind]
        axes.add_collection(LineCollection(lines, colors=color, linestyles=style, linewidths=1.8))
    return [kind for kind, *_ in OUTLINES if (kinds == kind).any()]


def _draw_sensor(axes) -> None:
    axes.plot(0, 0, "o", color="white", markeredgecolor="#2b4fd8", markeredgewidth=2, markersize=9)
    axes.annotate(
        "",
        xy=(0, 0.6),
        xytext=(0, 0),
        arrowprops={"arrowstyle": "-|>", "color": "#2b4fd8", "linewidth": 2},
    )


def _summary(floor: Floor, cells: np.ndarray) -> str:
    area = CELL**2
    counts = np.bincount(cells.ravel(), minlength=WALL + 1) * area
    if len(floor.xyz) == 0:
        return "NO FLOOR FOUND: nothing is known about this room's floor"
    before = f" + {counts[MEASURED_BEFORE]:.1f} before" if counts[MEASURED_BEFORE] else ""
    return (
        f"floor measured {counts[MEASURED]:.1f} m²{before}, "
        f"reconstructed {counts[RECONSTRUCTED]:.1f} m²"
    )


def _legend(cells: np.ndarray, outline_kinds: List[int]) -> List:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown = set(np.unique(cells)) | {MEASURED, RECONSTRUCTED, UNKNOWN}
    handles: List = [
        Patch(facecolor=COLORS[kind], edgecolor="#555555", label=NAMES[kind])
        for kind in NAMES
        if kind in shown
    ]
    for kind, color, style, name in OUTLINES:
        if kind in outline_kinds:
            handles.append(Line2D([], [], color=color, linestyle=style, linewidth=1.8, label=name))
    return handles


def _finish(axes, title: str, handles: List) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    sensor = Line2D([], [], marker="o", linestyle="", markersize=9, markerfacecolor="white")
    sensor.set(markeredgecolor="#2b4fd8", markeredgewidth=2, label="sensor, arrow: forward (+x)")
    axes.set_title(title, fontsize=11)
    axes.set_aspect("equal")
    axes.set_xlabel("left (+y)   [m]   right")
    axes.set_ylabel("[m]   forward (+x)")
    span = max(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(1.0 if span <= 20 else 5.0))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{abs(value):g}"))
    axes.grid(color="black", alpha=0.15, linewidth=0.5)
    axes.legend(
        handles=[*handles, sensor], loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9
    )


def save(figure, path: str) -> None:
    """Writes a drawn figure as a PNG."""
    from smoke_ground_reconstruction.io import replacing

    with replacing(path) as part:
        figure.savefig(part, format="png", bbox_inches="tight")


def show(figure, title: str) -> None:
    """Shows a drawn figure in a window until that is closed."""
    import tkinter

    from matplotlib.backends.backend_tkagg import FigureCanvasTkAgg, NavigationToolbar2Tk

    window = tkinter.Tk()
    window.title(title)
    figure.set_dpi(SCREEN_DPI)
    canvas = FigureCanvasTkAgg(figure, master=window)
    NavigationToolbar2Tk(canvas, window)
    canvas.get_tk_widget().pack(fill="both", expand=True)
    window.protocol("WM_DELETE_WINDOW", window.quit)
    window.mainloop()
