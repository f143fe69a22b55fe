"""The simulator as the evaluation uses it: scans and truths by plain names."""

import math
from functools import lru_cache

import numpy as np

from smoke_ground_reconstruction import simulation
from smoke_ground_reconstruction.evaluation.scan_input import ScanInput
from smoke_ground_reconstruction.simulation.files import config_directory  # noqa: F401

Truth = simulation.Truth
LEVELS = tuple(simulation.LEVELS)

MAIN_POSES = {"basic_room": "position_5"}
"""Poses that stand for a scene where that is not the first: the thesis's smoke test stood here."""


@lru_cache(maxsize=None)
def _scene(name):
    return simulation.load_scene(name)


@lru_cache(maxsize=None)
def _sensor(name):
    return simulation.load_sensor(name)


def scenes():
    """Names of all scenes."""
    return tuple(simulation.scene_names())


def title(scene):
    """A scene's title."""
    return _scene(scene).title


def fingerprint(scene, sensor):
    """Hash of the files of a scene and a sensor, as text."""
    return f"{_scene(scene).digest} {_sensor(sensor).digest}"


def is_bounded(scene):
    """Has the scene neither windows nor doorways nor open doors?"""
    return bool(_scene(scene).bounded)


def poses(scene, which="all"):
    """Names of a scene's poses: "all" of them, or the "main" one alone."""
    names = tuple(pose.name for pose in _scene(scene).poses)
    return names if which == "all" else (MAIN_POSES.get(scene, names[0]),)


def scan(scene, sensor, pose, level, seed):
    """One scan as a ScanInput; the same for the same arguments."""
    simulated = simulation.level_scan(scene, sensor, pose, level, seed)
    return ScanInput.of(simulated, tuple(_sensor(sensor).elevation_deg))


@lru_cache(maxsize=8)
def clear_scan(scene, sensor, pose):
    """The pose's scan of seed 0 in clear air."""
    return scan(scene, sensor, pose, "clear", 0)


def extinction(scene, sensor, pose, level):
    """Mean extinction of a level's smoke [1/m]."""
    return calibration(scene, sensor, pose, level)["mean_extinction"]


def truth(scene, sensor, pose, cell, level, seed=0):
    """The FloorTruth that belongs to a scan, in cells of an edge [m]."""
    return simulation.level_truth(scene, sensor, pose, level, seed, cell)


def truth_at(scene, sensor, matrix, height, extinction, cell):
    """The FloorTruth around a place on a scene's floor.

    Args:
        scene, sensor: by name.
        matrix: (4, 4) T_world_sensor.
        height: of the sensor above the floor under it [m].
        extinction: mean, of the scene's smoke in the pattern of seed 0 [1/m].
        cell: edge of the cells [m].
    """
    room = _scene(scene)
    smoke = simulation.Smoke.of_scene(room, mean_extinction=extinction) if extinction > 0 else None
    return simulation.floor_truth(room, _sensor(sensor), _pose_of(matrix, height), cell, smoke)


def _pose_of(matrix, height):
    """The Pose of a T_world_sensor."""
    R = np.asarray(matrix, dtype=np.float64)[:3, :3]
    angles = np.arctan2(R[1, 0], R[0, 0]), -np.arcsin(R[2, 0]), np.arctan2(R[2, 1], R[2, 2])
    at = float(matrix[0][3]), float(matrix[1][3])
    return simulation.Pose("on the way", at, height, *(float(a) for a in np.degrees(angles)))


def calibration(scene, sensor, pose, level):
    """The smoke of a level as plain numbers.

    Returns:
        mean_extinction [1/m], visibility (meteorological range [m], None in clear air), and the
        share of floor cells kept, as found and as wanted.
    """
    found = simulation.calibrate(_scene(scene), _sensor(sensor), pose, level)
    visibility = found.meteorological_range
    return {
        "mean_extinction": float(found.mean_extinction),
        "visibility": float(visibility) if math.isfinite(visibility) else None,
        "share": float(found.share),
        "wanted": float(found.target),
    }
