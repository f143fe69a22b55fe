"""A box room as a LiDAR sees it, by hand-written ray casting, for the tests of files and commands."""

import numpy as np

from smoke_ground_reconstruction.io.clouds import LidarScan

HEIGHT = 0.7  # of the sensor above the floor [m]


def box_room(half_x=2.5, half_y=2.0, rings=64, steps=450, height=HEIGHT) -> LidarScan:
    """Returns of floor and walls of a room without a ceiling, sensor in the middle."""
    elevation = np.radians(np.linspace(-50.0, 30.0, rings))
    azimuth = np.radians(np.arange(steps) * 360.0 / steps)
    ring, step = np.meshgrid(np.arange(rings), np.arange(steps), indexing="ij")
    direction = np.stack(
        [
            np.cos(elevation[ring]) * np.cos(azimuth[step]),
            np.cos(elevation[ring]) * np.sin(azimuth[step]),
            np.sin(elevation[ring]),
        ],
        axis=-1,
    ).reshape(-1, 3)
    with np.errstate(divide="ignore"):
        to_wall_x = half_x / np.abs(direction[:, 0])
        to_wall_y = half_y / np.abs(direction[:, 1])
        to_floor = np.where(direction[:, 2] < 0, -height / direction[:, 2], np.inf)
    reach = np.minimum(np.minimum(to_wall_x, to_wall_y), to_floor)
    return LidarScan(
        xyz=(direction * reach[:, None]).astype(np.float32),
        intensity=np.full(len(reach), 40.0, np.float32),
        ring=ring.ravel().astype(np.uint16),
        t=(step.ravel() * (0.1 / steps)).astype(np.float32),
    )
