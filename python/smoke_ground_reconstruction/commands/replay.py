"""`smoke_ground replay`: scans through the running nodelets, what they publish into a bag."""

import argparse
import tempfile
from pathlib import Path

from smoke_ground_reconstruction.commands.options import add_pipeline, add_topic
from smoke_ground_reconstruction.commands.reconstruct import chosen_params
from smoke_ground_reconstruction.console import CommandError, note
from smoke_ground_reconstruction.io import files, format_of
from smoke_ground_reconstruction.params import Params


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "replay",
        help="play scans through the nodelets and record what they publish",
        description="Starts the three nodelets, plays the scans in INPUT to them by `rosbag play` "
        "and records in OUTPUT.bag what those publish that the method needs, on a ROS master of "
        "its own.",
    )
    parser.add_argument("input", metavar="INPUT", help="scans of a LiDAR: .bag, .pcd or .npz")
    parser.add_argument("output", metavar="OUTPUT.bag", help="bag for the outputs")
    add_topic(parser)
    add_pipeline(parser)
    parser.add_argument(
        "--rate", type=float, default=1.0, help="speed of the playback (default: %(default)s)"
    )
    for stage in ("denoiser", "reconstructor"):
        parser.add_argument(
            f"--{stage}",
            choices=("cpp", "python"),
            default="cpp",
            help=f"the {stage} as a nodelet, or as a node on the reference in Python",
        )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    from smoke_ground_reconstruction import replay

    if format_of(arguments.output) != ".bag":
        raise CommandError(f"{arguments.output}: the ending must be .bag")
    if not arguments.rate > 0:
        raise CommandError(f"--rate must be above 0, is {arguments.rate:g}")
    with tempfile.TemporaryDirectory(prefix="smoke_ground_") as work:
        scans = as_bag(arguments.input, arguments.topic, work)
        params = chosen_params(arguments, scans)
        launch = launch_arguments(scans, params, work)
        launch.update(denoiser=arguments.denoiser, reconstructor=arguments.reconstructor)
        with replay.own_master(), replay.nodelets(launch):
            method = params.reconstructor.method
            floors = replay.record(scans, arguments.output, arguments.rate, method)
    note(f"{floors} of {len(scans)} scans came out as floors in {arguments.output}")


def as_bag(path: str, topic: str, work: str):
    """The scans, in a bag in any case: a new one in the directory `work` where they are in none."""
    if format_of(path) == ".bag":
        return files.open_scans(path, topic)
    target = str(Path(work) / "scans.bag")
    files.write_scans(target, files.open_scans(path, topic))
    return files.open_scans(target)


def launch_arguments(scans, params: Params, work: str) -> dict:
    """Arguments of the launch file, by name; writes the parameters into the folder `work`."""
    path = str(Path(work) / "params.yaml")
    params.to_yaml(path)
    return {"cloud": scans.topic, "params": path, "respawn": "false"}
