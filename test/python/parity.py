"""What "the same answer" means between the compiled core and the reference."""

import numpy as np

from smoke_ground_reconstruction.pipeline import compiled_params


def compiled_group(params, path):
    """One group of the compiled parameters, e.g. ``segmenter.clustering``."""
    group = compiled_params(params)
    for name in path.split("."):
        group = getattr(group, name)
    return group


def compiled_mounting(core, mounting):
    """The compiled module's Mounting."""
    return core.Mounting(mounting.rotation.ravel().tolist(), mounting.sensor_height)


def as_partition(clusters):
    """Clusters without their numbering: for each point the smallest index of its cluster."""
    _, first, inverse = np.unique(clusters, return_index=True, return_inverse=True)
    return first[inverse]


def assert_same_surface(actual, expected):
    """Same points in the same order, coordinates within 1e-5 m; everything else equal."""
    assert actual.xyz.shape == expected.xyz.shape
    close = {"rtol": 1e-5, "atol": 1e-5}
    np.testing.assert_allclose(actual.xyz, expected.xyz, **close)
    np.testing.assert_array_equal(actual.intensity, expected.intensity)
    np.testing.assert_array_equal(actual.ring, expected.ring)
    np.testing.assert_array_equal(actual.provenance, expected.provenance)
    np.testing.assert_allclose(actual.confidence, expected.confidence, **close)
    np.testing.assert_allclose(actual.boundary, expected.boundary, **close)
    np.testing.assert_array_equal(actual.boundary_kind, expected.boundary_kind)
    np.testing.assert_allclose(actual.floor_plane, expected.floor_plane, **close)


def assert_same_grid(actual, expected):
    """Equal cells at equal places."""
    assert actual.resolution == expected.resolution
    np.testing.assert_array_equal(actual.cells, expected.cells)
    corner = (expected.first_column, expected.first_row)
    assert (actual.first_column, actual.first_row) == corner
