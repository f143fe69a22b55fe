"""Run methods over scenes, smoke levels and seeds, on several processes."""

import multiprocessing
import warnings
from dataclasses import dataclass
from itertools import product
from typing import Tuple

from smoke_ground_reconstruction.evaluation import world
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.scoring import score_output


@dataclass(frozen=True)
class Plan:
    """What is to be run.

    Attributes:
        methods, scenes, levels: names.
        seeds: number of seeds, counted from 0.
        poses: "main", or "all" of a scene's poses.
        sensor: name of the sensor.
        cells: edges of the cells [m].
    """

    methods: Tuple[str, ...]
    scenes: Tuple[str, ...]
    levels: Tuple[str, ...]
    seeds: int = 10
    poses: str = "main"
    sensor: str = "qt128"
    cells: Tuple[float, ...] = (0.2, 0.1)

    def jobs(self):
        """One Job a scan, in the order of the results."""
        return [
            Job(scene, pose, level, seed, self)
            for scene in self.scenes
            for pose, level, seed in product(
                world.poses(scene, self.poses), self.levels, range(self.seeds)
            )
        ]


@dataclass(frozen=True)
class Job:
    """One scan and the methods to run on it."""

    scene: str
    pose: str
    level: str
    seed: int
    plan: Plan

    def describe(self):
        """The scan by names, as every record carries it."""
        return {
            "scene": self.scene,
            "pose": self.pose,
            "level": self.level,
            "seed": self.seed,
            "bounded": world.is_bounded(self.scene),
        }


def run_job(job):
    """Simulate one scan and score every method on it: a list of records, one a method."""
    scan = world.scan(job.scene, job.plan.sensor, job.pose, job.level, job.seed)
    truths = {
        cell: world.truth(job.scene, job.plan.sensor, job.pose, cell, job.level, job.seed)
        for cell in job.plan.cells
    }
    return [run_method(name, job.describe(), scan, truths) for name in job.plan.methods]


def run_method(name, description, scan, truths):
    """One record: the description, the method, the number of points, and scores or an error.

    A method that refuses a scan is recorded with its reason, so that one refusal does not end a
    long run.
    """
    record = dict(description, method=name, points=len(scan))
    try:
        output = method(name).run(scan)
    except ValueError as error:
        return dict(record, error=str(error))
    return dict(record, scores=score_output(output, scan, truths))


def run(plan, processes=1, progress=iter):
    """Run a plan.

    Args:
        plan: Plan.
        processes: worker processes; 1 works in this one.
        progress: wraps the iterator over jobs, to show how far it is.

    Returns:
        Records in the order of plan.jobs() and, within a scan, of plan.methods; the same whatever
        the number of processes.
    """
    jobs = plan.jobs()
    if processes == 1:
        return [record for records in progress(map(run_job, jobs)) for record in records]
    # A chunk is one scene and level, so that no two processes calibrate the same smoke.
    context = multiprocessing.get_context("fork")
    with context.Pool(processes) as pool:
        found = progress(pool.imap(run_job, jobs, chunksize=plan.seeds))
        return [record for records in found for record in records]


def available(names):
    """Leave out methods that cannot run here, with a warning each.

    Args:
        names: methods.

    Returns:
        Those that can run, in order.

    Raises:
        ValueError: a name is unknown.
    """
    usable = []
    for name in names:
        try:
            method(name).require()
            usable.append(name)
        except BaselineUnavailableError as error:
            warnings.warn(f"left out {name}: {error}", stacklevel=2)
    return tuple(usable)
