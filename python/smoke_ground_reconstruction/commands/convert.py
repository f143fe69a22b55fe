"""`smoke_ground convert`: scans or floors from one kind of file to another."""

import argparse

from smoke_ground_reconstruction.commands.options import add_scan, add_topic
from smoke_ground_reconstruction.console import note, progress
from smoke_ground_reconstruction.io import files, format_of


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "convert",
        help="convert scans or floors between .bag, .pcd and .npz",
        description="Converts scans, or floors that `reconstruct` wrote, between .bag, .pcd and "
        ".npz. A .pcd holds a floor's points without its outline.",
    )
    parser.add_argument("input", metavar="INPUT", help="scans or floors")
    parser.add_argument("output", metavar="OUTPUT", help="file to write")
    add_topic(parser, "scans")
    add_scan(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    format_of(arguments.output)
    if arguments.topic is None and files.holds_floors(arguments.input):
        floors = files.open_floors(arguments.input, arguments.scan)
        files.check_room(arguments.input, floors, arguments.output, ["floor", "floors"])
        if format_of(arguments.output) == ".pcd":
            note(f"{arguments.output}: a .pcd file holds the floor's points without its outline")
        files.write_floors(arguments.output, progress(floors, len(floors), "floor"))
        return
    scans = files.open_scans(arguments.input, arguments.topic, arguments.scan)
    files.check_room(arguments.input, scans, arguments.output, ["scan", "scans"])
    files.write_scans(arguments.output, progress(scans, len(scans), "scan"))
