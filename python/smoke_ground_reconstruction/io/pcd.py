"""Scans and floors as `.pcd` files, read and written by PCL through the bindings."""

from typing import Dict

import numpy as np

from smoke_ground_reconstruction.io import DataError, clouds, replacing
from smoke_ground_reconstruction.io.clouds import Floor, LidarScan


def read_fields(path: str) -> Dict[str, np.ndarray]:
    """All fields of a file by name.

    Raises
    ------
    DataError : the file cannot be read, or the bindings were built without PCL.
    """
    try:
        return _bindings().read_pcd(path)
    except RuntimeError as error:
        raise DataError(str(error)) from error


def read_scan(path: str) -> LidarScan:
    """The scan in a file with the fields `x y z intensity ring` and maybe `t`."""
    return clouds.scan_from_fields(path, read_fields(path))


def write_scan(path: str, scan: LidarScan) -> None:
    """Writes `x y z intensity ring` and, where known, `t`."""
    _write(path, clouds.fields_of_scan(scan))


def read_floor(path: str) -> Floor:
    """The floor's points; a `.pcd` file holds neither the outline nor the floor's plane."""
    return clouds.floor_from_fields(path, read_fields(path))


def write_floor(path: str, floor: Floor) -> None:
    """Writes `x y z intensity ring provenance confidence sigma`; the format has no place for the
    rest."""
    fields = clouds.fields_of_floor(floor)
    _write(path, {**fields, "intensity": floor.intensity})


def _write(path: str, fields: Dict[str, np.ndarray]) -> None:
    with replacing(path) as part:
        try:
            _bindings().write_pcd(part, fields)
        except RuntimeError as error:
            raise DataError(str(error).replace(part, path)) from error


def _bindings():
    from smoke_ground_reconstruction import _core

    if not hasattr(_core, "read_pcd"):
        raise DataError(".pcd files need bindings built with PCL")
    return _core
