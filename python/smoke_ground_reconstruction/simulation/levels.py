"""Smoke levels: how thick the smoke must be for a given share of the floor to be left.

A level is the share of the same pose's clear-air floor cells (0.2 m) that the raw cloud keeps, in
the mean over seeds. The mean extinction that gives it is found by bisection per scene and pose.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import erfc

from . import cache
from .scan import SimulatedScan, expect, pose_matrix, simulate
from .scene import load_scene
from .sensor import beams, load_sensor
from .smoke import Smoke, meteorological_range, optical_density
from .truth import detection_by_group, floor_truth, to_level
from .world import Truth

LEVELS = {"clear": 1.0, "light": 0.90, "heavy": 0.66, "very_heavy": 0.40, "extreme": 0.25}
"""Share of the clear-air floor cells that the raw cloud keeps."""

CELL = 0.2
_PROBE = 0.05  # extinction at which optical depths are taken [1/m]; they are linear in it
_THICKEST = 8.0  # [1/m]
_STEPS = 15


def _silent(items, _total):
    return items


@dataclass(frozen=True)
class Calibration:
    """A smoke level of one scene, sensor and pose.

    Attributes
    ----------
    level : str
    target : float
        Share of clear-air floor cells that the level asks for.
    mean_extinction : float
        [1/m]
    share : float
        Share expected at that extinction, in the mean over seeds.
    share_by_seed : (seeds,) float64
    cells : float
        Expected number of floor cells of the clear scan.
    extinctions, shares : (n,) float64
        The course of the bisection.
    """

    level: str
    target: float
    mean_extinction: float
    share: float
    share_by_seed: np.ndarray
    cells: float
    extinctions: np.ndarray
    shares: np.ndarray

    @property
    def meteorological_range(self):
        """MOR [m]."""
        return meteorological_range(self.mean_extinction)

    @property
    def optical_density(self):
        """Per metre."""
        return optical_density(self.mean_extinction)

    def summary(self):
        """One line for people."""
        return (
            f"{self.level}: extinction {self.mean_extinction:.3f} /m, "
            f"MOR {self.meteorological_range:.1f} m, "
            f"optical density {self.optical_density:.3f} /m, keeps {100 * self.share:.1f} % of "
            f"{self.cells:.0f} clear-air floor cells (target {100 * self.target:.0f} %; seeds "
            f"{100 * self.share_by_seed.min():.1f} to {100 * self.share_by_seed.max():.1f} %)"
        )


def calibrate(scene, sensor, pose=0, level="heavy", smoke=None, seeds=10, progress=_silent):
    """The mean extinction of a level.

    Detection is taken in expectation (each beam's probability), so the result has no noise but
    that of the smoke's pattern.

    Parameters
    ----------
    scene : Scene
    sensor : Sensor
    pose : str, int, Pose
    level : str
        A key of LEVELS.
    smoke : Smoke, optional
        All but its mean extinction; the scene's own smoke if not given.
    seeds : int
        Patterns 0 .. seeds - 1.
    progress : callable
        Wraps the iterator over patterns, to show how far it is; gets their number, too. Not called
        where the cache has the answer.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        Unknown level, or the clear scan sees no floor.
    """
    if level not in LEVELS:
        raise ValueError(f"level must be one of {', '.join(LEVELS)}, not {level!r}")
    pose = scene.pose(pose)
    smoke = (smoke or Smoke.of_scene(scene)).with_extinction(_PROBE)
    key = {
        "scene": scene.digest,
        "sensor": sensor.digest,
        "pose": pose,
        "levels": LEVELS,
        "smoke": smoke,
        "seeds": seeds,
    }
    compute = lambda: _calibrate_all(scene, sensor, pose, smoke, seeds, progress)  # noqa: E731
    found = cache.arrays("levels", key, compute)
    row = list(LEVELS).index(level)
    extinctions, shares = found["courses"][row].T
    return Calibration(
        level=level,
        target=LEVELS[level],
        mean_extinction=float(found["mean_extinctions"][row]),
        share=float(found["shares"][row].mean()),
        share_by_seed=found["shares"][row],
        cells=float(found["cells"]),
        extinctions=extinctions,
        shares=shares,
    )


def _calibrate_all(scene, sensor, pose, smoke, seeds, progress):
    """Extinction (levels,), shares (levels, seeds), courses (levels, steps, 2), clear cells."""
    survival = FloorSurvival(scene, sensor, pose, smoke, seeds, progress)
    clear = survival.cells(0.0)
    if not clear.min() > 0:
        raise ValueError(f"{scene.file}: pose {pose.name}: the clear scan sees no floor")
    results = [_bisect(lambda x: survival.cells(x) / clear, share) for share in LEVELS.values()]
    extinctions, shares, courses = zip(*results)
    return {
        "mean_extinctions": np.array(extinctions),
        "shares": np.array(shares),
        "courses": np.array(courses),
        "cells": clear.mean(),
    }


def _bisect(shares_at, target):
    """The extinction whose mean share is the target, its shares, and the course of the search."""
    low, high = 0.0, 0.0 if target >= 1.0 else _THICKEST
    course = []
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        share = float(shares_at(middle).mean())
        course.append((middle, share))
        low, high = (middle, high) if share > target else (low, middle)
    extinction = 0.5 * (low + high)
    return extinction, shares_at(extinction), course


class FloorSurvival:
    """Expected number of floor cells that a scan reaches, as a function of the extinction."""

    def __init__(self, scene, sensor, pose, smoke, seeds, progress=_silent):
        truth = floor_truth(scene, sensor, pose, CELL)
        counted = (truth.visible_floor & ~truth.under_sensor).ravel()
        self._size = counted.size
        self._limit = sensor.receiver_params()
        self._beams = []
        for seed in progress(range(seeds), seeds):
            found = expect(scene, sensor, pose, smoke.with_extinction(_PROBE), seed)
            floor = found["truth"] == Truth.FLOOR
            cell = truth.cells_of(to_level(scene, pose, found["position"][floor, :2]))
            use = (cell >= 0) & counted[cell]
            signal = (
                found["reflectivity"][floor]
                / self._limit.reference_reflectivity
                * (self._limit.reference_range / found["range"][floor]) ** 2
            )
            depth = found["optical_depth"][floor] / _PROBE
            self._beams.append((cell[use], np.log(signal[use]), depth[use]))

    def cells(self, extinction):
        """Expected cells (seeds,) at a mean extinction [1/m]."""
        return np.array(
            [
                detection_by_group(
                    cell,
                    detection_probability(
                        log_signal - 2 * extinction * depth, self._limit.detection_sigma
                    ),
                    self._size,
                ).sum()
                for cell, log_signal, depth in self._beams
            ]
        )


def detection_probability(log_signal, detection_sigma):
    """Phi(ln S / sigma_d), elementwise."""
    return 0.5 * erfc(-log_signal / (detection_sigma * np.sqrt(2.0)))


@lru_cache(maxsize=128)
def _scene(name):
    return load_scene(name)


@lru_cache(maxsize=16)
def _sensor(name):
    return load_sensor(name)


def level_smoke(scene, sensor, pose, level):
    """The calibrated Smoke of a level; None for clear air."""
    if level == "clear":
        return None
    calibration = calibrate(scene, sensor, pose, level)
    return Smoke.of_scene(scene, mean_extinction=calibration.mean_extinction)


def level_scan(scene_name, sensor_name, pose_index, level, seed):
    """A scan of a scene at a smoke level, from the cache if it was simulated before.

    Returns
    -------
    SimulatedScan
    """
    scene, sensor = _scene(scene_name), _sensor(sensor_name)
    pose = scene.pose(pose_index)
    smoke = level_smoke(scene, sensor, pose, level)
    key = {
        "scene": scene.digest,
        "sensor": sensor.digest,
        "pose": pose,
        "smoke": smoke,
        "seed": seed,
    }
    packed = cache.arrays("scans", key, lambda: _pack(simulate(scene, sensor, pose, smoke, seed)))
    return _unpack(packed, scene, sensor, pose, smoke)


def level_truth(scene_name, sensor_name, pose_index, level, seed, cell=CELL):
    """The FloorTruth that belongs to a level_scan()."""
    scene, sensor = _scene(scene_name), _sensor(sensor_name)
    pose = scene.pose(pose_index)
    return floor_truth(scene, sensor, pose, cell, level_smoke(scene, sensor, pose, level), seed)


def _pack(scan):
    """What cannot be computed from the sensor: a third of the scan's size."""
    return {
        "xyz": scan.xyz,
        "intensity": scan.intensity.astype(np.uint8),
        "ring": scan.ring,
        "step": scan.step.astype(np.uint16),
        "truth": scan.truth,
    }


def _unpack(packed, scene, sensor, pose, smoke):
    times = beams(sensor).step_times
    return SimulatedScan(
        xyz=packed["xyz"],
        intensity=packed["intensity"].astype(np.float32),
        ring=packed["ring"],
        t=times[packed["step"]].astype(np.float32),
        truth=packed["truth"],
        step=packed["step"].astype(np.uint32),
        pose=pose_matrix(scene, pose),
        sensor_height=pose.height,
        extinction=0.0 if smoke is None else smoke.mean_extinction,
    )
