"""Every method that can be evaluated, by name.

A method is a name of METHODS; or a file `NAME.yaml`, the pipeline with these parameters; or
`DENOISER+METHOD`, with another denoiser in AGDOR's place.
"""

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Callable, Dict, Optional

import numpy as np

from smoke_ground_reconstruction.evaluation import ablation
from smoke_ground_reconstruction.evaluation.baselines import denoisers, ground
from smoke_ground_reconstruction.evaluation.baselines.native import native
from smoke_ground_reconstruction.evaluation.world import Truth, config_directory
from smoke_ground_reconstruction.reference.label import Label

HEIGHT_BAND = 0.10
"""Half height of the band around the floor's height that the thesis's raw grids are cut from [m].
The thesis says that it used z thresholds (Section 5.2.1), not which."""


@dataclass(frozen=True)
class Output:
    """What a method says of a scan of N points; None where it says nothing.

    Attributes:
        surface: (M, 3) points of the claimed floor in the sensor frame [m].
        kept: (N,) bool, points that survive denoising.
        labels: (N,) uint8 of reference.label.Label.
        provenance: (M,) uint8 of the surface points.
        confidence: (M,) float32 of the surface points, from 0 to 1.
        sigma: (M,) standard deviation of the surface points' heights [m].
        floor_plane: (3,) a, b, c of z = a x + b y + c in the sensor frame.
        extinction: of the smoke and its sigma, (2,) [1/m], told of the scan alone.
        extinction_after_clear: the same by a method that saw the place in clear air before.
        times: milliseconds by stage.
    """

    surface: Optional[np.ndarray] = None
    kept: Optional[np.ndarray] = None
    labels: Optional[np.ndarray] = None
    provenance: Optional[np.ndarray] = None
    confidence: Optional[np.ndarray] = None
    sigma: Optional[np.ndarray] = None
    floor_plane: Optional[np.ndarray] = None
    extinction: Optional[np.ndarray] = None
    extinction_after_clear: Optional[np.ndarray] = None
    times: Dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Method:
    """A method of the evaluation.

    Attributes:
        name: as the command line takes it.
        kind: "reference", "pipeline", "ablation", "ground" or "denoiser".
        about: one line for the report.
        function: (ScanInput, denoise) to Output; denoise is false where another denoiser has
            already been at work and a pipeline must leave out its own.
        require: raises BaselineUnavailableError where the method cannot run here.
    """

    name: str
    kind: str
    about: str
    function: Callable
    require: Callable = lambda: None

    def run(self, scan):
        """Apply the method to a ScanInput: Output."""
        return self.function(scan, True)


def method(name):
    """The method of a name.

    Raises:
        ValueError: one line that names what is unknown and what is known.
    """
    if "+" in name:
        first, second = name.split("+", 1)
        return _composed(name, method(first), method(second))
    if name.endswith((".yaml", ".yml")):
        return _file_method(Path(name))
    if name not in METHODS:
        raise ValueError(f"unknown method '{name}' (known: {', '.join(METHODS)}, or a .yaml file)")
    return METHODS[name]


def _file_method(path):
    if not path.is_file():
        raise ValueError(f"no parameter file '{path}'")
    _params_class().from_yaml(path)  # a bad file is refused before any work
    about = f"The pipeline with the parameters of {path.name}"
    return Method(path.stem, "pipeline", about, _pipeline(lambda: _params_class().from_yaml(path)))


def _composed(name, first, second):
    if first.kind != "denoiser" or second.kind == "denoiser":
        raise ValueError(f"'{name}' must be DENOISER+METHOD")

    def run(scan, denoise):
        before = first.run(scan)
        after = second.function(scan.select(before.kept), False)
        labels, kept = np.full(len(scan), Label.NOISE, dtype=np.uint8), before.kept
        if after.labels is not None:
            labels[kept] = after.labels
        times = {**after.times, "denoise": before.times["denoise"]}
        return replace(after, kept=kept, labels=labels, times=times)

    def require():
        first.require()
        second.require()

    return Method(name, second.kind, f"{first.about}; then {second.about}", run, require)


def _params_class():
    from smoke_ground_reconstruction.params import Params

    return Params


def _pipeline(load_params, engine="cpp"):
    """The pipeline with the Params that load_params gives."""

    def run(scan, denoise):
        from smoke_ground_reconstruction.pipeline import Pipeline

        params = load_params()
        if not denoise:
            params.denoiser.intensity_threshold = 0.0  # nothing is a candidate

        # A pipeline may learn from scan to scan. Each scan gets a fresh one, so that no score
        # depends on the order of work.
        def look(pipeline, at):
            return pipeline.process(at.xyz, at.intensity, at.ring, sensor_height=at.sensor_height)

        result = look(Pipeline(params, engine, scan.elevation_deg), scan)
        after_clear = None
        if scan.in_clear_air is not None and params.reconstructor.method == "room_boundary":
            experienced = Pipeline(params, engine, scan.elevation_deg)
            look(experienced, scan.in_clear_air)
            after_clear = _extinction(look(experienced, scan))
        removed = (result.labels == Label.NOISE) | (result.labels == Label.INVALID)
        return Output(
            surface=result.surface,
            kept=~removed,
            labels=result.labels,
            provenance=result.provenance,
            confidence=result.confidence,
            sigma=result.sigma if np.isfinite(result.sigma).all() else None,
            floor_plane=result.floor_plane,
            extinction=_extinction(result),
            extinction_after_clear=after_clear,
            times=dict(result.times),
        )

    return run


def _extinction(result):
    """With its sigma, (2,) [1/m]; None where the scan does not tell it."""
    told = np.array([result.extinction, result.extinction_sigma])
    return told if np.isfinite(told).all() else None


def _segmented_ground(changes):
    """The thesis's segmented ground points claimed as the floor, and nothing more."""
    pipeline = _pipeline(lambda: _params_class().from_dict({**POLAR_SEGMENTS, **changes}))

    def run(scan, denoise):
        whole = pipeline(scan, denoise)
        times = {name: whole.times[name] for name in ("organise", "denoise", "segment")}
        surface = scan.xyz[whole.labels == Label.GROUND]
        return Output(surface=surface, kept=whole.kept, labels=whole.labels, times=times)

    return run


def _raw_cloud(scan, denoise):
    return Output(surface=scan.xyz[scan.truth == Truth.FLOOR])


def _raw_cloud_band(scan, denoise):
    height = scan.xyz[:, 2].astype(np.float64) + scan.sensor_height
    return Output(surface=scan.xyz[np.abs(height) <= HEIGHT_BAND])


def _ablation(name):
    about, _ = ablation.WITHOUT[name]
    whole = _pipeline(lambda: _params_class().from_dict(_ROOM_BOUNDARY), engine="python")

    def run(scan, denoise):
        with ablation.without(name):
            return whole(scan, denoise)

    return Method(ablation.PREFIX + name, "ablation", f"room_boundary, but {about}", run)


def _timed(function, *arguments):
    start = time.perf_counter()
    result = function(*arguments)
    return result, 1e3 * (time.perf_counter() - start)


def _denoiser(keep):
    def run(scan, denoise):
        kept, elapsed = _timed(keep, scan.xyz, scan.intensity, scan.ring)
        return Output(kept=kept, times={"denoise": elapsed})

    return run


def _ground(segment):
    """A ground baseline: all it calls ground is claimed as floor."""

    def run(scan, denoise):
        found, elapsed = _timed(segment, scan.xyz, scan.intensity, scan.sensor_height)
        return Output(
            surface=scan.xyz[found],
            kept=np.ones(len(scan), dtype=bool),
            labels=np.where(found, Label.GROUND, Label.KEPT).astype(np.uint8),
            times={"segment": elapsed},
        )

    return run


def _keep_all(xyz, intensity, ring):
    return np.ones(len(xyz), dtype=bool)


def _best_params():
    return _params_class().from_yaml(config_directory() / "polar_segments_best.yaml")


ORIGINAL_CHANNEL = {"segmenter": {"ground_range_step": "increasing"}}
"""The channel-based method without the thesis's 30 mm feature (Chu et al. 2017)."""

POLAR_SEGMENTS = {"reconstructor": {"method": "polar_segments"}}
_ROOM_BOUNDARY = {"reconstructor": {"method": "room_boundary"}}

METHODS = {
    entry.name: entry
    for entry in [
        Method("raw_cloud", "reference", "The scan's points whose truth is floor", _raw_cloud),
        Method(
            "raw_cloud_band",
            "reference",
            f"The scan's points within {HEIGHT_BAND:.2f} m of the floor's height",
            _raw_cloud_band,
        ),
        Method(
            "polar_segments",
            "pipeline",
            "The thesis's method, printed parameters",
            _pipeline(lambda: _params_class().from_dict(POLAR_SEGMENTS)),
        ),
        Method(
            "polar_segments_best",
            "pipeline",
            "The thesis's method, config/polar_segments_best.yaml",
            _pipeline(_best_params),
        ),
        Method(
            "room_boundary",
            "pipeline",
            "The room's boundary per column",
            _pipeline(lambda: _params_class().from_dict(_ROOM_BOUNDARY)),
        ),
        *(_ablation(name) for name in ablation.WITHOUT),
        Method(
            "channel",
            "ground",
            "Channel-based ground points with the 30 mm feature",
            _segmented_ground({}),
        ),
        Method(
            "channel_original",
            "ground",
            "Channel-based ground points without the feature",
            _segmented_ground(ORIGINAL_CHANNEL),
        ),
        Method(
            "ransac_plane",
            "ground",
            "Largest plane of the cloud (PCL)",
            _ground(ground.ransac_plane),
            native,
        ),
        Method(
            "ransac_plane_low",
            "ground",
            "Largest plane below half the sensor's height (PCL)",
            _ground(ground.ransac_plane_low),
            native,
        ),
        Method(
            "patchworkpp",
            "ground",
            "Patchwork++, a room's ranges",
            _ground(ground.patchworkpp),
            ground.require_patchworkpp,
        ),
        Method("none", "denoiser", "No denoising", _denoiser(_keep_all)),
        Method("agdor", "denoiser", "AGDOR, printed parameters", _denoiser(denoisers.agdor)),
        Method(
            "intensity_threshold",
            "denoiser",
            "Intensity of at least 25",
            _denoiser(denoisers.intensity_threshold),
        ),
        Method("ror", "denoiser", "Radius removal (PCL)", _denoiser(denoisers.ror), native),
        Method(
            "sor", "denoiser", "Statistical outlier removal (PCL)", _denoiser(denoisers.sor), native
        ),
        Method("dror", "denoiser", "Radius removal by range", _denoiser(denoisers.dror)),
        Method("dsor", "denoiser", "Statistical removal by range", _denoiser(denoisers.dsor)),
        Method("lior", "denoiser", "Low-intensity outlier removal", _denoiser(denoisers.lior)),
        Method(
            "aori_like",
            "denoiser",
            "Kernel on the range image, after AORI",
            _denoiser(denoisers.aori_like),
        ),
    ]
}
