"""Command line of the package: `scripts/smoke_ground` in a checkout, `rosrun` when installed."""

import argparse
import importlib
import importlib.util
import os
import sys
from typing import List, Optional

from smoke_ground_reconstruction.console import note

PACKAGE = "smoke_ground_reconstruction"

# Modules with add_parser(subparsers), in the order of the help.
COMMANDS = (
    "commands.reconstruct",
    "commands.view",
    "commands.replay",
    "commands.latency",
    "commands.convert",
    "commands.params",
    "commands.benchmark",
    "simulation.command",
    "evaluation.command",
)


def main(argv: Optional[List[str]] = None) -> int:
    """Runs one command and returns the process's exit status.

    0: done. 1: the one line on stderr says what is wrong. 2: the arguments are wrong. 130:
    interrupted.
    """
    try:
        parser = build_parser()
    except ImportError as error:
        note(f"error: this installation is incomplete: {_one_line(error)}")
        return 1
    arguments = parser.parse_args(argv)
    try:
        return arguments.run(arguments) or 0
    except KeyboardInterrupt as interruption:
        note(str(interruption) or "interrupted")
        return 130
    except BrokenPipeError:  # e.g. `| head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if arguments.debug:
            raise
        note(f"error: {_one_line(error)}")
        return 1


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands that this installation has."""
    parser = argparse.ArgumentParser(
        prog="smoke_ground",
        description="The full floor of a smoke-filled room from LiDAR scans.",
    )
    parser.add_argument("--debug", action="store_true", help="show where an error comes from")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in COMMANDS:
        if _exists(f"{PACKAGE}.{name}"):
            importlib.import_module(f"{PACKAGE}.{name}").add_parser(subparsers)
    return parser


def _exists(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    if isinstance(error, (ValueError, OSError, RuntimeError, ImportError)) and text:
        return text
    return f"{type(error).__name__}: {text} (smoke_ground --debug shows where)"


if __name__ == "__main__":
    sys.exit(main())
