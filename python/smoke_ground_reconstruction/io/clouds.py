"""What files hold: a LiDAR scan, or the floor made from one."""

from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional

import numpy as np

from smoke_ground_reconstruction.io import DataError

# Stamp of what comes from a file that holds none [ns]; not zero, which ROS reads as "no time".
DEFAULT_STAMP_NS = 1_000_000_000
DEFAULT_FRAME = "lidar"

SCAN_FIELDS = ("x", "y", "z", "intensity", "ring")
FLOOR_FIELDS = ("x", "y", "z", "ring", "provenance", "confidence")


@dataclass(frozen=True)
class LidarScan:
    """One scan as recorded; points in any order, non-finite and zero points included.

    Attributes
    ----------
    xyz : (N, 3) float32, sensor frame [m]
    intensity : (N,) float32, the sensor's own scale
    ring : (N,) uint16, as the driver numbers it
    t : (N,) float32 time of each point relative to the stamp [s], or None
    stamp_ns : time of the scan [ns]
    frame_id : name of the sensor frame
    message : the sensor_msgs/PointCloud2 it was read from, or None
    recorded_ns : when that message was recorded [ns]; None: take the stamp
    """

    xyz: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    t: Optional[np.ndarray] = None
    stamp_ns: int = DEFAULT_STAMP_NS
    frame_id: str = DEFAULT_FRAME
    message: Any = None
    recorded_ns: Optional[int] = None


@dataclass(frozen=True)
class Floor:
    """The floor made from one scan.

    Attributes
    ----------
    xyz : (N, 3) float32, sensor frame [m]
    ring : (N,) uint16
    provenance : (N,) uint8: 0 measured, 1 reconstructed, 2 measured before
    confidence : (N,) float32, 0 to 1
    intensity : (N,) float32, 0 where reconstructed
    boundary : (M, 3) float32, closed counter-clockwise outline of the claimed floor [m]
    boundary_kind : (M,) uint8: 0 wall seen, 1 wall inferred, 2 limit of knowledge
    floor_plane : (3,) float64, a, b, c of z = a x + b y + c, or None where the file holds none
    walls : (K, 3) float32, wall points, or None where the file holds none
    sigma : (N,) float32, one sigma of the points' heights [m], or None where the file holds none
    """

    xyz: np.ndarray
    ring: np.ndarray
    provenance: np.ndarray
    confidence: np.ndarray
    intensity: np.ndarray
    boundary: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    boundary_kind: np.ndarray = field(default_factory=lambda: np.zeros(0, np.uint8))
    floor_plane: Optional[np.ndarray] = None
    walls: Optional[np.ndarray] = None
    sigma: Optional[np.ndarray] = None
    stamp_ns: int = DEFAULT_STAMP_NS
    frame_id: str = DEFAULT_FRAME


def scan_from_fields(path: str, fields: Dict[str, np.ndarray]) -> LidarScan:
    """A scan from named columns, each checked.

    `ring` may be missing: it is then told from the points' elevations, with a note.

    Raises
    ------
    DataError : a column is missing, of another length, of a wrong kind or out of range.
    """
    columns = _columns(path, fields, ("x", "y", "z", "intensity"), optional=("ring", "t"))
    xyz = np.column_stack([columns[name].astype(np.float32) for name in "xyz"])
    ring = columns.get("ring")
    return LidarScan(
        xyz=xyz,
        intensity=columns["intensity"].astype(np.float32),
        ring=_rings_of(path, xyz) if ring is None else _as_rings(path, ring),
        t=columns["t"].astype(np.float32) if "t" in columns else None,
    )


def fields_of_scan(scan: LidarScan) -> Dict[str, np.ndarray]:
    """Named columns of a scan, as `scan_from_fields` reads them."""
    fields = {name: np.ascontiguousarray(scan.xyz[:, k]) for k, name in enumerate("xyz")}
    fields.update(intensity=scan.intensity, ring=scan.ring)
    if scan.t is not None:
        fields["t"] = scan.t
    return fields


def is_floor(names) -> bool:
    """Do columns of these names make a floor (rather than a scan)?"""
    return "provenance" in names


def floor_from_fields(path: str, fields: Dict[str, np.ndarray]) -> Floor:
    """A floor's points from named columns, each checked; the outline is not among them.

    Raises
    ------
    DataError : as `scan_from_fields`.
    """
    columns = _columns(path, fields, FLOOR_FIELDS, optional=("intensity", "sigma"))
    count = len(columns["x"])
    return Floor(
        xyz=np.column_stack([columns[name].astype(np.float32) for name in "xyz"]),
        ring=_as_rings(path, columns["ring"]),
        provenance=columns["provenance"].astype(np.uint8),
        confidence=columns["confidence"].astype(np.float32),
        intensity=columns.get("intensity", np.zeros(count)).astype(np.float32),
        sigma=columns["sigma"].astype(np.float32) if "sigma" in columns else None,
    )


def floor_of_result(result, scan: LidarScan) -> Floor:
    """The floor in what Pipeline.process() made of a scan."""
    from smoke_ground_reconstruction.reference.label import NO_CLUSTER

    return Floor(
        xyz=result.surface,
        ring=result.ring,
        provenance=result.provenance,
        confidence=result.confidence,
        intensity=result.intensity,
        boundary=result.boundary,
        boundary_kind=result.boundary_kind,
        floor_plane=result.floor_plane,
        walls=scan.xyz[result.clusters != NO_CLUSTER],
        sigma=result.sigma,
        stamp_ns=scan.stamp_ns,
        frame_id=scan.frame_id,
    )


def fitted_plane(xyz: np.ndarray) -> Optional[np.ndarray]:
    """a, b, c of z = a x + b y + c by least squares, for files that hold the points alone.

    None where fewer than three points, or points on one line, leave the plane open.
    """
    design = np.column_stack([xyz[:, :2].astype(np.float64), np.ones(len(xyz))])
    plane, _, rank, _ = np.linalg.lstsq(design, xyz[:, 2].astype(np.float64), rcond=None)
    return plane if rank == 3 else None


def fields_of_floor(floor: Floor) -> Dict[str, np.ndarray]:
    """Named columns of a floor's points, as `floor_from_fields` reads them."""
    fields = {name: np.ascontiguousarray(floor.xyz[:, k]) for k, name in enumerate("xyz")}
    fields.update(ring=floor.ring, provenance=floor.provenance, confidence=floor.confidence)
    if floor.sigma is not None:
        fields["sigma"] = floor.sigma
    return fields


def _columns(path, fields, required, optional) -> Dict[str, np.ndarray]:
    missing = [name for name in required if name not in fields]
    if missing:
        raise DataError(f"{path}: no {_listed(missing)}; it holds {_listed(sorted(fields))}")
    columns = {name: fields[name] for name in (*required, *optional) if name in fields}
    for name, values in columns.items():
        if values.ndim != 1 or len(values) != len(columns["x"]):
            raise DataError(
                f"{path}: '{name}' has shape {values.shape}, 'x' has {columns['x'].shape}; "
                "one value per point is needed"
            )
        if values.dtype.kind not in "fiu":
            raise DataError(f"{path}: '{name}' is of type {values.dtype}, not of numbers")
    return columns


def _listed(names: List[str]) -> str:
    return ", ".join(f"'{name}'" for name in names) if names else "nothing"


def _as_rings(path: str, ring: np.ndarray) -> np.ndarray:
    if ring.dtype.kind not in "iu":
        raise DataError(f"{path}: 'ring' is of type {ring.dtype}, not of whole numbers")
    if len(ring) and (ring.min() < 0 or ring.max() > 65535):
        raise DataError(f"{path}: 'ring' goes from {ring.min()} to {ring.max()}, not 0 to 65535")
    return ring.astype(np.uint16)


def _rings_of(path: str, xyz: np.ndarray) -> np.ndarray:
    from smoke_ground_reconstruction.console import note
    from smoke_ground_reconstruction.reference.sensor_model import rings_from_elevation

    note(f"{path}: no 'ring'; told from the points' elevations")
    return rings_from_elevation(xyz)
