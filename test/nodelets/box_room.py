"""Scans whose floor is known: a box room ray-cast from inside, isolated dim points for smoke."""

import numpy as np

HEIGHT = 0.70  # of the sensor above the floor [m]
HALF_LENGTH, HALF_WIDTH, CEILING = 4.0, 3.0, 2.5 - HEIGHT  # walls and ceiling seen from the sensor
ELEVATIONS_DEG = np.linspace(-40.0, 22.0, 32)  # ring 0 the lowest


def box_room(step_deg=0.8, smoke=200, seed=1):
    """A scan of the room: xyz (N, 3) float32, intensity (N,) float32, ring (N,) uint16.

    Floor, walls and ceiling have intensity 60, the `smoke` points 3; two points are no returns.
    """
    azimuth, elevation = np.meshgrid(
        np.radians(np.arange(0.1, 360.0, step_deg)), np.radians(ELEVATIONS_DEG)
    )
    rays = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=-1,
    )
    limits = np.array([HALF_LENGTH, HALF_WIDTH, 0.0]) * np.sign(rays)
    limits[..., 2] = np.where(rays[..., 2] < 0, -HEIGHT, CEILING)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.nanmin(np.where(rays != 0, limits / rays, np.inf), axis=-1)
    ring = np.broadcast_to(np.arange(32)[:, None], distance.shape)

    random = np.random.RandomState(seed)
    hit = random.choice(distance.size, smoke, replace=False)
    distance.reshape(-1)[hit] *= random.uniform(0.2, 0.5, smoke)
    intensity = np.full(distance.size, 60.0, np.float32)
    intensity[hit] = 3.0
    xyz = (rays * distance[..., None]).reshape(-1, 3).astype(np.float32)
    xyz[0] = 0.0
    xyz[1] = np.nan
    return xyz, intensity, ring.reshape(-1).astype(np.uint16)
