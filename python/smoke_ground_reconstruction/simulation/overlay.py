"""Smoke over recorded scans: real geometry, beam pattern and intensities, simulated smoke.

A recorded intensity, taken as 255 gain Gamma_app, stands for the reflectivity that the physics of
simulate() asks for. Beams that came back empty in the recording stay empty: their directions are
not in the file, so the smoke in front of open windows is missing.
"""

from dataclasses import dataclass, replace

import numpy as np

from .._core import simulation as _simulation
from ..height import estimate_sensor_height
from .world import Truth

FLOOR_BAND = 0.05
"""Points within this distance [m] of the fitted floor count as floor."""

_THICKEST = 64.0  # [1/m]; a sensor on the floor sees it from centimetres
_HALVINGS = 18


@dataclass(frozen=True)
class RecordedScan:
    """A clear scan and what of it is floor.

    Attributes
    ----------
    directions : (N, 3) float64
        Unit vectors, sensor frame.
    ranges : (N,) float64
        [m]
    intensity : (N,) float64
        0 .. 255
    ring : (N,) uint16
    t : (N,) float32
        [s]; zeros where the file has none.
    is_floor : (N,) bool
    sensor_height : float
        [m]
    """

    directions: np.ndarray
    ranges: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    t: np.ndarray
    is_floor: np.ndarray
    sensor_height: float

    @classmethod
    def of(cls, scan, sensor_height=None):
        """From an io LidarScan; zero and non-finite points are left out.

        Parameters
        ----------
        sensor_height : float, optional
            [m]; estimated from the scan if not given.

        Raises
        ------
        ValueError
            No point, or no floor at that height.
        """
        xyz = scan.xyz.astype(np.float64)
        ranges = np.linalg.norm(xyz, axis=1)
        keep = np.isfinite(xyz).all(axis=1) & (ranges > 0)
        if not keep.any():
            raise ValueError("the recorded scan holds no return")
        xyz, ranges = xyz[keep], ranges[keep]
        height = sensor_height or estimate_sensor_height(xyz)
        time = np.zeros(len(keep), np.float32) if scan.t is None else scan.t
        return cls(
            directions=xyz / ranges[:, None],
            ranges=ranges,
            intensity=np.clip(scan.intensity[keep].astype(np.float64), 0.0, 255.0),
            ring=scan.ring[keep],
            t=time[keep],
            is_floor=_floor_points(xyz, height),
            sensor_height=float(height),
        )

    def only(self, mask):
        """The beams of a mask (N,) alone."""
        columns = {
            name: getattr(self, name)[mask]
            for name in ("directions", "ranges", "intensity", "ring", "t", "is_floor")
        }
        return replace(self, **columns)


def _floor_points(xyz, height):
    """Points near the plane that fits those near z = -height best."""
    plane = np.array([0.0, 0.0, -height])
    for band in (0.10, FLOOR_BAND, FLOOR_BAND):
        near = np.abs(xyz[:, 2] - xyz[:, :2] @ plane[:2] - plane[2]) <= band
        if np.count_nonzero(near) < 100:
            raise ValueError(f"fewer than 100 returns lie on a floor {height:g} m below the sensor")
        design = np.column_stack([xyz[near, :2], np.ones(np.count_nonzero(near))])
        plane = np.linalg.lstsq(design, xyz[near, 2], rcond=None)[0]
    return np.abs(xyz[:, 2] - xyz[:, :2] @ plane[:2] - plane[2]) <= FLOOR_BAND


def extinction_for_survival(recorded, sensor, smoke, survival, seed=0, mode=None, cell=None):
    """The mean extinction [1/m] at which that share of the floor survives.

    Found by bisection over overlay() of the floor's beams, so that in mode `strongest` the smoke's
    own returns count against the floor as they will in the scan.

    Parameters
    ----------
    recorded : RecordedScan
    survival : float
        In (0, 1).
    cell : float, optional
        Count the floor in cells of this edge [m], as a scene's smoke levels do; its returns if not
        given.

    Raises
    ------
    ValueError
        If survival lies outside, or even the thickest smoke leaves more.
    """
    if not 0.0 < survival < 1.0:
        raise ValueError(f"survival must lie between 0 and 1, not {survival!r}")
    floor = recorded.only(recorded.is_floor)
    whole = _floor_size(floor.directions * floor.ranges[:, None], cell)

    def surviving(extinction):
        result = overlay(floor, sensor, smoke.with_extinction(extinction), seed, mode)
        return _floor_size(result["xyz"][result["truth"] == Truth.FLOOR], cell) / whole

    if surviving(_THICKEST) > survival:
        raise ValueError(f"no smoke below {_THICKEST:g} /m leaves only {survival:g} of the floor")
    low, high = 0.0, _THICKEST
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surviving(middle) > survival else (low, middle)
    return 0.5 * (low + high)


def _floor_size(xyz, cell):
    """Number of points (N, 3), or of cells of an edge [m] that hold any."""
    return len(xyz) if cell is None else len(np.unique(np.floor(xyz[:, :2] / cell), axis=0))


def overlay(recorded, sensor, smoke, seed=0, mode=None):
    """The recorded scan as it would have been in smoke.

    Parameters
    ----------
    recorded : RecordedScan
    sensor : Sensor
        Its receiver: detection limit and intensity scale.
    smoke : Smoke
    seed : int
    mode : {"strongest", "last", "dual"}, optional

    Returns
    -------
    dict
        Arrays xyz (M, 3) float32 [m], intensity float32, ring uint16, t float32, truth uint8:
        Truth.FLOOR, Truth.SMOKE, or Truth.NONE for all else, which the recording does not tell.
    """
    truth = np.where(recorded.is_floor, Truth.FLOOR, Truth.NONE).astype(np.uint8)
    echoes = _simulation.overlay(
        smoke.field(seed),
        sensor.receiver_params(),
        recorded.directions,
        recorded.ranges,
        recorded.intensity,
        truth,
        recorded.sensor_height,
        mode or sensor.return_mode,
        seed,
    )
    beam = echoes["beam"]
    xyz = recorded.directions[beam] * echoes["range"][:, None].astype(np.float64)
    return {
        "xyz": xyz.astype(np.float32),
        "intensity": echoes["intensity"],
        "ring": recorded.ring[beam],
        "t": recorded.t[beam],
        "truth": echoes["truth"],
    }
