"""`smoke_ground params`: the parameters as one plain YAML file."""

import argparse
import sys

import yaml

from smoke_ground_reconstruction.parameter_files import read_params


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "params",
        help="write all parameters as one plain YAML file",
        description="Writes all parameters as plain YAML: the defaults, overlaid by each FILE in "
        "turn, and checked. The result serves --params, `rosparam load` and the launch file.",
    )
    parser.add_argument(
        "files",
        nargs="*",
        metavar="FILE",
        help="a parameter file, or what rqt_reconfigure or `dynparam dump` saved of one nodelet",
    )
    parser.add_argument("--output", metavar="OUT.yaml", help="write here, not to the terminal")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    params = read_params(arguments.files)
    if arguments.output:
        params.to_yaml(arguments.output)
    else:
        yaml.safe_dump(params.to_dict(), sys.stdout, default_flow_style=False, sort_keys=False)
