"""Times the running nodelets from within their manager, and sums up what was seen."""

import contextlib
import json
import subprocess
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
import rosbag
import rospy
from std_msgs.msg import String

from smoke_ground_reconstruction.console import CommandError
from smoke_ground_reconstruction.io.bag import NAMESPACE, Scans
from smoke_ground_reconstruction.replay import running

PROBE = "/latency_probe"
CLOUD = f"{PROBE}/cloud"

LISTENER = "reconstructor -> listener"

_STAGES = ("denoiser", "segmenter", "reconstructor")
_MOST_SCANS = 10  # prepared in memory and played in turn
_PATIENCE = 120.0  # beyond the time of the scans themselves [s]


class Hops(NamedTuple):
    """Where the time between the driver's publish and the floor goes; (N,) [ms] each, by name.

    Attributes
    ----------
    parts : from hand to hand, and at work, in the order of the way
    whole : from the driver's publish to that of the floor
    added : of it, what three nodelets do and one Pipeline does not: from hand to hand, laying the
        scan out again, writing clouds for each other and for the listener
    pipeline : a Pipeline's time for the same scans; empty where it was not measured
    """

    parts: Dict[str, np.ndarray]
    whole: np.ndarray
    added: np.ndarray
    pipeline: np.ndarray


class Load(NamedTuple):
    """How the chain bore scans at a rate.

    Attributes
    ----------
    played : scans
    dropped : those of which no floor came
    twice : those of which more than one floor came
    latency : from the driver's publish to the floor, of those that came (N,) [ms]
    cores : processor's time per time
    resident_mb : memory of the manager, each second
    """

    played: int
    dropped: int
    twice: int
    latency: np.ndarray
    cores: float
    resident_mb: np.ndarray


def probe(scans: List[str], plan: Dict[str, Any]) -> dict:
    """Plays scans to running nodelets from within their manager, for a process that has joined
    their master.

    Parameters
    ----------
    scans : files of one PointCloud2 each, as :func:`prepare` writes them; played in turn
    plan : `warm_up`, `compare`, `count` and `rate` of the nodelet LatencyProbe

    Returns
    -------
    dict : the nodelet's log, see LatencyLog::json()

    Raises
    ------
    CommandError : the chain gave no floors, or the probe no answer.
    """
    rospy.set_param(PROBE, {**plan, "chain": NAMESPACE, "scans": scans})
    command = ["rosrun", "nodelet", "nodelet", "load", "smoke_ground_reconstruction/LatencyProbe"]
    command += [f"{NAMESPACE}/manager", f"__name:={PROBE[1:]}"]
    patience = _PATIENCE + (plan["count"] / plan["rate"]) + plan["compare"]
    with running(command, subprocess.DEVNULL):
        try:
            answer = rospy.wait_for_message(f"{PROBE}/result", String, timeout=patience)
        except rospy.ROSException:
            raise CommandError(f"the probe did not answer in {patience:.0f} s") from None
    log = json.loads(answer.data)
    if "error" in log:
        raise CommandError(log["error"])
    return log


def prepare(scans: Scans, work: Path) -> List[str]:
    """The first messages of a bag as they are on the wire, a file each in the directory `work`."""
    paths = []
    with contextlib.closing(rosbag.Bag(scans.path)) as bag:
        for _, raw, _ in bag.read_messages(topics=[scans.topic], raw=True):
            paths.append(str(work / f"{len(paths)}.msg"))
            Path(paths[-1]).write_bytes(raw[1])
            if len(paths) == _MOST_SCANS:
                break
    return paths


def hops(log: dict) -> Hops:
    """The way of the scans that a Pipeline got as well, or of all that were played at a rate.

    Parameters
    ----------
    log : of :func:`probe`
    """
    compared = [scan for scan in log["scans"] if scan["pipeline_ms"] > 0.0]
    stages = {entry["stage"]: {t["seq"]: t for t in entry["scans"]} for entry in log["stages"]}
    names = [name for name in _STAGES if name in stages]
    ways, work, pipeline = [], [], []
    for scan in compared or log["scans"]:
        timings = [(name, stages[name].get(scan["seq"])) for name in names]
        if scan["arrived"] and all(timing for _, timing in timings):
            ways.append(_way(scan, timings))
            work.append(_work_of_a_pipeline([timing for _, timing in timings]))
            pipeline.append(scan["pipeline_ms"])
    if not ways:
        raise CommandError("no scan was seen on its whole way")
    parts = {name: np.array([way[name] for way in ways]) for name in ways[0]}
    whole = sum(times for name, times in parts.items() if name != LISTENER)
    return Hops(parts, whole, whole - work, np.array(pipeline if compared else []))


def _way(scan: dict, timings: Sequence[Tuple[str, dict]]) -> Dict[str, float]:
    """From the driver's publish to the floor's listener [ms]."""
    way, last, before = {}, scan["sent"], "driver"
    for name, timing in timings:
        way[f"{before} -> {name}"] = (timing["begun"] - last) * 1e-6
        last = max(timing["handed_over"])  # the next one needs all that is made
        way[name] = (last - timing["begun"]) * 1e-6
        before = name
    way[LISTENER] = (scan["arrived"] - last) * 1e-6
    return way


def _work_of_a_pipeline(timings: Sequence[dict]) -> float:
    """What the nodelets do of what a Pipeline does as well: lay out the scan once, and each step
    of the method [ms]."""
    once = 0.0
    for number, timing in enumerate(timings):
        for part, milliseconds in zip(timing["parts"], timing["milliseconds"]):
            if part != "publish" and (part != "organise" or number == 0):
                once += milliseconds
    return once


def load(log: dict, count: int) -> Load:
    """How the chain bore the last `count` scans, those at a rate."""
    scans = log["scans"][-count:]
    come = [scan for scan in scans if scan["arrived"]]
    first, last = log["process"][0], log["process"][-1]
    return Load(
        played=len(scans),
        dropped=len(scans) - len(come),
        twice=sum(scan["floors"] > 1 for scan in scans),
        latency=np.array([(scan["arrived"] - scan["sent"]) * 1e-6 for scan in come]),
        cores=(last["cpu_s"] - first["cpu_s"]) / ((last["time"] - first["time"]) * 1e-9),
        resident_mb=np.array([look["resident_mb"] for look in log["process"]]),
    )
