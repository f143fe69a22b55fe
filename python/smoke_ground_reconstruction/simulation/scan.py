"""One simulated scan with everything that is true about it."""

from dataclasses import dataclass

import numpy as np

from .._core import simulation as _simulation
from . import geometry
from .sensor import beams
from .world import set_people, set_robot, world_of


@dataclass(frozen=True)
class SimulatedScan:
    """Points in firing order, in the sensor's own (moving) frame, and their truth.

    Attributes
    ----------
    xyz : (N, 3) float32
        [m], sensor frame.
    intensity : (N,) float32
        0 .. 255, whole numbers.
    ring : (N,) uint16
        As the driver numbers it.
    t : (N,) float32
        [s] from the start of the scan.
    truth : (N,) uint8
        Class of each point (Truth).
    step : (N,) uint32
        Azimuth step that fired it.
    pose : (4, 4) float64
        T_world_sensor at the start of the scan.
    sensor_height : float
        Of the sensor's origin above the floor beneath it [m].
    extinction : float
        Mean extinction [1/m]; 0 in clear air.
    stamp : float
        Scene time of the start of the scan [s].
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    t: np.ndarray
    truth: np.ndarray
    step: np.ndarray
    pose: np.ndarray
    sensor_height: float
    extinction: float
    stamp: float = 0.0

    def __len__(self):
        return len(self.xyz)

    @property
    def level_rotation(self):
        """R_level_sensor (3, 3): turns the sensor frame upright, keeping its heading."""
        return level_rotation(self.pose)

    @property
    def level_xyz(self):
        """Points (N, 3) float64 in the level sensor-centred frame [m]."""
        return self.xyz.astype(np.float64) @ self.level_rotation.T


def pose_matrix(scene, pose):
    """T_world_sensor (4, 4) of a Pose."""
    matrix = np.eye(4)
    matrix[:3, :3] = geometry.rotation(pose.yaw_deg, pose.pitch_deg, pose.roll_deg)
    matrix[:3, 3] = [*pose.at, float(scene.floor_z([pose.at])[0]) + pose.height]
    return matrix


def heading(pose):
    """Angle [rad] of the sensor's x axis in the horizontal plane of a T_world_sensor."""
    return float(np.arctan2(pose[1, 0], pose[0, 0]))


def level_rotation(pose):
    """R_level_sensor (3, 3) of a T_world_sensor: upright, x axis as heading() says."""
    return geometry.rotation(np.degrees(heading(pose))).T @ pose[:3, :3]


def simulate(scene, sensor, pose=0, smoke=None, seed=0, mode=None, stamp=0.0):
    """Simulate one revolution.

    Parameters
    ----------
    scene : Scene
    sensor : Sensor
    pose : str, int, Pose
        The sensor at rest.
    smoke : Smoke, optional
        None: clear air.
    seed : int
        Decides the smoke's pattern and all noise; the same seed gives the same scan.
    mode : {"strongest", "last", "dual"}, optional
        The sensor's own if not given.
    stamp : float
        Scene time [s]: where people walk and smoke has drifted to.

    Returns
    -------
    SimulatedScan
    """
    pose = scene.pose(pose)
    matrix = pose_matrix(scene, pose)
    poses = np.broadcast_to(matrix, (sensor.steps, 4, 4))
    return simulate_moving(scene, sensor, poses, pose.height, smoke, seed, mode, stamp)


def simulate_moving(
    scene, sensor, poses, height, smoke=None, seed=0, mode=None, stamp=0.0, noise_seed=None
):
    """simulate() for a sensor that moves during the revolution.

    Parameters
    ----------
    poses : (steps, 4, 4) float
        T_world_sensor at each azimuth step.
    height : float
        Of the sensor above the floor beneath it [m].
    noise_seed : int, optional
        Of the dice of one scan, where `seed` keeps the smoke's pattern; the same if not given.
    """
    builder = prepare(scene, sensor, height, stamp)
    firing = firing_of(sensor, poses, stamp)
    smoke_field = None if smoke is None else smoke.field(seed)
    echoes = _simulation.scan(
        builder.world,
        smoke_field,
        sensor.receiver_params(),
        firing,
        mode or sensor.return_mode,
        seed if noise_seed is None else noise_seed,
    )
    fired, beam = beams(sensor), echoes["beam"]
    step = fired.step[beam]
    return SimulatedScan(
        xyz=(fired.directions[beam] * echoes["range"][:, None].astype(float)).astype(np.float32),
        intensity=echoes["intensity"],
        ring=fired.ring[beam],
        t=fired.step_times[step].astype(np.float32),
        truth=echoes["truth"],
        step=step,
        pose=np.array(poses[0], dtype=float),
        sensor_height=float(height),
        extinction=0.0 if smoke is None else smoke.mean_extinction,
        stamp=stamp,
    )


def prepare(scene, sensor, height, stamp=0.0, with_furniture=True):
    """The scene's compiled world with robot and people at a time [s]."""
    builder = world_of(scene, with_furniture)
    set_robot(builder, scene, height, sensor.forward_yaw_deg)
    set_people(builder, scene, stamp)
    return builder


def firing_of(sensor, poses, stamp=0.0):
    """The compiled Firing of one revolution from poses (steps, 4, 4)."""
    fired = beams(sensor)
    return _simulation.Firing(
        fired.directions, fired.step, np.ascontiguousarray(poses), fired.step_times + stamp
    )


def expect(scene, sensor, pose, smoke=None, seed=0, stamp=0.0):
    """What happens to each beam on the average, without the dice of detection.

    Returns
    -------
    dict
        Arrays (beams,): range [m] (inf: nothing met), reflectivity, optical_depth, probability
        (of detecting the surface, mode last), truth, and position (beams, 3) in the world.
    """
    pose = scene.pose(pose)
    matrix = pose_matrix(scene, pose)
    builder = prepare(scene, sensor, pose.height, stamp)
    firing = firing_of(sensor, np.broadcast_to(matrix, (sensor.steps, 4, 4)), stamp)
    smoke_field = None if smoke is None else smoke.field(seed)
    found = _simulation.expect(builder.world, smoke_field, sensor.receiver_params(), firing)
    classes = np.array(builder.truths(), dtype=np.uint8)
    met = np.isfinite(found["range"])
    found["truth"] = np.where(met, classes[np.where(met, found["material"], 0)], 0).astype(np.uint8)
    found["position"] = matrix[:3, 3] + found["range"][:, None] * (
        beams(sensor).directions @ matrix[:3, :3].T
    )
    return found
