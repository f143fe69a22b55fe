"""Run methods on recorded rooms under smoke, and tell of it: a table, numbers, and pictures."""

import numpy as np
from matplotlib.colors import ListedColormap

from smoke_ground_reconstruction.evaluation import drawing, report
from smoke_ground_reconstruction.evaluation.grids import CellGrid
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.overlay import (
    BEYOND,
    MAX_HEIGHT_ERROR,
    MAX_TILT_ERROR_DEG,
    MIN_RETURNS,
    MIN_SPAN,
    cells_of,
    hard_returns_of,
    score,
    survivors_of,
)
from smoke_ground_reconstruction.evaluation.summary import grouped
from smoke_ground_reconstruction.evaluation.tables import NOTHING, Table, number

COLOURS = {
    "recovered": "#2a9d8f",
    "missed": "#f4a261",
    "claimed beside the clear scan's floor": "#a8dadc",
    "claimed in a shadow": "#f9c74f",
    "claimed beyond its reach": "#d62828",
}


def records_of(recordings, methods, levels, seeds):
    """Yields a record for each recording, level, seed and method, with the scores or the error."""
    for recording in recordings:
        for level in levels:
            for seed in range(seeds):
                scan, extinction = recording.in_smoke(level, seed)
                for name in methods:
                    record = {"scan": recording.name, "level": level, "seed": seed, "method": name}
                    yield dict(record, extinction=extinction, **_scores(recording, scan, name))


def _scores(recording, scan, name):
    try:
        output = method(name).run(scan)
    except ValueError as error:
        return {"error": str(error)}
    return {"scores": score(recording.room, survivors_of(scan), hard_returns_of(scan), output)}


def table(records):
    """One row a recording, level and method: mean, and the worst seed where that says more."""
    rows = [
        [name, scan, level, str(len(group)), *_figures([r["scores"] for r in group])]
        for (name, scan, level), group in grouped(
            [r for r in records if "scores" in r], "method", "scan", "level"
        ).items()
    ]
    columns = ["method", "recording", "smoke", "scans", "floor returns", "survivors 0.2 m"]
    columns += ["recovered 0.2 m", "of the knowable", "knowable", "recovered 0.1 m"]
    columns += ["beyond (in shadow)", "farthest [m]"]
    columns += ["plane height [mm]", "tilt [deg]", "as asked", "within 2 sigma"]
    note = (
        "Shares of the clear scan's floor cells, mean / worst scan; knowable: cells of 0.2 m in the"
        " columns of which something as far away is still seen; cells of 0.1 m claimed more"
        f" than {BEYOND} m beyond the clear scan's reach (in the shadow of something near: between"
        " what is seen to either side of it), worst scan; plane against the clear scan's, worst"
        f" scan; as asked: scans within {1e3 * MAX_HEIGHT_ERROR:.0f} mm and"
        f" {MAX_TILT_ERROR_DEG} deg of those that keep {MIN_RETURNS} floor returns over"
        f" {MIN_SPAN:g} m; within 2 sigma: cells of 0.1 m."
    )
    return Table("Recorded rooms under smoke", columns, rows, note)


def _figures(scores):
    def values(name):
        return [score[name] for score in scores if score[name] is not None]

    def both(name):
        if not values(name):
            return NOTHING
        return f"{np.mean(values(name)):.2f} / {min(values(name)):.2f}"

    height, tilt = values("plane_height"), values("plane_tilt_deg")
    asked = [score for score in scores if score["plane_asked"]]
    return [
        f"{np.mean(values('floor_returns')):.0f}",
        *map(both, ("raw@0.2", "recovered@0.2", "recovered_knowable@0.2", "knowable@0.2")),
        both("recovered@0.1"),
        f"{max(values('beyond_cells'))} ({max(values('shadow_cells'))})",
        number(max(values("beyond_max"))),
        f"{1e3 * max(height, key=abs):+.1f}" if height else NOTHING,
        number(max(tilt, default=None)),
        f"{sum(map(is_near, asked))} of {len(asked)}" if height else NOTHING,
        number(min(values("within_2_sigma"), default=None)),
    ]


def is_near(score):
    """Is the plane as near the clear scan's as is asked?"""
    height, tilt = score["plane_height"], score["plane_tilt_deg"]
    return abs(height) <= MAX_HEIGHT_ERROR and tilt <= MAX_TILT_ERROR_DEG


def picture(recording, level, name, seed=0):
    """Both scans from above, and what a method makes of the one in smoke: a matplotlib figure."""
    scan, _ = recording.in_smoke(level, seed)
    recorded, room = recording.recorded, recording.room
    output = method(name).run(scan)
    figure, axes = drawing.new_figure(3, width=6.0, height=6.2)
    whole = recorded.directions * recorded.ranges[:, None]
    _draw_scan(axes[0, 0], whole, recorded.is_floor, "recorded, clear air")
    _draw_scan(axes[0, 1], scan.xyz, scan.truth == 1, f"under {level.replace('_', ' ')} smoke")
    _draw_cells(axes[0, 2], room, output.surface, f"{name}, cells of 0.1 m")
    shown = np.vstack([whole[recorded.is_floor], output.surface])[:, :2]
    low, high = np.percentile(shown, [1, 99], axis=0) + [[-0.5], [0.5]]
    for panel in axes[0]:
        _draw_reach(panel, room)
        panel.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    figure.suptitle(f"{recording.name}, from above [m]; line: how far the clear scan saw")
    drawing.finish(figure, COLOURS)
    return figure


def _draw_scan(axes, xyz, is_floor, title):
    axes.plot(*xyz[~is_floor, :2].T, ",", color="#8d99ae")
    axes.plot(*xyz[is_floor, :2].T, ",", color="#2a9d8f")
    axes.set_title(f"{title}: {np.count_nonzero(is_floor)} floor returns", fontsize=10)


def _draw_reach(axes, room):
    azimuth = np.radians(np.arange(len(room.reach)) + 0.5)
    axes.plot(room.reach * np.cos(azimuth), room.reach * np.sin(azimuth), "k-", lw=0.6)
    axes.plot(0, 0, "k+", markersize=9)


def _draw_cells(axes, room, surface, title):
    wanted, claimed = _places(room.cells[0.1]), _places(cells_of(surface, 0.1))
    outside = _places(cells_of(surface[room.beyond(surface) > BEYOND], 0.1))
    beyond = _places(cells_of(surface[room.beyond(surface, filled=True) > BEYOND], 0.1))
    shadow = outside - beyond
    groups = (wanted & claimed, wanted - claimed, claimed - wanted - outside, shadow, beyond)
    at = np.array(sorted(wanted | claimed))
    low, shape = at.min(axis=0), np.ptp(at, axis=0)[::-1] + 1
    image = np.full(shape, np.nan)
    for value, group in enumerate(groups):
        columns, rows = (np.array(sorted(group)).reshape(-1, 2) - low).T.astype(int)
        image[rows, columns] = value
    colours = ListedColormap(list(COLOURS.values()))
    grid = CellGrid(tuple(0.1 * low), 0.1, tuple(shape))
    drawing.draw_cells(axes, grid, image, title, cmap=colours, vmin=-0.5, vmax=4.5)


def _places(cells):
    return {tuple(at) for at in cells}


def page(shown, pictures):
    """One self-contained HTML page of a table and pairs of caption and figure."""
    sections = [("Recorded rooms", report.table_html(shown))]
    sections += [(caption, report.figure_html(figure, caption)) for caption, figure in pictures]
    return report.page("Evaluation on recorded rooms under simulated smoke", sections)
