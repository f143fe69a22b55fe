"""Each ground baseline on rooms whose floor is known."""

import numpy as np
import pytest

from smoke_ground_reconstruction.evaluation.baselines import ground
from test_baselines_denoisers import needs_pcl


def room(floor_half=2.0, spacing=0.1):
    """A square floor 0.7 m below the sensor and one wall up to 1.8 m above it."""
    side = np.arange(-floor_half, floor_half + 1e-9, spacing)
    x, y = [grid.ravel() for grid in np.meshgrid(side, side)]
    floor = np.stack([x, y, np.full(x.shape, -0.7)], axis=1)
    y, z = [grid.ravel() for grid in np.meshgrid(side, np.arange(-0.6, 1.8, spacing))]
    wall = np.stack([np.full(y.shape, floor_half), y, z], axis=1)
    xyz = np.vstack([floor, wall]).astype(np.float32)
    return xyz, np.arange(len(xyz)) < len(floor)


@needs_pcl
def test_ransac_finds_the_floor_where_it_is_the_largest_plane():
    xyz, is_floor = room()
    found = ground.ransac_plane(xyz, None, 0.7, distance=0.02)
    assert found[is_floor].all()
    assert found[~is_floor].sum() == 0


@needs_pcl
def test_ransac_takes_the_ceiling_where_more_of_it_is_seen():
    """What the thesis met: the largest plane need not be the floor; below the sensor it is."""
    xyz, is_floor = room()
    ceiling = xyz[is_floor] * [1.5, 1.5, 0] + [0, 0, 1.8]
    denser = np.vstack([ceiling, ceiling + [0.05, 0, 0]]).astype(np.float32)
    cloud = np.vstack([xyz, denser])
    found = ground.ransac_plane(cloud, None, 0.7, distance=0.02)
    assert not found[: len(xyz)][is_floor].any()
    low = ground.ransac_plane_low(cloud, None, 0.7, distance=0.02)
    assert low[: len(xyz)][is_floor].all()
    assert not low[len(xyz) :].any()


@needs_pcl
def test_ransac_of_two_points_finds_nothing():
    assert not ground.ransac_plane(np.zeros((2, 3), dtype=np.float32), None, 0.7).any()


def test_patchworkpp_finds_an_open_floor():
    pytest.importorskip("pypatchworkpp", reason="pypatchworkpp is not installed")
    xyz, is_floor = room(floor_half=4.0)
    found = ground.patchworkpp(xyz, np.full(len(xyz), 50.0), 0.7)
    near = is_floor & (np.abs(xyz[:, :2]).max(axis=1) < 3.0)
    near &= np.linalg.norm(xyz[:, :2], axis=1) > 0.5
    assert found[near].mean() > 0.9
    assert found[~is_floor].mean() < 0.2
