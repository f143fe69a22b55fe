"""LiDARs as data files: beams, firing pattern, receiver and driver layout.

Keys: those of the files in `config`; angles in degrees, the rest in SI units.
"""

import hashlib
import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from .._core import simulation as _simulation
from . import files
from .errors import SceneError
from .keys import read_yaml

_RECEIVER_KEYS = (
    "reference_range",
    "reference_reflectivity",
    "detection_sigma",
    "range_noise",
    "range_unit",
    "min_range",
    "max_range",
    "divergence",
    "range_walk",
    "intensity_gain",
    "intensity_noise",
)
LAYOUTS = ("hesai", "velodyne", "ouster")


@dataclass(frozen=True, eq=False)
class Sensor:
    """A spinning LiDAR; see load_sensor().

    Attributes
    ----------
    elevation_deg, azimuth_offset_deg : (rings,) float
        Of each ring, as the driver numbers it.
    azimuth_step_deg : float
        From one firing to the next.
    firing : tuple of (n,) uint16
        Rings that fire together, in turn.
    azimuth_zero : {"x", "y"}
        The axis at azimuth 0.
    clockwise : bool
        Sense of rotation, seen from above; azimuth offsets count in it.
    receiver : dict
        Parameters of the receiving end, SI units.
    """

    name: str
    digest: str
    frame_id: str
    topic: str
    layout: str
    elevation_deg: np.ndarray
    azimuth_offset_deg: np.ndarray
    azimuth_step_deg: float
    azimuth_zero: str
    clockwise: bool
    forward_yaw_deg: float
    rate: float
    firing: tuple
    return_mode: str
    receiver: dict

    @property
    def rings(self):
        """Number of rings."""
        return len(self.elevation_deg)

    @property
    def steps(self):
        """Azimuth steps of one revolution."""
        return int(round(360.0 / self.azimuth_step_deg))

    @property
    def beams_per_scan(self):
        """Measurements of one revolution and return."""
        return len(beams(self).ring)

    def receiver_params(self):
        """The receiver as the compiled simulator takes it."""
        params = _simulation.ReceiverParams()
        for key, value in self.receiver.items():
            setattr(params, key, value)
        return params


@dataclass(frozen=True)
class Beams:
    """The beams of one revolution in firing order."""

    ring: np.ndarray  # (N,) uint16
    step: np.ndarray  # (N,) uint32, azimuth step
    directions: np.ndarray  # (N, 3) float64 unit vectors, sensor frame
    step_times: np.ndarray  # (steps,) float64 [s] from the start of the scan


@lru_cache(maxsize=16)
def beams(sensor):
    """Beams of one revolution of a Sensor."""
    groups = [sensor.firing[step % len(sensor.firing)] for step in range(sensor.steps)]
    ring = np.concatenate(groups).astype(np.uint16)
    step = np.repeat(np.arange(sensor.steps, dtype=np.uint32), [len(group) for group in groups])
    turned = np.radians(step * sensor.azimuth_step_deg + sensor.azimuth_offset_deg[ring])
    azimuth = -turned if sensor.clockwise else turned
    if sensor.azimuth_zero == "y":
        azimuth = azimuth + 0.5 * math.pi
    elevation = np.radians(sensor.elevation_deg[ring])
    directions = np.column_stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    times = np.arange(sensor.steps) / (sensor.rate * sensor.steps)
    return Beams(ring, step, directions, times)


def sensor_names():
    """Names of the sensors in `config`, sorted."""
    found = []
    for name in files.names("."):
        keys = read_yaml(files.config_directory() / f"{name}.yaml")
        if keys.has("rings"):
            found.append(name)
    return found


def load_sensor(name):
    """Read and check a sensor.

    Parameters
    ----------
    name : str or Path
        A name in `config`, or a path that ends in .yaml.

    Raises
    ------
    SceneError
        One line that names the file and the key.
    """
    path = files.resolve(name, ".", "sensor")
    keys = read_yaml(path)
    elevation, offset = _rings(keys)
    sensor = Sensor(
        name=Path(path).stem,
        digest=hashlib.sha256(Path(path).read_bytes()).hexdigest(),
        frame_id=keys.text("frame_id"),
        topic=keys.text("topic"),
        layout=keys.text("layout", choices=LAYOUTS),
        elevation_deg=elevation,
        azimuth_offset_deg=offset,
        azimuth_step_deg=keys.number("azimuth_step_deg", low=0.01, high=10.0),
        azimuth_zero=keys.text("azimuth_zero", choices=("x", "y")),
        clockwise=keys.flag("clockwise"),
        forward_yaw_deg=keys.number("forward_yaw_deg", 0.0),
        rate=keys.number("rate", 10.0, 1.0, 100.0),
        firing=_firing(keys, len(elevation)),
        return_mode=keys.text("return_mode", "last", choices=("strongest", "last", "dual")),
        receiver=_receiver(keys),
    )
    keys.text("title", "")
    keys.finish()
    _check_revolution(keys, sensor)
    return sensor


def _rings(keys):
    rows = keys.take("rings")
    is_table = (
        isinstance(rows, list)
        and rows
        and all(
            isinstance(row, list)
            and len(row) == 2
            and all(isinstance(value, (int, float)) and math.isfinite(value) for value in row)
            for row in rows
        )
    )
    if not is_table:
        raise keys.error("rings", "must be a list of [elevation_deg, azimuth_offset_deg]")
    table = np.array(rows, dtype=float)
    if np.any(np.abs(table[:, 0]) > 90):
        raise keys.error("rings", "elevations must lie in [-90, 90]")
    return table[:, 0], table[:, 1]


def _firing(keys, rings):
    """Groups of rings from lists of [first, last] pairs; all rings at once by default."""
    groups = keys.take("firing", [[[0, rings - 1]]])
    found = []
    for i, group in enumerate(groups if isinstance(groups, list) else []):
        try:
            members = np.concatenate([np.arange(first, last + 1) for first, last in group])
        except (TypeError, ValueError):
            raise keys.error(f"firing[{i}]", "must be a list of [first, last] rings") from None
        if len(members) == 0 or members.min() < 0 or members.max() >= rings:
            raise keys.error(f"firing[{i}]", f"rings must lie in [0, {rings - 1}]")
        found.append(members.astype(np.uint16))
    if not found:
        raise keys.error("firing", "must be a list of groups")
    return tuple(found)


def _receiver(keys):
    inner = keys.mapping("receiver")
    values = {key: inner.number(key, low=0.0, high=1e4) for key in _RECEIVER_KEYS if inner.has(key)}
    inner.finish()
    params = _simulation.ReceiverParams()
    for key, value in values.items():
        setattr(params, key, value)
    return values


def _check_revolution(keys, sensor):
    steps = 360.0 / sensor.azimuth_step_deg
    if abs(steps - round(steps)) > 1e-6 or round(steps) % len(sensor.firing) != 0:
        raise SceneError(
            f"{keys.file}: azimuth_step_deg: 360 deg must hold a whole number of firing cycles"
        )
