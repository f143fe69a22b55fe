"""Rooms, LiDARs and smoke in simulation, with the truth about every point and floor cell.

::

    from smoke_ground_reconstruction import simulation as sim
    scene, sensor = sim.load_scene("basic_room"), sim.load_sensor("qt128")
    heavy = sim.calibrate(scene, sensor, "position_5", "heavy")
    smoke = sim.Smoke.of_scene(scene, mean_extinction=heavy.mean_extinction)
    scan = sim.simulate(scene, sensor, "position_5", smoke, seed=1)
    truth = sim.floor_truth(scene, sensor, "position_5", cell=0.2, smoke=smoke, seed=1)
"""

from .errors import SceneError
from .levels import LEVELS, Calibration, calibrate, level_scan, level_smoke, level_truth
from .scan import SimulatedScan, expect, simulate
from .scene import Pose, Scene, load_scene, scene_names
from .sensor import Sensor, load_sensor, sensor_names
from .smoke import SOOT_BACKSCATTER_RATIO, Smoke, meteorological_range, optical_density
from .truth import FloorTruth, floor_truth
from .world import Truth

__all__ = [
    "LEVELS",
    "SOOT_BACKSCATTER_RATIO",
    "Calibration",
    "FloorTruth",
    "Pose",
    "Scene",
    "SceneError",
    "Sensor",
    "SimulatedScan",
    "Smoke",
    "Truth",
    "calibrate",
    "expect",
    "floor_truth",
    "level_scan",
    "level_smoke",
    "level_truth",
    "load_scene",
    "load_sensor",
    "meteorological_range",
    "optical_density",
    "scene_names",
    "sensor_names",
    "simulate",
]
