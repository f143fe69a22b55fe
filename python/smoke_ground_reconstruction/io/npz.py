"""Scans and floors as NumPy archives."""

import dataclasses
import zipfile
from typing import Dict

import numpy as np

from smoke_ground_reconstruction.io import DataError, clouds, replacing
from smoke_ground_reconstruction.io.clouds import Floor, LidarScan


def read_arrays(path: str) -> Dict[str, np.ndarray]:
    """All arrays of an archive by name. No pickled objects.

    Raises
    ------
    DataError : not an archive of arrays.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (zipfile.BadZipFile, ValueError, EOFError, AttributeError) as error:
        raise DataError(f"{path}: not an archive of NumPy arrays ({error})") from error


def read_scan(path: str) -> LidarScan:
    """The scan in an archive of `x y z intensity ring` and maybe `t`."""
    return clouds.scan_from_fields(path, read_arrays(path))


def write_scan(path: str, scan: LidarScan) -> None:
    """Writes `x y z intensity ring` and, where known, `t`."""
    _write(path, clouds.fields_of_scan(scan))


def read_floor(path: str) -> Floor:
    """The floor in an archive that `write_floor` made."""
    arrays = read_arrays(path)
    points = clouds.floor_from_fields(path, arrays)
    missing = [n for n in ("boundary", "boundary_kind", "floor_plane") if n not in arrays]
    if missing:
        raise DataError(f"{path}: no '{missing[0]}', which a floor's archive holds")
    boundary, kind = arrays["boundary"], arrays["boundary_kind"]
    if boundary.ndim != 2 or boundary.shape[1] != 2 or kind.shape != (len(boundary),):
        raise DataError(
            f"{path}: 'boundary' has shape {boundary.shape} and 'boundary_kind' {kind.shape}; "
            "(M, 2) and (M,) are needed"
        )
    if arrays["floor_plane"].shape != (3,):
        raise DataError(f"{path}: 'floor_plane' has shape {arrays['floor_plane'].shape}, not (3,)")
    plane = arrays["floor_plane"].astype(np.float64)
    z = boundary @ plane[:2] + plane[2]
    return dataclasses.replace(
        points,
        boundary=np.column_stack([boundary, z]).astype(np.float32),
        boundary_kind=kind.astype(np.uint8),
        floor_plane=plane,
    )


def write_floor(path: str, floor: Floor) -> None:
    """Writes `x y z ring provenance confidence sigma boundary boundary_kind floor_plane`."""
    arrays = clouds.fields_of_floor(floor)
    plane = np.full(3, np.nan) if floor.floor_plane is None else floor.floor_plane
    arrays.update(
        boundary=floor.boundary[:, :2], boundary_kind=floor.boundary_kind, floor_plane=plane
    )
    _write(path, arrays)


def _write(path: str, arrays: Dict[str, np.ndarray]) -> None:
    with replacing(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, **arrays)
