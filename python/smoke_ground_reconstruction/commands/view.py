"""`smoke_ground view`: a floor or a scan from above, as a picture or in a window."""

import argparse
import os
from pathlib import Path
from typing import Sized

from smoke_ground_reconstruction import view
from smoke_ground_reconstruction.commands.options import add_scan, add_topic
from smoke_ground_reconstruction.console import CommandError, note
from smoke_ground_reconstruction.io import files


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "view",
        help="draw a floor from above",
        description="Draws a floor that `reconstruct` wrote, or the points of a scan, from above: "
        "into PICTURE, or without one in a window.",
    )
    parser.add_argument("input", metavar="INPUT", help="a floor or a scan: .bag, .pcd or .npz")
    parser.add_argument("picture", metavar="PICTURE.png", nargs="?", help="file to write")
    add_topic(parser, "scans")
    add_scan(parser, "which scan")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    _check_target(arguments.picture)
    figure = _drawn(arguments)
    if arguments.picture is None:
        view.show(figure, arguments.input)
    else:
        view.save(figure, arguments.picture)
        note(f"wrote {arguments.picture}")


def _check_target(picture) -> None:
    if picture is None:
        if not os.environ.get("DISPLAY"):
            raise CommandError("there is no display for a window: name a PICTURE.png to write")
    elif Path(picture).suffix.lower() != ".png":
        raise CommandError(f"{picture}: the ending must be .png")


def _drawn(arguments: argparse.Namespace):
    path = arguments.input
    title = Path(path).name
    if arguments.scan is not None:
        title += f", scan {arguments.scan}"
    if arguments.topic is None and files.holds_floors(path):
        return view.draw_floor(_only(path, files.open_floors(path, arguments.scan)), title)
    scans = files.open_scans(path, arguments.topic, arguments.scan)
    return view.draw_scan(_only(path, scans), title)


def _only(path: str, items: Sized):
    if len(items) != 1:
        raise CommandError(f"{path} has {len(items)} scans: choose one by --scan")
    return next(iter(items))
