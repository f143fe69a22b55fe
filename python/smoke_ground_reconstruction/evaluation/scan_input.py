"""What a method is given: one scan, cleaned of the points that are no returns."""

from dataclasses import dataclass, replace
from typing import Optional, Tuple

import numpy as np

from smoke_ground_reconstruction.evaluation.yardstick import to_level


@dataclass(frozen=True)
class ScanInput:
    """One scan in the sensor frame, and what the user knows of the sensor.

    Attributes:
        xyz: (N, 3) float32 [m], finite and nowhere (0, 0, 0).
        intensity: (N,) float32 on the sensor's scale.
        ring: (N,) uint16.
        truth: (N,) uint8 class of each point (simulation.Truth); no method but the raw cloud's own
            row looks at it.
        sensor_height: of the sensor above the floor under it [m].
        T_world_sensor: (4, 4), for the yardstick alone: methods take the sensor as level.
        elevation_deg: elevation of each ring, where the sensor is known [deg].
        in_clear_air: ScanInput from the same pose without smoke, for what a method learns there.
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    truth: np.ndarray
    sensor_height: float
    T_world_sensor: np.ndarray
    elevation_deg: Optional[Tuple[float, ...]] = None
    in_clear_air: Optional["ScanInput"] = None

    @classmethod
    def of(cls, scan, elevation_deg=None):
        """Take over a SimulatedScan without its non-returns."""
        xyz = np.asarray(scan.xyz, dtype=np.float32)
        valid = np.isfinite(xyz).all(axis=1) & (xyz != 0).any(axis=1)
        return cls(
            xyz=np.ascontiguousarray(xyz[valid]),
            intensity=np.asarray(scan.intensity, dtype=np.float32)[valid],
            ring=np.asarray(scan.ring, dtype=np.uint16)[valid],
            truth=np.asarray(scan.truth, dtype=np.uint8)[valid],
            sensor_height=float(scan.sensor_height),
            T_world_sensor=np.asarray(scan.pose, dtype=np.float64),
            elevation_deg=elevation_deg,
        )

    def __len__(self):
        return len(self.xyz)

    @property
    def ranges(self):
        """(N,) float64 distance of each point to the sensor [m]."""
        return np.linalg.norm(self.xyz.astype(np.float64), axis=1)

    def to_level(self, xyz):
        """Sensor frame to the level frame of the truth, (M, 3) float64 [m]."""
        return to_level(xyz, self.T_world_sensor)

    def select(self, mask):
        """The points of a mask, (N,) bool."""
        return replace(
            self,
            xyz=np.ascontiguousarray(self.xyz[mask]),
            intensity=self.intensity[mask],
            ring=self.ring[mask],
            truth=self.truth[mask],
        )
