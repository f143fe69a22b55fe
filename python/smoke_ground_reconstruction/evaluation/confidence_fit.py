"""Fit the weights of room_boundary's confidence: `smoke_ground calibrate`.

Logistic regression with a ridge, by damped Newton steps, on the claimed cells (0.1 m) of simulated
scans: all scenes and levels, seeds that no evaluation uses.
"""

import multiprocessing

import numpy as np

from smoke_ground_reconstruction.evaluation import world
from smoke_ground_reconstruction.evaluation.calibration import cell_confidence
from smoke_ground_reconstruction.reference import confidence
from smoke_ground_reconstruction.reference.room_boundary import RoomBoundary
from smoke_ground_reconstruction.reference.scan import Mounting, ScanView
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

SENSOR = "qt128"
FIRST_SEED = 1000
CELL = 0.1
RIDGE = 1.0  # cells that a weight of 1 is worth
_STEPS = 60
_EASY = 20  # of the cells that lie well within the floor one in so many is taken, with its weight


def fit(seeds, processes=2, progress=iter):
    """Weights (F,) float64 of confidence.FEATURES, and the number of cells and of wrong ones."""
    tasks = [
        (scene, level, FIRST_SEED + seed)
        for scene in world.scenes()
        for level in world.LEVELS
        for seed in range(seeds)
    ]
    with multiprocessing.get_context("fork").Pool(processes) as pool:
        parts = list(progress(pool.imap(_cells_of, tasks), len(tasks)))
    features, weight, floor = (np.concatenate(column) for column in zip(*parts))
    return logistic_weights(features, floor, weight), int(weight.sum()), int((~floor).sum())


def _cells_of(task):
    """Features (K, F), weight (K,) and truth (K,) of the claimed cells of one scan."""
    scene, level, seed = task
    pose = world.poses(scene, "main")[0]
    scan = world.scan(scene, SENSOR, pose, level, seed)
    sensor = SensorModel.from_elevations(scan.elevation_deg)
    view = ScanView(scan.xyz, scan.intensity, scan.ring)
    sensor.observe(view)
    found = RoomBoundary().reconstruct(view, sensor, Mounting(sensor_height=scan.sensor_height))
    features = np.vstack(
        [
            confidence.measured_features(found.room, found.claim),
            confidence.drawn_features(found.room, found.claim, found.drawn),
        ]
    )
    # The surest point of a cell is not known yet: the one farthest from the end of the floor.
    inward = -features[:, [confidence.FEATURES.index(name) for name in _RIMS]].sum(axis=1)
    truth = world.truth(scene, SENSOR, pose, CELL, level, seed)
    surest, _, floor = cell_confidence(scan.to_level(found.surface.xyz), inward, truth)
    easy = floor & (features[surest, confidence.FEATURES.index("rim_100")] == 0.0)
    kept = ~easy | (np.arange(len(easy)) % _EASY == 0)
    weight = np.where(easy, float(_EASY), 1.0)[kept]
    return features[surest[kept]].astype(np.float32), weight, floor[kept]


_RIMS = ("rim_20", "rim_100", "rim_500", "rim_2000")


def logistic_weights(features, right, weight):
    """Weights (F,) that make `right` (N,) bool most likely; `weight` (N,) counts each row."""
    features, right = np.asarray(features, np.float64), np.asarray(right, np.float64)
    ridge = np.full(features.shape[1], RIDGE)
    ridge[0] = 1e-6  # the constant
    found = np.zeros(features.shape[1])
    loss = _loss(features, right, weight, ridge, found)
    for _ in range(_STEPS):
        share = 1.0 / (1.0 + np.exp(-(features @ found)))
        gradient = features.T @ (weight * (right - share)) - ridge * found
        curve = (weight * share * (1.0 - share))[:, None] * features
        step = np.linalg.solve(features.T @ curve + np.diag(ridge), gradient)
        length, reached = 1.0, _loss(features, right, weight, ridge, found + step)
        while reached > loss and length > 1e-4:
            length *= 0.5
            reached = _loss(features, right, weight, ridge, found + length * step)
        found = found + length * step
        if loss - reached < 1e-9 * loss:
            break
        loss = reached
    return found


def _loss(features, right, weight, ridge, weights):
    logit = features @ weights
    fit = weight * (np.logaddexp(0.0, logit) - right * logit)
    return fit.sum() + 0.5 * (ridge * weights**2).sum()


def write(path, weights, cells, wrong, seeds):
    """Write the weights, one a line, with how they were found."""
    header = (
        "# Weights of room_boundary's confidence: the logit of the probability that there is\n"
        "# floor in a point's cell. Written by `smoke_ground calibrate`: ridge regression on the\n"
        f"# claimed {CELL} m cells of all scenes and smoke levels, sensor {SENSOR}, seeds\n"
        f"# {FIRST_SEED} to {FIRST_SEED + seeds - 1}:"
        f" {cells} cells, {wrong} of them wrong. What the names mean stands in the reference,\n"
        "# confidence.py; both engines read this file (the compiled one when it is built).\n"
    )
    lines = [f"{name}: {value:.4f}\n" for name, value in zip(confidence.FEATURES, weights)]
    path.write_text(header + "".join(lines), encoding="utf-8")
