"""One scan in, the floor out; on the compiled core or on the NumPy reference."""

from dataclasses import dataclass
from typing import Any, Dict, Optional

import numpy as np

from .params import Params

ENGINES = ("cpp", "python")

_SURFACE_ARRAYS = (
    "intensity",
    "ring",
    "provenance",
    "confidence",
    "boundary",
    "boundary_kind",
    "floor_plane",
)


@dataclass
class Result:
    """What comes out of a scan of N points: a floor of M points within an outline of K vertices.

    Attributes
    ----------
    labels : (N,) uint8
        Per input point: 0 invalid, 1 other, 2 noise, 3 ground, 4 wall.
    clusters : (N,) uint32
        Wall cluster per input point; 4294967295 where it belongs to none.
    surface : (M, 3) float32
        Points of the floor in the sensor frame [m], the measured ones first.
    intensity : (M,) float32
        Of the surface points; 0 where reconstructed.
    ring : (M,) uint16
        Of the surface points.
    provenance : (M,) uint8
        Of the surface points: 0 measured now, 1 reconstructed, 2 measured before.
    confidence : (M,) float32
        Of the surface points, 0..1.
    boundary : (K, 3) float32
        Closed counter-clockwise outline of the claimed floor, sensor frame [m].
    boundary_kind : (K,) uint8
        Per vertex: 0 wall seen, 1 wall inferred, 2 limit of knowledge.
    floor_plane : (3,) float64
        a, b, c of z = a x + b y + c, sensor frame.
    sigma : (M,) float32
        One sigma of the surface points' heights as those of the floor [m]; NaN where none is
        stated.
    occupancy : object
        ``cells`` (height, width) int8 (0 floor, 100 wall, -1 unknown) in the level frame, their
        edge ``resolution`` [m], and the corner ``first_column``, ``first_row`` in cells.
    extinction, extinction_sigma : float
        Of the smoke, as the walls tell it, and its sigma [1/m]; NaN where they do not.
    times : dict
        Milliseconds of wall time per stage, in the order of work.
    """

    labels: np.ndarray
    clusters: np.ndarray
    surface: np.ndarray
    intensity: np.ndarray
    ring: np.ndarray
    provenance: np.ndarray
    confidence: np.ndarray
    boundary: np.ndarray
    boundary_kind: np.ndarray
    floor_plane: np.ndarray
    sigma: np.ndarray
    occupancy: Any
    extinction: float
    extinction_sigma: float
    times: Dict[str, float]


class Pipeline:
    """Denoise, segment, cluster, reconstruct. Thesis: Section 3.1, Figure 3.1.

    A pipeline learns the order of the sensor's rings from scan to scan; use one per sensor.

    Parameters
    ----------
    params : Params, optional
        Checked here: ValueError names what is wrong.
    engine : {"cpp", "python"}
        The compiled core, or the NumPy reference; the answers are the same.
    elevation_deg : sequence of float, optional
        Elevation of each ring [deg], for a known sensor.
    """

    def __init__(self, params: Optional[Params] = None, engine: str = "cpp", elevation_deg=None):
        if engine not in ENGINES:
            raise ValueError(f"engine must be one of {', '.join(ENGINES)}, is {engine}")
        self.params = Params() if params is None else params
        self.params.validate()
        make_backend = _CompiledBackend if engine == "cpp" else _ReferenceBackend
        self._backend = make_backend(self.params, elevation_deg)

    def process(self, xyz, intensity, ring, sensor_height=None, rotation=None) -> Result:
        """The floor of one scan.

        Parameters
        ----------
        xyz : (N, 3) floating
            Points in the sensor frame [m], in any order; non-finite and zero points are ignored.
        intensity : (N,) number
            On the sensor's own scale.
        ring : (N,) integer
            Laser row as the driver numbers it, 0..65535.
        sensor_height : float, optional
            Height of the sensor above the floor [m]; without it ``reconstructor.sensor_height``.
        rotation : (3, 3) float, optional
            R_level_sensor: levels the sensor frame (+x forward, +z up).

        Raises ValueError on a wrong shape, dtype or height.
        """
        points = _checked_points(xyz, intensity, ring)
        if sensor_height is None:
            sensor_height = self.params.reconstructor.sensor_height
        if not (np.isfinite(sensor_height) and sensor_height > 0.0):
            raise ValueError(f"sensor_height must be > 0, is {sensor_height:g}")
        rotation = _checked_rotation(rotation)
        answer = self._backend.process(points, rotation, float(sensor_height))
        arrays = {name: np.asarray(getattr(answer.surface, name)) for name in _SURFACE_ARRAYS}
        return Result(
            labels=answer.labels,
            clusters=answer.clusters,
            surface=answer.surface.xyz,
            sigma=_sigma_of(answer.surface),
            occupancy=answer.occupancy,
            extinction=float(answer.visibility.extinction),
            extinction_sigma=float(answer.visibility.sigma),
            times=answer.times,
            **arrays,
        )


def _sigma_of(surface):
    sigma = getattr(surface, "sigma", None)
    if sigma is None or len(sigma) == 0:
        return np.full(len(surface.xyz), np.nan, np.float32)
    return np.asarray(sigma)


class _CompiledBackend:
    def __init__(self, params, elevation_deg):
        from . import _core

        self._core = _core
        self._pipeline = _core.Pipeline(compiled_params(params))
        if elevation_deg is not None:
            beams = [float(elevation) for elevation in elevation_deg]
            self._pipeline.sensor = _core.SensorModel.from_elevations(beams)

    def process(self, points, rotation, sensor_height):
        mounting = self._core.Mounting(rotation.ravel().tolist(), sensor_height)
        return self._pipeline.process(*points, mounting)


class _ReferenceBackend:
    def __init__(self, params, elevation_deg):
        from .reference.pipeline import Pipeline as ReferencePipeline
        from .reference.sensor_model import SensorModel

        self._pipeline = ReferencePipeline(params)
        if elevation_deg is not None:
            self._pipeline.sensor = SensorModel.from_elevations(elevation_deg)

    def process(self, points, rotation, sensor_height):
        from .reference.scan import Mounting, ScanView

        return self._pipeline.process(ScanView(*points), Mounting(rotation, sensor_height))


def compiled_params(params: Params):
    """The compiled core's parameters, from the dataclasses."""
    from . import _core

    compiled = _core.PipelineParams()
    groups = (
        (params.denoiser, compiled.denoiser),
        (params.segmenter, compiled.segmenter.segmentation),
        (params.segmenter, compiled.segmenter.clustering),
        (params.reconstructor, compiled.reconstructor),
        (params.reconstructor, compiled.reconstructor.polar_segments),
        (params.reconstructor, compiled.reconstructor.room_boundary),
    )
    for source, target in groups:
        for name in vars(source):
            if hasattr(target, name):
                setattr(target, name, getattr(source, name))
    return compiled


def _checked_points(xyz, intensity, ring):
    xyz, intensity, ring = np.asarray(xyz), np.asarray(intensity), np.asarray(ring)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or xyz.dtype.kind != "f":
        raise ValueError(f"xyz must be (N, 3) of floats, is {xyz.shape} of {xyz.dtype}")
    for name, array, kinds in (("intensity", intensity, "fiu"), ("ring", ring, "iu")):
        if array.shape != (len(xyz),) or array.dtype.kind not in kinds:
            wanted = "integers" if kinds == "iu" else "numbers"
            raise ValueError(
                f"{name} must be ({len(xyz)},) of {wanted}, is {array.shape} of {array.dtype}"
            )
    if len(ring) > 0 and not (ring.min() >= 0 and ring.max() <= 0xFFFF):
        raise ValueError(f"ring must be from 0 to 65535, is from {ring.min()} to {ring.max()}")
    return xyz.astype(np.float32), intensity.astype(np.float32), ring.astype(np.uint16)


def _checked_rotation(rotation):
    matrix = np.eye(3) if rotation is None else np.asarray(rotation, np.float64)
    is_rotation = (
        matrix.shape == (3, 3)
        and np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
        and np.linalg.det(matrix) > 0.0
    )
    if not is_rotation:
        raise ValueError("rotation must be a rotation matrix (3, 3)")
    return matrix
