"""The curves of the denoisers and the view of the pictures."""

import numpy as np
import pytest

pytest.importorskip("smoke_ground_reconstruction._core", reason="the package is not built")

from smoke_ground_reconstruction.evaluation import denoising_curves, drawing
from smoke_ground_reconstruction.evaluation.baselines import denoisers
from smoke_ground_reconstruction.evaluation.scan_input import ScanInput
from smoke_ground_reconstruction.evaluation.world import Truth


def cloud(seed=3, count=1500):
    """Faint points in a ball around (2, 0, 0): a dense half that is floor, a thin half of smoke."""
    random = np.random.default_rng(seed)
    dense = random.normal((2.0, 0.0, 0.0), 0.1, (count, 3))
    thin = random.normal((2.0, 0.0, 0.0), 0.8, (count, 3))
    return ScanInput(
        xyz=np.vstack([dense, thin]).astype(np.float32),
        intensity=np.full(2 * count, 5.0, dtype=np.float32),
        ring=np.zeros(2 * count, dtype=np.uint16),
        truth=np.repeat([Truth.FLOOR, Truth.SMOKE], count).astype(np.uint8),
        sensor_height=0.7,
        T_world_sensor=np.eye(4),
    )


@pytest.mark.parametrize("least", [5, 100, 500])
def test_curve_says_what_the_filter_does(least):
    """One count for all thresholds gives the points that AGDOR itself keeps at each of them."""
    scan = cloud()
    rows = denoising_curves.agdor_curves(scan)["AGDOR 0.2 r (printed alpha, theta in degrees)"]
    row = next(row for row in rows if row["parameter"] == least)
    kept = denoisers.agdor(
        scan.xyz, scan.intensity, scan.ring, min_neighbors=least, max_neighbors=0
    )
    assert row["floor_kept"] == pytest.approx(kept[:1500].mean())
    assert row["smoke_removed"] == pytest.approx(1.0 - kept[1500:].mean())


def test_two_readings_of_the_neighbour_test_are_complements():
    curves = denoising_curves.agdor_curves(cloud())
    dense = curves["AGDOR 0.2 r (printed alpha, theta in degrees)"]
    sparse = curves["AGDOR 0.2 r, sparse kept (the text's reading)"]
    for one, other in zip(dense, sparse):
        assert one["floor_kept"] + other["floor_kept"] == pytest.approx(1.0)


def test_view_is_from_above_with_z_up():
    """Seen from above, higher points are nearer and further up; x and y keep their handedness."""
    right, up, depth = drawing.oblique([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0]])
    assert up[1] > up[0]
    assert depth[1] > depth[0]
    assert right[2] * up[3] - right[3] * up[2] > 0
