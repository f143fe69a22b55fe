"""Rooms and clouds with known geometry, made from a seed."""

import numpy as np

from smoke_ground_reconstruction.reference.scan import ScanView

SENSOR_HEIGHT = 0.70
ELEVATIONS_DEG = np.linspace(-52.0, 20.0, 40)


def view_of(points, intensity=50.0, ring=0):
    """ScanView of a list of points; intensity and ring one for all or one each."""
    xyz = np.array(points, np.float32).reshape(-1, 3)
    return ScanView(
        xyz,
        np.broadcast_to(np.asarray(intensity, np.float32), len(xyz)).copy(),
        np.broadcast_to(np.asarray(ring, np.uint16), len(xyz)).copy(),
    )


def joined(*views):
    """One ScanView of several, in their order."""
    return ScanView(*(np.concatenate(arrays) for arrays in zip(*views)))


def box_room(
    walls=(3.4, 3.0, -3.4, -3.0),
    ceiling=1.9,
    floor=-SENSOR_HEIGHT,
    elevations_deg=ELEVATIONS_DEG,
    azimuth_step_deg=0.8,
    range_noise=0.0,
    seed=0,
):
    """Ray-cast box: ScanView and surface per point (0 floor, 1 wall, 2 ceiling).

    `walls` are the planes x, y, -x, -y [m]; the sensor is level at the origin; ring 0 is the first
    elevation.
    """
    azimuths = np.radians(np.arange(0.0, 360.0, azimuth_step_deg) + azimuth_step_deg / 3)
    elevation, azimuth = np.meshgrid(np.radians(elevations_deg), azimuths, indexing="ij")
    ray = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=-1,
    ).reshape(-1, 3)
    planes = [(2, floor, 0), (0, walls[0], 1), (1, walls[1], 1)]
    planes += [(0, walls[2], 1), (1, walls[3], 1), (2, ceiling, 2)]
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = np.stack([position / ray[:, axis] for axis, position, _ in planes])
    distances[~(distances > 0.0)] = np.inf
    hit = distances.argmin(axis=0)
    distance = distances.min(axis=0)
    distance += range_noise * np.random.default_rng(seed).standard_normal(len(distance))
    surface = np.array([kind for _, _, kind in planes])[hit]
    ring = np.repeat(np.arange(len(elevations_deg)), len(azimuths))
    intensity = np.array([15.0, 60.0, 70.0])[surface]
    return view_of(ray * distance[:, None], intensity, ring), surface


GLASS_FRONT_RINGS = np.arange(-15.0, 16.0, 2.0)


def glass_front(range_noise=0.0, seed=0, rings=GLASS_FRONT_RINGS):
    """A room of 6.5 x 5 m, seen by few rings from 0.7 m: behind 3.6 m of glass in the wall x = 3.2
    a terrace goes on 5 cm lower, up to a facade at x = 11.2."""
    inside, surface = box_room((3.2, 2.7, -3.3, -2.3), 1.9, -0.7, rings, 0.4, range_noise, seed)
    outside, _ = box_room((11.2, 10.7, -3.3, -9.0), 20.0, -0.75, rings, 0.4, range_noise, seed)
    x, y, _ = inside.xyz.T
    through = (surface == 1) & (np.abs(x - 3.2) < 0.05) & (np.abs(y) < 1.8)
    return inside._replace(xyz=np.where(through[:, None], outside.xyz, inside.xyz))


def few_rings_in_smoke(noise, seed=0):
    """A room of 6.8 x 6 m, seen by few rings from 0.7 m, without half of the floor's returns."""
    walls = (3.4, 3.0, -3.4, -3.0)
    view, surface = box_room(walls, 1.9, -0.7, GLASS_FRONT_RINGS, 0.4, noise, seed)
    return view.select((surface != 0) | (np.arange(len(surface)) % 2 == 0))


def thick_smoke(view):
    """A scan without floor farther than 1.6 m, without anything above it from 100 to 260 deg, and
    without the lower half of what stands 20 deg to either side of that."""
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) % 360.0
    planar = np.linalg.norm(view.xyz[:, :2].astype(np.float64), axis=1)
    is_floor = view.xyz[:, 2] < -SENSOR_HEIGHT + 0.01
    gone = np.abs(azimuth - 180.0) < 80.0
    gone |= (np.abs(azimuth - 180.0) < 100.0) & (view.xyz[:, 2] < 0.3)
    return view.select(np.where(is_floor, planar < 1.6, ~gone))


def standing_in_smoke(view, heights):
    """A scan in thick smoke, and returns 2.5, 2.6, ... m away at heights over the floor [m] in
    column 450 of 0.4 deg: something that stands there, too scattered for a post."""
    azimuth = np.radians(180.2)
    planar = 2.5 + 0.1 * np.arange(len(heights))
    z = np.array(heights) - SENSOR_HEIGHT
    stands = np.column_stack([planar * np.cos(azimuth), planar * np.sin(azimuth), z])
    return joined(thick_smoke(view), view_of(stands, 60.0, 20))


def smoke_ball(count, seed, radius=0.8):
    """Low-intensity returns thronging around the sensor."""
    rng = np.random.default_rng(seed)
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    distance = radius * (0.1 + 0.9 * rng.random(count))
    elevation = np.degrees(np.arcsin(direction[:, 2]))
    ring = np.abs(elevation[:, None] - ELEVATIONS_DEG).argmin(axis=1)
    return view_of(direction * distance[:, None], rng.integers(0, 31, count), ring)


def seeded_cloud(seed):
    """A smoky room with the oddities of real drivers, chosen by the seed.

    Reversed or interleaved rings, returns lost in smoke, a second return per pulse, repeated
    points, NaN, Inf and zero points, points on the vertical axis, shuffled order, a tilted sensor.
    """
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(1.5, 5.0, 2)
    view, _ = box_room((x, y, -0.7 * x, -1.2 * y), range_noise=0.01, seed=seed)
    parts = [view, smoke_ball(1500, seed)]
    if seed % 4 == 1:  # dual return: each wall point again, a little nearer
        again = view.select(view.intensity > 50.0)
        parts.append(again._replace(xyz=again.xyz * np.float32(0.98)))
    if seed % 4 == 2:  # the same points twice
        parts.append(view.select(slice(0, len(view.xyz), 7)))
    parts.append(_oddities())
    view = joined(*parts)
    if seed % 3 == 1:  # ring 0 the highest
        view = view._replace(ring=(len(ELEVATIONS_DEG) - 1 - view.ring).astype(np.uint16))
    if seed % 3 == 2:  # no order at all
        view = view._replace(ring=rng.permutation(200).astype(np.uint16)[view.ring])
    keep = rng.random(len(view.xyz)) < rng.uniform(0.4, 1.0)
    view = view.select(keep)
    return view.select(rng.permutation(len(view.xyz))) if seed % 2 == 1 else view


def _oddities():
    nan, inf = np.nan, np.inf
    points = [
        (nan, 0, 0), (1, nan, 0), (0, 0, nan), (inf, 0, 0), (0, -inf, 1), (0, 0, 0), (-0.0, 0, 0),
        (0, 0, 1.5), (0, 0, -0.7), (0, 0, -0.7), (-2, 0, -0.5), (-2, -0.0, -0.5), (-2, 1e-7, -0.5),
        (-2, -1e-7, -0.5), (2, 1e-30, 0), (2, -1e-30, 0), (1e-6, 0, 0), (1000, 1000, 100),
    ]  # fmt: skip
    intensity = np.arange(len(points)) * 3.0
    intensity[-1] = np.nan
    return view_of(points, intensity, np.arange(len(points)) % 5)


def tilt(roll_deg, pitch_deg):
    """R_level_sensor of a sensor rolled about x, then pitched about y."""
    roll, pitch = np.radians([roll_deg, pitch_deg])
    about_x = [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    about_y = [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    return np.array(about_y) @ np.array(about_x)


def read_scan(path):
    """ScanView of a recorded scan (.npz with x y z intensity ring)."""
    with np.load(path) as arrays:
        xyz = np.stack([arrays["x"], arrays["y"], arrays["z"]], axis=1).astype(np.float32)
        return ScanView(
            xyz, arrays["intensity"].astype(np.float32), arrays["ring"].astype(np.uint16)
        )


def with_ramp(view):
    """A room's scan with a floor that rises from x = 1.5 by 1 in 8, and the returns on the ramp."""
    xyz = view.xyz.astype(np.float64)
    # Beams end where z = -0.7 + (x - 1.5) / 8.
    along = (-0.7 - 1.5 / 8.0) / (xyz[:, 2] - xyz[:, 0] / 8.0)
    ends = (along > 0.0) & (along < 1.0) & (along * xyz[:, 0] > 1.5)
    xyz[ends] *= along[ends, None]
    return view._replace(xyz=xyz.astype(np.float32)), ends


def ramp_in_smoke(noise, seed, denied=False):
    """That room when smoke hides the ramp and the wall at its end; if denied, without the ramp but
    with its walls cut off as if there were one."""
    walls, elevations = (5.0, 2.0, -3.4, -2.0), np.linspace(-45.0, 40.0, 256)
    level = box_room(walls, 1.9, -0.7, elevations, 0.4, noise, seed)[0]
    view, on_ramp = with_ramp(level)
    x, y, z = level.xyz.T
    is_floor = z < -0.65
    keep = ~on_ramp | (is_floor & (x < 2.8) if denied else np.zeros(len(x), bool))
    keep &= (np.abs(y) > 0.5 * x) | (is_floor & (x < (2.8 if denied else 1.4)))
    return (level if denied else view).select(keep)
