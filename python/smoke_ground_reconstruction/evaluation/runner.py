"""Run methods over scenes, smoke levels and seeds, on several processes."""

import multiprocessing
import signal
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import groupby, product, zip_longest
from operator import attrgetter, itemgetter
from typing import Tuple

from smoke_ground_reconstruction.evaluation import world
from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError
from smoke_ground_reconstruction.evaluation.journal import record_key
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
            Job(scene, pose, level, seed, self, self.methods)
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
    methods: Tuple[str, ...]

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
    place = job.scene, job.plan.sensor, job.pose
    scan = world.scan(*place, job.level, job.seed)
    if job.level != "clear":
        scan = replace(scan, in_clear_air=world.clear_scan(*place))
    truths = {
        cell: world.truth(job.scene, job.plan.sensor, job.pose, cell, job.level, job.seed)
        for cell in job.plan.cells
    }
    extinction = world.extinction(*place, job.level)
    return [run_method(name, job.describe(), scan, truths, extinction) for name in job.methods]


def run_method(name, description, scan, truths, extinction=None):
    """One record: the description, the method, the number of points, and scores or an error.

    A method that refuses a scan is recorded with its reason, so that one refusal does not end a
    long run.
    """
    record = dict(description, method=name, points=len(scan))
    try:
        output = method(name).run(scan)
    except ValueError as error:
        return dict(record, error=str(error))
    return dict(record, scores=score_output(output, scan, truths, extinction))


def run(plan, processes=1, progress=lambda items, jobs: items, journal=None):
    """Run a plan.

    Args:
        plan: Plan.
        processes: worker processes; 1 works in this one.
        progress: wraps the iterator over jobs, to show how far it is; gets their number, too.
        journal: journal.Journal that gets every record as soon as it is there, and whose records
            of an earlier run are not made again.

    Returns:
        Records in the order of plan.jobs() and, within a scan, of plan.methods; the same whatever
        the number of processes.
    """
    kept = _Kept(plan, journal)
    jobs = list(kept.missing())
    with _workers(processes) as map_jobs:
        for records in progress(map_jobs(run_job, _spread(jobs, processes)), len(jobs)):
            kept.add(records)
    return kept.records()


class _Kept:
    """The records of a plan as they come in."""

    def __init__(self, plan, journal):
        self._plan, self._journal = plan, journal
        self._found = {}
        if journal is not None:
            earlier = journal.read()
            self._keys = {at: record_key(job, at[-1]) for job, at in self._wanted()}
            self._found = {at: earlier[key] for at, key in self._keys.items() if key in earlier}

    def _wanted(self):
        """Pairs of job and the place of a record, in order."""
        for job in self._plan.jobs():
            for name in self._plan.methods:
                yield job, (job.scene, job.pose, job.level, job.seed, name)

    def missing(self):
        """Jobs of which a record is missing, with the methods that are."""
        for job, wanted in groupby(self._wanted(), key=itemgetter(0)):
            names = tuple(at[-1] for _, at in wanted if at not in self._found)
            if names:
                yield replace(job, methods=names)

    def add(self, records):
        places = [tuple(record[name] for name in _PLACE) for record in records]
        self._found.update(zip(places, records))
        if self._journal is not None:
            self._journal.add((self._keys[at], record) for at, record in zip(places, records))

    def records(self):
        return [self._found[at] for _, at in self._wanted()]


_PLACE = ("scene", "pose", "level", "seed", "method")


def _spread(jobs, processes):
    """Order jobs so that processes side by side work on different scenes.

    What belongs to a scene (its smoke levels, its floor) is worked out once and then found in the
    cache; two processes at the same scene would both work it out.
    """
    rooms = [list(group) for _, group in groupby(jobs, key=attrgetter("scene", "pose"))]
    for first in range(0, len(rooms), processes):
        for turn in zip_longest(*rooms[first : first + processes]):
            yield from (job for job in turn if job is not None)


def _leave_signals():
    """In a worker: Ctrl-C reaches every process of a terminal, and only the first one answers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def _workers(processes):
    """Yields what maps a function over jobs, in any order; an interruption ends all workers."""
    if processes == 1:
        yield map
        return

    def stop(number, frame):
        signal.signal(number, signal.SIG_IGN)  # a second one would break off the clearing up
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)  # else the workers would be left behind
    try:
        with multiprocessing.get_context("fork").Pool(processes, _leave_signals) as pool:
            yield pool.imap_unordered
    finally:
        signal.signal(signal.SIGTERM, before)


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
