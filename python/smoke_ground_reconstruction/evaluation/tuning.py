"""Find the parameters under which polar_segments does its best on the basic room.

Coordinate descent: one parameter after the other takes each value of its list, and the best one
stays if it gains more than MARGIN in the mean IoU (0.2 m cells) over five positions in heavy smoke.
The seeds are none of those that the evaluation uses, and no other room is looked at.
"""

import copy
import multiprocessing

import yaml

from smoke_ground_reconstruction.evaluation import figures, world
from smoke_ground_reconstruction.evaluation.methods import POLAR_SEGMENTS
from smoke_ground_reconstruction.evaluation.yardstick import score_floor
from smoke_ground_reconstruction.params import Params
from smoke_ground_reconstruction.pipeline import Pipeline

SEEDS = (1000, 1001)
LEVEL = "heavy"
CELL = 0.2
MARGIN = 0.001
PASSES = 2

CHOICES = [
    ("segmenter", {"max_cluster_size": [5000, 0]}),
    ("segmenter", {"cluster_tolerance": [0.05, 0.1, 0.2, 0.3]}),
    ("segmenter", {"min_cluster_size": [20, 50, 100, 200]}),
    ("reconstructor", {"wall_distance": ["range", "planar_range"]}),
    ("reconstructor", {"segment_angle_deg": [10.0, 5.0, 4.0, 2.0, 1.2]}),
    ("reconstructor", {"min_wall_points": [1, 3, 5, 10, 20]}),
    ("reconstructor", {"reconstruction_gain": [0.05, 0.15, 0.3, 0.5, 1.0]}),
    ("denoiser", {"min_neighbors": [50, 100, 200, 400, 800]}),
    ("denoiser", {"alpha": [0.125, 0.25, 0.5]}),
    ("denoiser", {"intensity_threshold": [0.0, 5.0, 10.0, 25.0]}),
    (
        "segmenter",
        {
            "min_wall_angle_deg": [45.0, 60.0, 70.0, 75.0],
            "max_wall_angle_deg": [135.0, 120.0, 110.0, 105.0],
        },
    ),
    ("segmenter", {"wall_relative_margin": [True, False]}),
    (
        "segmenter",
        {
            "min_ground_angle_deg": [-3.0, -6.0, -10.0, -15.0],
            "max_ground_angle_deg": [3.0, 6.0, 10.0, 15.0],
        },
    ),
    ("segmenter", {"ground_range_step": ["minimum", "increasing"]}),
    ("segmenter", {"min_range_step": [0.01, 0.03, 0.06]}),
    ("segmenter", {"max_ground_step_height": [0.02, 0.05, 0.1]}),
    ("reconstructor", {"height_difference_threshold": [0.02, 0.05, 0.1]}),
    ("reconstructor", {"max_elevation_angle_deg": [1.0, 2.0, 5.0]}),
]
"""Group, and the parameters that change together with their values side by side."""


def tune(processes=2, say=print):
    """Run the search from the printed defaults.

    Args:
        processes: worker processes; they do not change the answer.
        say: called with a line for each gain.

    Returns:
        The changes to the defaults ({group: {parameter: value}}), the IoU before and after.
    """
    scans = [(pose, seed) for pose in world.poses(figures.BASIC) for seed in SEEDS]
    with multiprocessing.get_context("fork").Pool(processes) as pool:

        def iou(changes):
            found = pool.map(_iou, [(pose, seed, changes) for pose, seed in scans], chunksize=1)
            return sum(found) / len(found)

        changes = copy.deepcopy(POLAR_SEGMENTS)
        before = best = iou(changes)
        say(f"printed defaults: IoU {before:.4f}")
        for _ in range(PASSES):
            start = best
            for group, values in CHOICES:
                changes, best = _improve(changes, best, group, values, iou, say)
            if best == start:
                break
    return changes, before, best


def _improve(changes, best, group, values, iou, say):
    kept = changes
    for setting in zip(*values.values()):
        chosen = dict(zip(values, setting))
        trial = copy.deepcopy(kept)
        trial.setdefault(group, {}).update(chosen)
        reached = iou(trial)
        if reached > best + MARGIN:
            changes, best = trial, reached
            text = ", ".join(f"{name} {value}" for name, value in chosen.items())
            say(f"{text}: IoU {best:.4f}")
    return changes, best


def _iou(task):
    pose, seed, changes = task
    scan = world.scan(figures.BASIC, "qt128", pose, LEVEL, seed)
    truth = world.truth(figures.BASIC, "qt128", pose, CELL, LEVEL, seed)
    pipeline = Pipeline(Params.from_dict(changes), elevation_deg=scan.elevation_deg)
    found = pipeline.process(scan.xyz, scan.intensity, scan.ring, sensor_height=scan.sensor_height)
    return score_floor(scan.to_level(found.surface), truth).counts.iou


def write(path, changes, before, after):
    """Write the parameters that differ from the printed defaults, and how they were found."""
    header = (
        "# polar_segments with the parameters under which it does its best on the basic room;\n"
        "# what is not named here keeps its printed default. Found by `smoke_ground tune`:\n"
        f"# coordinate descent on the mean IoU ({CELL} m cells) over the room's five positions in\n"
        f"# {LEVEL} smoke, seeds {SEEDS[0]} and {SEEDS[1]}. Mean IoU {before:.3f} with the printed"
        f" defaults,\n# {after:.3f} with these. Tuned there once and nowhere else.\n"
    )
    with open(path, "w", encoding="utf-8") as file:
        file.write(header)
        yaml.safe_dump(changes, file, default_flow_style=False, sort_keys=False)
