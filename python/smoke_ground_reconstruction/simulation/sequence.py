"""Sequences: a robot that drives through a scene, or stands in it, scan after scan."""

from dataclasses import dataclass

import numpy as np

from . import geometry
from .scan import pose_matrix, simulate_moving

TURN_RATE = 0.8
"""The robot turns on the spot at this rate [rad/s] where its way bends."""

SCANS_APART = 1_000_003  # keeps the noise of scan k of seed s apart from scan 0 of seed s + k


class Course:
    """The robot's way in time: along each leg at a speed, turning on the spot between legs.

    It stays upright and stands still at the end of its way.
    """

    def __init__(self, drive):
        points = drive.points
        legs = np.diff(points, axis=0)
        headings = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
        times, places, yaws = [0.0], [points[0]], [headings[0]]
        for i, leg in enumerate(legs):
            turn = abs(headings[i] - yaws[-1]) / TURN_RATE
            times.append(times[-1] + turn)
            places.append(points[i])
            yaws.append(headings[i])
            times.append(times[-1] + float(np.linalg.norm(leg)) / drive.speed)
            places.append(points[i + 1])
            yaws.append(headings[i])
        self._times, self._places, self._yaws = (np.array(v) for v in (times, places, yaws))

    @property
    def duration(self):
        """From start to end of the way [s]."""
        return float(self._times[-1])

    def at(self, times):
        """Places (n, 2) [m] and headings (n,) [rad] of the robot at times (n,) [s]."""
        x, y = (np.interp(times, self._times, column) for column in self._places.T)
        return np.column_stack([x, y]), np.interp(times, self._times, self._yaws)


@dataclass(frozen=True)
class Step:
    """One scan of a sequence and where the robot was.

    Attributes
    ----------
    scan : SimulatedScan
    base_poses : (steps, 4, 4) float64
        T_world_base at each azimuth step of the scan; base_link lies on the floor, x forward.
    T_base_sensor : (4, 4) float64
    """

    scan: object
    base_poses: np.ndarray
    T_base_sensor: np.ndarray


def drive_through(scene, sensor, seconds, smoke=None, seed=0, mode=None):
    """Scans along the scene's drive, one after the other; an iterator of Step.

    Raises
    ------
    SceneError
        If the scene has no drive.
    """
    if scene.drive is None:
        raise scene.error("drive", "is missing: no way to drive along (or give a pose to stand at)")
    course, mount = Course(scene.drive), mounting(sensor, scene.drive.height)
    height = scene.drive.height
    for number, times in _scan_times(sensor, seconds):
        places, yaws = course.at(times)
        base = _base_poses(scene, places, yaws)
        poses = base @ mount
        scan = simulate_moving(
            scene,
            sensor,
            poses,
            height,
            smoke,
            seed,
            mode,
            float(times[0]),
            seed + SCANS_APART * number,
        )
        yield Step(scan, base, mount)


def stand_still(scene, sensor, pose, seconds, smoke=None, seed=0, mode=None):
    """Scans of a sensor at rest while smoke drifts and people walk; an iterator of Step."""
    pose = scene.pose(pose)
    matrix = pose_matrix(scene, pose)
    base = np.eye(4)
    yaw_deg = pose.yaw_deg + sensor.forward_yaw_deg
    base[:3, :3] = geometry.rotation(yaw_deg)
    base[:3, 3] = matrix[:3, 3] - [0.0, 0.0, pose.height]
    for number, times in _scan_times(sensor, seconds):
        poses = np.broadcast_to(matrix, (len(times), 4, 4))
        scan = simulate_moving(
            scene,
            sensor,
            poses,
            pose.height,
            smoke,
            seed,
            mode,
            float(times[0]),
            seed + SCANS_APART * number,
        )
        yield Step(scan, np.broadcast_to(base, poses.shape), np.linalg.inv(base) @ matrix)


def scan_count(sensor, seconds):
    """Scans in a sequence of a length [s]: at least one."""
    return max(1, int(round(seconds * sensor.rate)))


def mounting(sensor, height):
    """T_base_sensor (4, 4) of a sensor that looks forward from a mast."""
    matrix = np.eye(4)
    matrix[:3, :3] = geometry.rotation(-sensor.forward_yaw_deg)
    matrix[2, 3] = height
    return matrix


def _scan_times(sensor, seconds):
    for number in range(scan_count(sensor, seconds)):
        start = number / sensor.rate
        yield number, start + np.arange(sensor.steps) / (sensor.rate * sensor.steps)


def _base_poses(scene, places, yaws):
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, 0, 0] = poses[:, 1, 1] = np.cos(yaws)
    poses[:, 1, 0] = np.sin(yaws)
    poses[:, 0, 1] = -poses[:, 1, 0]
    poses[:, :2, 3] = places
    poses[:, 2, 3] = scene.floor_z(places)
    return poses
