"""Ground segmentations to compare with. Each takes a scan and says which points are ground.

All of them: xyz (N, 3) finite coordinates in the sensor frame [m], taken as level, intensity (N,),
sensor_height above the floor [m]; return ground, (N,) bool, in input order. The channel-based
method, with and without the thesis's feature, is a stage of the pipeline and not here.
"""

import contextlib
import os
import sys

import numpy as np

from smoke_ground_reconstruction.evaluation.baselines.native import (
    BaselineUnavailableError,
    native,
)


def ransac_plane(xyz, intensity, sensor_height, distance=0.05, iterations=500):
    """Points within `distance` [m] of the plane that most points agree on, whatever plane that is.

    PCL's SACSegmentation. The thesis found that in the whole cloud such a plane need not be the
    floor (Section 2.3.2).
    """
    xyz = np.ascontiguousarray(xyz, dtype=np.float32)
    return native().ransac_plane(xyz, distance, iterations)[1]


def ransac_plane_low(xyz, intensity, sensor_height, distance=0.05, iterations=500):
    """ransac_plane among the points below half the sensor's height, as the thesis did."""
    low = np.asarray(xyz)[:, 2] < -0.5 * sensor_height
    ground = np.zeros(len(low), dtype=bool)
    ground[low] = ransac_plane(np.asarray(xyz)[low], None, sensor_height, distance, iterations)
    return ground


def patchworkpp(xyz, intensity, sensor_height, min_range=0.3, max_range=20.0):
    """Patchwork++ (Lee, Lim, Myung, IROS 2022) through the PyPI package pypatchworkpp.

    Its shipped parameters are a car's (sensor 1.723 m up, nothing nearer than 2.7 m); here the
    height is the scan's and the ranges are a room's.

    Raises:
        BaselineUnavailableError: the package is not installed.
    """
    pypatchworkpp = require_patchworkpp()
    parameters = pypatchworkpp.Parameters()
    parameters.sensor_height = float(sensor_height)
    parameters.min_range = float(min_range)
    parameters.max_range = float(max_range)
    with _stdout_to_stderr():  # it greets on standard output, where others expect data
        estimator = pypatchworkpp.patchworkpp(parameters)
    cloud = np.column_stack([np.asarray(xyz), np.asarray(intensity) / 255.0]).astype(np.float32)
    estimator.estimateGround(cloud)
    ground = np.zeros(len(cloud), dtype=bool)
    ground[np.asarray(estimator.getGroundIndices(), dtype=np.int64).ravel()] = True
    return ground


@contextlib.contextmanager
def _stdout_to_stderr():
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)


def require_patchworkpp():
    """The module pypatchworkpp.

    Raises:
        BaselineUnavailableError: it is not installed.
    """
    try:
        import pypatchworkpp
    except ImportError as error:
        raise BaselineUnavailableError(
            "Patchwork++ is not installed: pip install pypatchworkpp"
        ) from error
    return pypatchworkpp
