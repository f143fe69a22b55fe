"""A box room as a LidarScan, for the tests of files and commands."""

import numpy as np

import rooms
from smoke_ground_reconstruction.io.clouds import LidarScan

HEIGHT = 0.7  # of the sensor above the floor [m]


def box_room(half_x=2.5, half_y=2.0, rings=64, steps=450, height=HEIGHT) -> LidarScan:
    """Returns of floor, walls and ceiling of a room, the sensor in the middle."""
    view, _ = rooms.box_room(
        walls=(half_x, half_y, -half_x, -half_y),
        ceiling=2.5 - height,
        floor=-height,
        elevations_deg=np.linspace(-50.0, 30.0, rings),
        azimuth_step_deg=360.0 / steps,
    )
    times = np.tile(np.linspace(0.0, 0.1, steps, endpoint=False, dtype=np.float32), rings)
    return LidarScan(view.xyz, view.intensity, view.ring, times)
