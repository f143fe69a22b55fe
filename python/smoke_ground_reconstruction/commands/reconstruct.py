"""`smoke_ground reconstruct`: from scans in a file to their floors in another."""

import argparse
import itertools
from typing import Iterable, Optional

import numpy as np

from smoke_ground_reconstruction.commands.options import add_pipeline, add_scan, add_topic
from smoke_ground_reconstruction.console import CommandError, note, progress
from smoke_ground_reconstruction.height import HeightError, estimate_sensor_height
from smoke_ground_reconstruction.io import files, format_of
from smoke_ground_reconstruction.io.clouds import LidarScan, floor_of_result
from smoke_ground_reconstruction.parameter_files import read_groups
from smoke_ground_reconstruction.params import Params

# Scans from which the sensor's height is estimated: their median outvotes a person passing by.
_HEIGHT_SCANS = 10


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "reconstruct",
        help="reconstruct the floor from scans",
        description="Reconstructs the floor from the scans in INPUT. Both files are .bag, .pcd or "
        ".npz by their ending.",
    )
    parser.add_argument("input", metavar="INPUT", help="scans of a LiDAR")
    parser.add_argument("output", metavar="OUTPUT", help="file for the floor")
    add_pipeline(parser)
    add_topic(parser)
    add_scan(parser)
    parser.add_argument(
        "--engine",
        choices=("cpp", "python"),
        default="cpp",
        help="the compiled stages, or the reference in Python (default: %(default)s)",
    )
    parser.add_argument("--sensor", metavar="NAME", help="a sensor of config/: its beams are known")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    format_of(arguments.output)
    scans = files.open_scans(arguments.input, arguments.topic, arguments.scan)
    files.check_room(arguments.input, scans, arguments.output, ["scan", "scans"])
    params = chosen_params(arguments, scans)
    results = _results(arguments, params, progress(scans, len(scans), "scan"))
    if format_of(arguments.output) == ".bag":
        _write_bag(arguments.output, results, params.reconstructor.sensor_height)
    else:
        files.write_floors(
            arguments.output, (floor_of_result(result, scan) for scan, result in results)
        )


def chosen_params(arguments: argparse.Namespace, scans: Iterable[LidarScan]) -> Params:
    """What the options of `add_pipeline` ask for; the height is estimated where none is given.

    Raises
    ------
    OSError, ParameterFileError, ValueError : as `read_params`.
    CommandError : as `estimated_height`.
    """
    groups = read_groups(arguments.params) if arguments.params else {}
    reconstructor = groups.setdefault("reconstructor", {})
    if arguments.method is not None:
        reconstructor["method"] = arguments.method
    if arguments.sensor_height is not None:
        reconstructor["sensor_height"] = arguments.sensor_height
    params = Params.from_dict(groups)
    if "sensor_height" not in reconstructor:
        params.reconstructor.sensor_height = estimated_height(arguments.input, scans)
    return params


def estimated_height(path: str, scans: Iterable[LidarScan]) -> float:
    """Height of the sensor [m], told from the first scans of a file, with a note about it.

    Raises
    ------
    CommandError : no scan shows the floor well enough.
    """
    heights, reason = [], None
    for scan in itertools.islice(scans, _HEIGHT_SCANS):
        try:
            heights.append(estimate_sensor_height(scan.xyz))
        except HeightError as error:
            reason = error
    if not heights:
        raise CommandError(f"{path}: give --sensor-height, it cannot be estimated: {reason}")
    height = round(float(np.median(heights)), 3)
    note(f"sensor height estimated as {height:.3f} m above the floor (--sensor-height sets it)")
    return height


def _results(arguments, params: Params, scans: Iterable[LidarScan]):
    from smoke_ground_reconstruction import Pipeline

    beams = _known_beams(arguments.sensor)
    pipeline = Pipeline(params, engine=arguments.engine, elevation_deg=beams)
    for scan in scans:
        if beams is not None and scan.ring.max(initial=0) >= len(beams):
            raise CommandError(
                f"{arguments.input}: ring {scan.ring.max()} in a scan, but sensor "
                f"{arguments.sensor} has rings 0 to {len(beams) - 1}"
            )
        yield scan, pipeline.process(scan.xyz, scan.intensity, scan.ring)


def _known_beams(sensor: Optional[str]):
    if sensor is None:
        return None
    from smoke_ground_reconstruction.simulation import load_sensor

    return load_sensor(sensor).elevation_deg


def _write_bag(path: str, results, sensor_height: float) -> None:
    from smoke_ground_reconstruction.io import bag

    with bag.FloorWriter(path) as writer:
        for scan, result in results:
            writer.add_result(scan, result, sensor_height)
