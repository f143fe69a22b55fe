"""Options that several commands share."""

import argparse

import numpy as np

from smoke_ground_reconstruction.params import RECONSTRUCTION_METHODS


def add_topic(parser: argparse.ArgumentParser, of: str = "clouds") -> None:
    """--topic"""
    parser.add_argument("--topic", help=f"topic of the {of}, for a bag with several")


def add_scan(parser: argparse.ArgumentParser, what: str = "only this scan") -> None:
    """--scan"""
    parser.add_argument("--scan", type=int, metavar="N", help=f"{what} of a bag (from 0)")


def add_pipeline(parser: argparse.ArgumentParser) -> None:
    """--method, --sensor-height and --params: what decides a reconstruction."""
    parser.add_argument("--method", choices=RECONSTRUCTION_METHODS, help="way of reconstruction")
    parser.add_argument(
        "--sensor-height",
        type=positive_metres,
        metavar="M",
        help="height of the sensor above the floor [m]; estimated from the scans if not given",
    )
    parser.add_argument("--params", metavar="FILE.yaml", help="parameters of the three stages")


def positive_metres(text: str) -> float:
    """A length above zero, for argparse."""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not 0.0 < value < np.inf:
        raise argparse.ArgumentTypeError(f"must be a number of metres above 0, is '{text}'")
    return value
