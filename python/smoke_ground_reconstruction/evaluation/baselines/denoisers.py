"""Denoisers to compare with. Each takes a scan and says which points it keeps.

All of them: xyz (N, 3) finite coordinates in the sensor frame [m], intensity (N,) on the sensor's
scale, ring (N,); returns keep, (N,) bool, in input order. ROR and SOR are PCL's own filters.
"""

import numpy as np
from scipy.spatial import cKDTree

from smoke_ground_reconstruction.evaluation.baselines.native import native


def intensity_threshold(xyz, intensity, ring, threshold=25.0):
    """Keep points of at least the threshold's intensity (thesis Section 2.2.2, Figure 2.3a)."""
    return np.asarray(intensity) >= threshold


def agdor(xyz, intensity, ring, **parameters):
    """The package's own AGDOR (thesis Algorithm 1), with Table A.1's parameters unless changed.

    Args:
        parameters: fields of params.AgdorParams.

    Raises:
        ValueError: a bad parameter.
    """
    from smoke_ground_reconstruction._core import AgdorFilter, AgdorParams
    from smoke_ground_reconstruction.reference.label import Label

    compiled = AgdorParams()
    for name, value in parameters.items():
        if not hasattr(compiled, name):
            raise ValueError(f"AGDOR has no parameter '{name}'")
        setattr(compiled, name, value)
    intensity = np.ascontiguousarray(intensity, dtype=np.float32)
    return AgdorFilter(compiled).classify(_points(xyz), intensity) == Label.KEPT


def ror(xyz, intensity, ring, radius=0.1, min_neighbors=5):
    """Radius outlier removal: keep points with min_neighbors others within the radius [m].

    PCL's RadiusOutlierRemoval. No radius is published for indoor scans; the default is ours.
    """
    return native().radius_outlier_removal(_points(xyz), radius, min_neighbors)


def sor(xyz, intensity, ring, mean_k=50, std_mul=1.0):
    """Statistical outlier removal: mean distance to mean_k neighbours at most mean + std_mul sigma.

    PCL's StatisticalOutlierRemoval with the parameters of its tutorial.
    """
    return native().statistical_outlier_removal(_points(xyz), mean_k, std_mul)


def dror(
    xyz,
    intensity,
    ring,
    multiplier=3.0,
    azimuth_resolution_deg=0.4,
    min_neighbors=3,
    min_radius=0.04,
):
    """Dynamic radius outlier removal: the radius grows with the planar range.

    Keep points with min_neighbors points, the point itself counted, within
    max(min_radius, multiplier * 2 * planar_range * sin(azimuth_resolution)) [m].
    Source: Charron, Phillips, Waslander, CRV 2018, as its authors' program has it; the azimuth
    resolution is the sensor's.
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    planar_range = np.sqrt(xyz[:, 0] ** 2 + xyz[:, 1] ** 2)
    radius = multiplier * 2.0 * planar_range * np.sin(np.deg2rad(azimuth_resolution_deg))
    return _has_neighbors(xyz, np.maximum(radius, min_radius), min_neighbors - 1)


def dsor(xyz, intensity, ring, mean_k=5, std_mul=0.01, range_mul=0.05):
    """Dynamic statistical outlier removal: SOR's threshold times range_mul times the range.

    Keep points whose mean distance to their mean_k - 1 nearest others is below
    (mean + std_mul * sigma) * range_mul * range. The printed range_mul belongs to ranges of tens of
    metres. Source: Kurup and Bos, arXiv 2109.07078.
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    if len(xyz) < mean_k:
        return np.zeros(len(xyz), dtype=bool)
    distances, _ = cKDTree(xyz).query(xyz, k=mean_k)
    mean_distance = distances[:, 1:].mean(axis=1)
    threshold = mean_distance.mean() + std_mul * mean_distance.std(ddof=1)
    return mean_distance < threshold * range_mul * np.linalg.norm(xyz, axis=1)


def lior(xyz, intensity, ring, threshold=25.0, radius=0.1, min_neighbors=3, max_range=71.235):
    """Low-intensity outlier removal: faint points stay only where others are near.

    A point nearer than max_range [m] and of lower intensity than the threshold is removed unless it
    has min_neighbors others within the radius [m]. Source: Park, Kim, Kim, IEEE Access 8, 2020; the
    intensity scale is the sensor's.
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    suspect = (np.asarray(intensity) < threshold) & (np.linalg.norm(xyz, axis=1) < max_range)
    keep = ~suspect
    keep[suspect] = _has_neighbors(xyz, radius, min_neighbors, of=suspect)
    return keep


def aori_like(
    xyz,
    intensity,
    ring,
    threshold=25.0,
    azimuth_resolution_deg=0.4,
    margin=0.02,
    half_columns=4,
    half_rings=1,
    min_neighbors=4,
):
    """Adaptive kernel on the range image, in the manner of AORI.

    A faint point is kept if min_neighbors cells of the kernel around it, 2 half_rings + 1 rings by
    2 half_columns + 1 columns, hold a range within margin times its own. Where several returns
    share a cell the nearest stands for it. The paper gives no listing (Le, Cheng, Liu, Electronics
    2023, 12, 2150), so the likeness ends there.
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    ranges = np.linalg.norm(xyz, axis=1)
    rows, columns = _image_cells(xyz, ring, azimuth_resolution_deg)
    image = _range_image(rows, columns, ranges, azimuth_resolution_deg)
    count = np.zeros(len(xyz), dtype=np.int64)
    for row_step in range(-half_rings, half_rings + 1):
        row = rows + row_step
        exists = (row >= 0) & (row < image.shape[0])
        for column_step in range(-half_columns, half_columns + 1):
            if row_step or column_step:
                near = image[row * exists, (columns + column_step) % image.shape[1]]
                count += exists & (np.abs(near - ranges) <= margin * ranges)
    return (np.asarray(intensity) >= threshold) | (count >= min_neighbors)


def _points(xyz):
    return np.ascontiguousarray(xyz, dtype=np.float32)


def _has_neighbors(xyz, radius, min_neighbors, of=None):
    """Which points of xyz[of] have min_neighbors others of xyz within their radius."""
    queries = xyz if of is None else xyz[of]
    if len(queries) == 0 or len(xyz) <= min_neighbors:
        return np.zeros(len(queries), dtype=bool)
    # The k-th neighbour's distance decides as counting would; the point itself is the first.
    distances, _ = cKDTree(xyz).query(queries, k=[min_neighbors + 1])
    return distances[:, 0] <= radius


def _image_cells(xyz, ring, azimuth_resolution_deg):
    """Row (by median elevation of the ring) and column (by azimuth) of each point."""
    ring = np.asarray(ring, dtype=np.int64)
    planar = np.sqrt(xyz[:, 0] ** 2 + xyz[:, 1] ** 2)
    tangent = xyz[:, 2] / np.maximum(planar, 1e-9)
    names, place = np.unique(ring, return_inverse=True)
    median = np.array([np.median(tangent[place == i]) for i in range(len(names))])
    rank = np.empty(len(names), dtype=np.int64)
    rank[np.argsort(median, kind="stable")] = np.arange(len(names))
    azimuth = np.rad2deg(np.arctan2(xyz[:, 1], xyz[:, 0])) % 360.0
    columns = np.floor(azimuth / azimuth_resolution_deg).astype(np.int64)
    return rank[place], columns % _column_count(azimuth_resolution_deg)


def _column_count(azimuth_resolution_deg):
    return int(round(360.0 / azimuth_resolution_deg))


def _range_image(rows, columns, ranges, azimuth_resolution_deg):
    height = int(rows.max()) + 1 if len(rows) else 0
    image = np.full((height, _column_count(azimuth_resolution_deg)), np.inf)
    np.minimum.at(image, (rows, columns), ranges)
    return image
