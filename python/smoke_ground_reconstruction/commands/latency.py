"""`smoke_ground latency`: what the way through the nodelets costs, and the rate they bear."""

import argparse
import json
import math
import tempfile
from pathlib import Path
from typing import Iterator, Sequence

import numpy as np

from smoke_ground_reconstruction.commands.options import add_pipeline, add_topic
from smoke_ground_reconstruction.commands.reconstruct import chosen_params
from smoke_ground_reconstruction.commands.replay import as_bag, launch_arguments
from smoke_ground_reconstruction.console import CommandError, note


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "latency",
        help="time the nodelets from the driver's publish to the floor",
        description="Starts the three nodelets on a ROS master of its own, plays the scans in "
        "INPUT to them from within their manager, as a driver there does, and prints the time from "
        "hand to hand, the scans that were dropped, and the manager's memory.",
    )
    parser.add_argument("input", metavar="INPUT", help="scans of a LiDAR: .bag, .pcd or .npz")
    add_topic(parser)
    add_pipeline(parser)
    parser.add_argument("--rate", type=float, default=10.0, help="scans a second (%(default)g)")
    parser.add_argument("--seconds", type=float, default=10.0, help="of playing (%(default)g)")
    parser.add_argument(
        "--compare",
        type=int,
        default=100,
        metavar="N",
        help="before, scans one at a time, which a Pipeline gets as well (%(default)s)",
    )
    parser.add_argument("--queue-size", type=int, default=1, help="of the nodelets (%(default)s)")
    parser.add_argument("--log", metavar="FILE.json", help="write all that was seen")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    import rospy

    from smoke_ground_reconstruction import latency, replay

    _check(arguments)
    count = max(1, round(arguments.rate * arguments.seconds))
    plan = {"warm_up": 50, "compare": arguments.compare, "count": count, "rate": arguments.rate}
    with tempfile.TemporaryDirectory(prefix="smoke_ground_") as work:
        scans = as_bag(arguments.input, arguments.topic, work)
        launch = launch_arguments(scans, chosen_params(arguments, scans), work)
        launch.update(cloud=latency.CLOUD, queue_size=arguments.queue_size)
        with replay.own_master(), replay.nodelets(launch):
            rospy.init_node("smoke_ground_latency", anonymous=True, disable_signals=True)
            log = latency.probe(latency.prepare(scans, Path(work)), plan)
    if arguments.log:
        Path(arguments.log).write_text(json.dumps(log) + "\n", encoding="utf-8")
        note(f"wrote {arguments.log}")
    print("\n".join(report(latency.hops(log), latency.load(log, count), arguments.rate)))


def _check(arguments: argparse.Namespace) -> None:
    if not (0 < arguments.rate < math.inf and 0 < arguments.seconds < math.inf):
        raise CommandError("--rate and --seconds must be above 0 and finite")
    if arguments.compare < 0:
        raise CommandError("--compare must not be negative")
    if arguments.queue_size < 1:
        raise CommandError("--queue-size must be at least 1")


def report(hops, load, rate: float) -> Iterator[str]:
    """The tables, line by line, of a latency.Hops and a latency.Load."""
    yield "| time [ms] | p50 | p99 |"
    yield "|---|---|---|"
    for name, times in hops.parts.items():
        yield _row(name, times)
    yield _row("driver's publish to the floor's", hops.whole)
    yield _row("of it, what a Pipeline does not do", hops.added)
    if len(hops.pipeline):
        yield _row("a Pipeline on the same scan", hops.pipeline)
        yield _row("graph minus Pipeline", hops.whole - hops.pipeline)
    yield ""
    yield (
        f"{load.played} scans at {rate:g} Hz: {load.dropped} dropped, {load.twice} came twice, "
        f"latency p50 {_percentile(load.latency, 50)} ms, p99 {_percentile(load.latency, 99)} ms, "
        f"{load.cores:.2f} cores, memory of the manager {memory(load.resident_mb)}"
    )


def memory(resident_mb: Sequence[float]) -> str:
    """How the memory went: after the first fifth of the time, and at the end."""
    start = resident_mb[len(resident_mb) // 5]
    end = resident_mb[-1]
    return f"{start:.1f} MB after a fifth of the time, {end:.1f} MB at the end"


def _row(name: str, times: np.ndarray) -> str:
    return f"| {name} | {_percentile(times, 50)} | {_percentile(times, 99)} |"


def _percentile(times: np.ndarray, share: float) -> str:
    return f"{np.percentile(times, share):.2f}" if len(times) else "none"
