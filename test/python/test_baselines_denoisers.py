"""Each denoising baseline on clouds small enough to count by hand."""

import numpy as np
import pytest

from smoke_ground_reconstruction.evaluation.baselines import denoisers
from smoke_ground_reconstruction.evaluation.baselines.native import (
    BaselineUnavailableError,
    native,
)


def have_native():
    try:
        native()
    except BaselineUnavailableError:
        return False
    return True


needs_pcl = pytest.mark.skipif(not have_native(), reason="built without PCL")


def line(count, spacing, start):
    """Points along y from `start`, `spacing` metres apart."""
    xyz = np.tile(np.asarray(start, dtype=np.float32), (count, 1))
    xyz[:, 1] += np.arange(count, dtype=np.float32) * np.float32(spacing)
    return xyz


def faint(xyz):
    return np.zeros(len(xyz), dtype=np.float32), np.zeros(len(xyz), dtype=np.uint16)


def test_intensity_threshold_keeps_the_threshold_itself():
    intensity = np.array([24.9, 25.0, 25.1])
    keep = denoisers.intensity_threshold(np.zeros((3, 3)), intensity, None, threshold=25.0)
    assert keep.tolist() == [False, True, True]


@needs_pcl
def test_ror_counts_neighbours_within_the_radius():
    """Five points 4 cm apart: the ends have two others within 10 cm, the middle four."""
    xyz = line(5, 0.04, (2, 0, 0))
    keep = denoisers.ror(xyz, *faint(xyz), radius=0.1, min_neighbors=3)
    assert keep.tolist() == [False, True, True, True, False]


@needs_pcl
def test_sor_removes_the_lone_point():
    xyz = np.vstack([line(30, 0.02, (2, 0, 0)), [[5, 5, 0]]]).astype(np.float32)
    keep = denoisers.sor(xyz, *faint(xyz), mean_k=5, std_mul=1.0)
    assert keep.tolist() == [True] * 30 + [False]


@needs_pcl
@pytest.mark.parametrize("name", ["ror", "sor"])
def test_pcl_filters_take_an_empty_cloud(name):
    xyz = np.zeros((0, 3), dtype=np.float32)
    assert getattr(denoisers, name)(xyz, *faint(xyz)).shape == (0,)


@needs_pcl
def test_pcl_filters_refuse_a_radius_that_is_not_positive():
    with pytest.raises(ValueError, match="radius must be positive, not -1"):
        denoisers.ror(np.zeros((3, 3)), None, None, radius=-1.0)


def test_dror_radius_grows_with_planar_range():
    """Three points 10 cm apart. At 6 m the radius is 6 * 6 * sin 0.4 deg = 0.25 m: all see three
    points (themselves counted). At 1 m it is 4.2 cm: they see themselves alone."""
    far, near = line(3, 0.1, (6, 0, 0)), line(3, 0.1, (1, 0, 0))
    xyz = np.vstack([far, near])
    keep = denoisers.dror(xyz, *faint(xyz))
    assert keep.tolist() == [True] * 3 + [False] * 3


def test_dror_floor_of_the_radius_saves_dense_near_points():
    """The floor of 4 cm is what lets smoke near the sensor pass."""
    xyz = line(3, 0.015, (0.3, 0, 0))
    assert denoisers.dror(xyz, *faint(xyz)).all()
    assert not denoisers.dror(xyz, *faint(xyz), min_radius=0.0).any()


def test_dsor_threshold_grows_with_range():
    """Two equal lines: every mean distance is about the mean, so range_mul * range decides."""
    xyz = np.vstack([line(20, 0.02, (1, 0, 0)), line(20, 0.02, (4, 0, 0))])
    keep = denoisers.dsor(xyz, *faint(xyz), mean_k=3, range_mul=0.5)
    assert not keep[:20].any()
    assert keep[20:].all()


def test_dsor_of_too_few_points_keeps_none():
    xyz = line(3, 0.1, (1, 0, 0))
    assert not denoisers.dsor(xyz, *faint(xyz), mean_k=5).any()


def test_lior_saves_faint_points_in_company():
    """Bright and lonely, faint and lonely, four faint ones together, faint beyond max_range."""
    together = line(4, 0.02, (3, 0, 0))
    xyz = np.vstack([[[5, 0, 0], [6, 0, 0]], together, [[90, 0, 0]]])
    intensity = np.array([80.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0])
    keep = denoisers.lior(xyz, intensity, None, radius=0.1, min_neighbors=3)
    assert keep.tolist() == [True, False, True, True, True, True, True]


def kernel_cloud(middle_range):
    """Three rings by five columns at 2 m, the middle point at its own range, all faint."""
    points, ring = [], []
    for name, elevation in ((7, -0.2), (3, -0.21), (5, -0.22)):  # ring numbers out of order
        for column in range(5):
            azimuth = np.deg2rad(10.2 + 0.4 * column)
            distance = middle_range if (name, column) == (3, 2) else 2.0
            direction = [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
            points.append(distance * np.array(direction))
            ring.append(name)
    return np.array(points), np.array(ring)


def test_aori_kernel_keeps_a_surface_and_drops_what_floats_before_it():
    xyz, ring = kernel_cloud(middle_range=1.5)
    keep = denoisers.aori_like(xyz, np.zeros(15), ring, half_columns=2, min_neighbors=4)
    assert not keep[7]
    assert keep.sum() == 14
    xyz, ring = kernel_cloud(middle_range=2.0)
    assert denoisers.aori_like(xyz, np.zeros(15), ring, half_columns=2, min_neighbors=4).all()


def test_aori_kernel_counts_rings_in_order_of_elevation():
    """The corner of the middle ring (number 3) has 8 cells in a kernel of 3 x 5 around it."""
    xyz, ring = kernel_cloud(middle_range=2.0)
    keep = denoisers.aori_like(xyz, np.zeros(15), ring, half_columns=2, min_neighbors=8)
    assert keep[5]  # middle elevation, first column: 3 x 3 cells less itself
    assert not keep[0]  # upper ring, first column: 2 x 3 cells less itself


def test_aori_kernel_wraps_at_the_ends_of_the_image():
    azimuth = np.deg2rad([359.9, 0.1, 0.5])
    xyz = 2.0 * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(3)], axis=1)
    keep = denoisers.aori_like(
        xyz, np.zeros(3), np.zeros(3, int), half_columns=1, half_rings=0, min_neighbors=1
    )
    assert keep.all()


@needs_pcl
def test_agdor_is_the_packages_own_with_its_parameters():
    """Three faint points together and one alone, 3 m away: radius 0.2 * 3 m."""
    xyz = np.vstack([line(3, 0.1, (3, 0, 0)), [[-3, 0, 0]]])
    keep = denoisers.agdor(xyz, np.zeros(4), None, min_neighbors=1)
    assert keep.tolist() == [True, True, True, False]
    with pytest.raises(ValueError, match="AGDOR has no parameter 'radius'"):
        denoisers.agdor(xyz, np.zeros(4), None, radius=0.1)
