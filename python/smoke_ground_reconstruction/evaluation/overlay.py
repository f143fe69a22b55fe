"""Real rooms: a recorded clear scan, smoke laid over it, and what a method makes of the rest.

A recording carries no labels. The truth is what its clear scan shows by plain means that no method
shares: the cells in which it has floor returns, the plane through them, and how far it saw.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Dict

import numpy as np

from smoke_ground_reconstruction.evaluation.grids import finite_points
from smoke_ground_reconstruction.evaluation.scan_input import ScanInput
from smoke_ground_reconstruction.evaluation.yardstick import CELL_SIZES
from smoke_ground_reconstruction.simulation.levels import LEVELS
from smoke_ground_reconstruction.simulation.overlay import (
    RecordedScan,
    extinction_for_survival,
    overlay,
)
from smoke_ground_reconstruction.simulation.sensor import load_sensor
from smoke_ground_reconstruction.simulation.smoke import Smoke
from smoke_ground_reconstruction.simulation.world import Truth

COLUMN_DEG = 1.0
"""Width of the columns in which the reach of the clear scan is taken."""
REACH_RANK = 3
"""The reach is the range of the so-maniest farthest return of a column: two may be reflections."""
SHADOW_DEG = 10.0
"""Something near shadows so much to either side at the most."""
BEYOND = 0.2
"""Floor this much beyond the reach is a fault [m]."""
MIN_RETURNS, MIN_SPAN = 200, 1.0
"""Surviving floor returns, and the span of their ranges [m], from which a plane is asked for."""
MAX_HEIGHT_ERROR, MAX_TILT_ERROR_DEG = 0.010, 0.3
"""How near that plane must be to the clear scan's [m], [deg]."""


@dataclass(frozen=True)
class ClearRoom:
    """What a clear scan shows, in the sensor frame.

    Attributes:
        plane: (3,) float64 a, b, c of z = a x + b y + c through its floor.
        is_floor: (N,) bool, the returns on that plane.
        cells: (K, 2) int64 column and row of the cells that hold at least two of them, by edge [m].
        reach: (360,) float64 how far it saw by column of COLUMN_DEG [m]; NaN where it saw nothing.
        filled_reach: (360,) float64 the same where nothing near had stood in the way; see
            filled().
    """

    plane: np.ndarray
    is_floor: np.ndarray
    cells: Dict[float, np.ndarray]
    reach: np.ndarray
    filled_reach: np.ndarray

    @classmethod
    def of(cls, xyz, is_low):
        """From all returns (N, 3) and a mask of those that may be floor (N,)."""
        plane, band = fitted_plane(xyz[is_low])
        is_floor = is_low & (np.abs(height_above(plane, xyz)) <= band)
        floor = xyz[is_floor]
        cells = {cell: cells_of(floor, cell, at_least=2) for cell in CELL_SIZES}
        reach = reach_of(xyz)
        return cls(plane, is_floor, cells, reach, filled(reach))

    def beyond(self, xyz, filled=False):
        """How far each point lies beyond the reach [m], (N,); NaN in columns without any."""
        reach = self.filled_reach if filled else self.reach
        return np.hypot(xyz[:, 0], xyz[:, 1]) - reach[_column(xyz)]


def height_above(plane, xyz):
    """z minus the plane's of each point, (N,) [m]."""
    return xyz[:, 2] - xyz[:, :2] @ plane[:2] - plane[2]


def fitted_plane(xyz):
    """The plane that most of the area of low returns (N, 3) agrees on.

    Of 1000 planes through three means of 0.1 m cells that with most cells within 10 mm (RANSAC,
    always the same dice), refined by least squares over these.

    Returns:
        (3,) a, b, c of z = a x + b y + c, and three sigma of the returns about it [m].
    """
    _, of_cell = np.unique(np.floor(xyz[:, :2] / 0.1), axis=0, return_inverse=True)
    count = np.bincount(of_cell.ravel())
    means = np.column_stack([np.bincount(of_cell.ravel(), xyz[:, k]) / count for k in range(3)])
    triples = means[np.random.default_rng(0).integers(len(means), size=(1000, 3))]
    design = np.dstack([triples[..., :2], np.ones((1000, 3))])
    sound = np.abs(np.linalg.det(design)) > 0.01  # three places well apart
    planes = np.linalg.solve(design[sound], triples[sound, :, 2:])[..., 0]
    agree = [np.count_nonzero(np.abs(height_above(plane, means)) <= 0.01) for plane in planes]
    plane = planes[int(np.argmax(agree))]
    for _ in range(5):
        near = means[np.abs(height_above(plane, means)) <= 0.015]
        plane = np.linalg.lstsq(
            np.column_stack([near[:, :2], np.ones(len(near))]), near[:, 2], None
        )[0]
    error = np.abs(height_above(plane, xyz))
    return plane, max(0.02, 3 * 1.4826 * float(np.median(error[error <= 0.03])))


def cells_of(xyz, cell, at_least=1):
    """(K, 2) column and row of the cells of an edge [m] that hold so many of the points (N, 3)."""
    at, count = np.unique(np.floor(xyz[:, :2] / cell).astype(np.int64), axis=0, return_counts=True)
    return at[count >= at_least]


def is_knowable(cells, cell, hard):
    """(K,) bool: can what the smoke left tell of cells (K, 2) of an edge [m]?

    As in simulated rooms: where something at least as far away, a wall, a ceiling or floor, is
    still seen in the azimuth column of a cell's middle or of one of its corners, or a return in the
    cell itself. `hard` (N, 3): all returns that are not of smoke.
    """
    found = held_cells(cells, hard, cell)
    reach = reach_of(hard)
    for corner in ((0.5, 0.5), (0, 0), (0, 1), (1, 0), (1, 1)):
        place = (cells + corner) * cell
        found |= np.hypot(place[:, 0], place[:, 1]) <= reach[_column(place)]
    return found


def reach_of(xyz):
    """(360,) planar range of the REACH_RANK-th farthest return of each column [m]."""
    planar, column = np.hypot(xyz[:, 0], xyz[:, 1]), _column(xyz)
    reach = np.full(int(360 / COLUMN_DEG), np.nan)
    for i in range(len(reach)):
        ranges = np.sort(planar[column == i])
        if len(ranges) >= REACH_RANK:
            reach[i] = ranges[-REACH_RANK]
    return reach


def filled(reach):
    """The reach (360,) with shadows closed: at least the chord between what is seen up to
    SHADOW_DEG to either side. A wall that something near hides runs on there."""
    azimuth = np.radians(COLUMN_DEG) * np.arange(1, int(SHADOW_DEG / COLUMN_DEG) + 1)
    left, right = np.meshgrid(azimuth, azimuth)
    result = reach.copy()
    for i in range(len(reach)):
        steps = np.arange(1, len(azimuth) + 1)
        a, b = reach[(i + steps) % len(reach)][None, :], reach[(i - steps) % len(reach)][:, None]
        # The ray between two points (a, left) and (b, right) meets their chord here.
        chord = a * b * np.sin(left + right) / (a * np.sin(left) + b * np.sin(right))
        result[i] = np.nanmax(chord, initial=reach[i]) if np.isfinite(reach[i]) else reach[i]
    return result


def _column(xyz):
    azimuth = np.degrees(np.arctan2(xyz[:, 1], xyz[:, 0])) % 360.0
    return np.minimum(azimuth / COLUMN_DEG, 360.0 / COLUMN_DEG - 1).astype(int)


def held_cells(wanted, xyz, cell):
    """(K,) bool: which of some cells (K, 2) hold points (N, 3)?"""
    claimed = {tuple(at) for at in cells_of(xyz, cell)}
    return np.array([tuple(at) in claimed for at in wanted], dtype=bool)


def score(room, survivors, hard, output):
    """One output on one scan in smoke.

    Args:
        room: ClearRoom.
        survivors: (N, 3) the floor returns that the smoke let through [m].
        hard: (M, 3) all returns that it let through, walls' and furniture's, too [m].
        output: methods.Output with a surface.

    Returns:
        Plain numbers by name, metres and degrees; None where there is nothing to measure:
        floor_returns, span; raw@CELL, recovered@CELL: share of the clear scan's floor cells held by
        survivors and by the output; knowable@CELL: share of them of which any return tells, see
        is_knowable(); recovered_knowable@CELL: share of these held by the output; beyond_cells,
        beyond_max: claimed 0.1 m cells more than BEYOND beyond the reach, and the farthest claim
        beyond it; shadow_cells: those of them that are not beyond the reach with its shadows
        filled; unseen_cells: claimed cells in columns of which the recording has nothing;
        plane_height, plane_tilt_deg: the output's plane minus the clear scan's, straight below the
        sensor, and the angle between them; plane_asked: do enough survivors lie far enough apart;
        height_max: largest distance of the surface from the clear scan's plane, in the mean of one
        of its cells; within_2_sigma: share of these cells no farther from it than two of their own
        sigma.
    """
    surface = finite_points(output.surface)
    beyond = room.beyond(surface)
    outside = len(cells_of(surface[beyond > BEYOND], 0.1))
    ranges = np.hypot(survivors[:, 0], survivors[:, 1])
    span = float(np.ptp(np.percentile(ranges, [2.5, 97.5]))) if len(ranges) else 0.0
    found = {
        "floor_returns": len(survivors),
        "span": span,
        "plane_asked": bool(len(survivors) >= MIN_RETURNS and span >= MIN_SPAN),
        "beyond_cells": outside,
        "shadow_cells": outside - len(cells_of(surface[room.beyond(surface, True) > BEYOND], 0.1)),
        "beyond_max": float(np.nanmax(beyond, initial=0.0)),
        "unseen_cells": len(cells_of(surface[np.isnan(beyond)], 0.1)),
    }
    for cell in CELL_SIZES:
        wanted = room.cells[cell]
        held, knowable = held_cells(wanted, surface, cell), is_knowable(wanted, cell, hard)
        found[f"raw@{cell:g}"] = float(np.mean(held_cells(wanted, survivors, cell)))
        found[f"recovered@{cell:g}"] = float(np.mean(held))
        found[f"knowable@{cell:g}"] = float(np.mean(knowable))
        of_knowable = float(np.mean(held[knowable])) if knowable.any() else None
        found[f"recovered_knowable@{cell:g}"] = of_knowable
    return {**found, **_plane_errors(room, output.floor_plane), **_heights(room, output)}


def _plane_errors(room, plane):
    if plane is None:
        return {"plane_height": None, "plane_tilt_deg": None}
    normals = [
        np.array([-a, -b, 1.0]) / np.sqrt(a * a + b * b + 1.0) for a, b, _ in (plane, room.plane)
    ]
    across = np.linalg.norm(np.cross(*normals))
    return {
        "plane_height": float(plane[2] - room.plane[2]),
        "plane_tilt_deg": float(np.degrees(np.arcsin(min(1.0, across)))),
    }


def _heights(room, output):
    """Of the mean of each cell: one return alone is off by the range noise."""
    xyz = np.asarray(output.surface, dtype=np.float64)
    at, of_point = np.unique(
        np.floor(xyz[:, :2] / 0.1).astype(np.int64), axis=0, return_inverse=True
    )
    wanted = {tuple(cell) for cell in room.cells[0.1]}
    inside = np.array([tuple(cell) in wanted for cell in at], dtype=bool)
    if not inside.any():
        return {"height_max": None, "within_2_sigma": None}

    def means(values):
        return (np.bincount(of_point.ravel(), values) / np.bincount(of_point.ravel()))[inside]

    error = np.abs(means(height_above(room.plane, xyz)))
    covered = None if output.sigma is None else error <= 2.0 * means(output.sigma)
    return {
        "height_max": float(error.max()),
        "within_2_sigma": None if covered is None else float(np.mean(covered)),
    }


@dataclass(frozen=True)
class Recording:
    """A recorded clear scan, its sensor, and what it shows.

    Attributes:
        name: for tables.
        sensor: simulation Sensor.
        recorded: RecordedScan.
        room: ClearRoom.
    """

    name: str
    sensor: object
    recorded: RecordedScan
    room: ClearRoom

    @classmethod
    def open(cls, text, sensor):
        """From `FILE` or `SENSOR=FILE`.

        Raises:
            ValueError: no such sensor or file, several scans, or no floor in it.
        """
        from smoke_ground_reconstruction.io import files

        first, separator, rest = text.partition("=")
        name, path = (first, rest) if separator else (sensor, text)
        scans = files.open_scans(path)
        if len(scans) != 1:
            raise ValueError(f"{path} has {len(scans)} scans; --overlay takes files of one")
        recorded = RecordedScan.of(next(iter(scans)))
        room = ClearRoom.of(recorded.directions * recorded.ranges[:, None], recorded.is_floor)
        recorded = replace(recorded, is_floor=room.is_floor, sensor_height=float(-room.plane[2]))
        label = f"{Path(path).parent.name}/{Path(path).stem}".lstrip("/")
        return cls(label, load_sensor(name), recorded, room)

    def in_smoke(self, level, seed):
        """The scan as a ScanInput under the smoke of a level, and the mean extinction [1/m].

        A level is the share of the clear scan's floor cells (0.2 m) that survive, as everywhere.
        """
        recorded, smoke = self.recorded, Smoke()
        if level == "clear":
            extinction = 0.0
        else:
            extinction = extinction_for_survival(
                recorded, self.sensor, smoke, LEVELS[level], seed, cell=CELL_SIZES[0]
            )
        found = overlay(recorded, self.sensor, smoke.with_extinction(extinction), seed)
        scan = ScanInput(
            xyz=np.ascontiguousarray(found["xyz"]),
            intensity=found["intensity"].astype(np.float32),
            ring=found["ring"].astype(np.uint16),
            truth=found["truth"],
            sensor_height=recorded.sensor_height,
            T_world_sensor=np.eye(4),
            elevation_deg=self._elevations(),
        )
        return scan, extinction

    def _elevations(self):
        """Of the rings, where the file counts them as the simulator's sensor does."""
        elevation = np.degrees(np.arcsin(self.recorded.directions[:, 2]))
        table = np.asarray(self.sensor.elevation_deg)
        ring = self.recorded.ring.astype(int)
        if ring.max() >= len(table) or np.median(np.abs(elevation - table[ring])) > 0.3:
            return None
        return tuple(table)


def survivors_of(scan):
    """(N, 3) float64 the floor returns of a ScanInput made by Recording.in_smoke()."""
    return scan.xyz[scan.truth == Truth.FLOOR].astype(np.float64)


def hard_returns_of(scan):
    """(N, 3) float64 all of its returns that are not of smoke."""
    return scan.xyz[scan.truth != Truth.SMOKE].astype(np.float64)
