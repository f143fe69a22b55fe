"""The compiled module's manners: arrays in and out, errors, memory, threads."""

import gc
import sys
import threading

import numpy as np
import pytest

from rooms import seeded_cloud


@pytest.fixture
def scan():
    return seeded_cloud(0)


@pytest.fixture
def stages(core, scan):
    """Every function that takes arrays: callable and its good arguments."""
    labels = np.full(len(scan.xyz), 1, np.uint8)
    sensor = core.SensorModel()
    sensor.observe(scan.xyz, scan.ring)
    surface = core.Pipeline(core.PipelineParams()).process(*scan, core.Mounting()).surface
    mounting = core.Mounting()
    return {
        "observe": (core.SensorModel().observe, [scan.xyz, scan.ring]),
        "rings": (core.rings_from_elevation, [scan.xyz]),
        "agdor": (core.AgdorFilter(core.AgdorParams()).classify, [scan.xyz, scan.intensity]),
        "segment": (
            core.ChannelSegmentation(core.ChannelSegmentationParams()).classify,
            [scan.xyz, scan.ring, labels, sensor],
        ),
        "cluster": (core.WallClustering(core.WallClusteringParams()).cluster, [scan.xyz, labels]),
        "polar": (
            core.PolarSegments(core.PolarSegmentsParams()).reconstruct,
            [*scan, scan.xyz, scan.ring, sensor, mounting],
        ),
        "rasterize": (core.rasterize, [surface, scan.xyz, mounting, 0.1]),
        "pipeline": (core.Pipeline(core.PipelineParams()).process, [*scan, mounting]),
    }


STAGES = ["observe", "rings", "agdor", "segment", "cluster", "polar", "rasterize", "pipeline"]
SPOILERS = {
    "another dtype": lambda a: a.astype(np.float64 if a.dtype == np.float32 else np.int32),
    "another shape": lambda a: a[:, :2] if a.ndim == 2 else a[:, None],
    "one entry more": lambda a: np.concatenate([a, a[:1]]) if a.ndim == 1 else a.T,
}


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("stage", STAGES)
def test_a_wrong_array_is_refused_by_name(stages, stage, spoil):
    function, arguments = stages[stage]
    function(*arguments)
    for place, argument in enumerate(arguments):
        if isinstance(argument, np.ndarray):
            spoilt = list(arguments)
            spoilt[place] = SPOILERS[spoil](argument)
            with pytest.raises(ValueError, match=r"xyz|intensity|ring|labels"):
                function(*spoilt)


def test_arrays_may_be_strided_or_reversed(core, scan):
    pipeline = core.Pipeline(core.PipelineParams())
    packed = np.zeros(len(scan.xyz), [("xyz", "f4", 3), ("pad", "u1"), ("i", "f4"), ("r", "u2")])
    packed["xyz"], packed["i"], packed["r"] = scan
    plain = pipeline.process(*scan, core.Mounting())
    forms = {
        "unaligned records": (packed["xyz"], packed["i"], packed["r"]),
        "columns first": (np.asfortranarray(scan.xyz), scan.intensity, scan.ring),
        "read only": tuple(np.frombuffer(a.tobytes(), a.dtype).reshape(a.shape) for a in scan),
    }
    for form, arrays in forms.items():
        result = pipeline.process(*arrays, core.Mounting())
        np.testing.assert_array_equal(result.labels, plain.labels, err_msg=form)
        np.testing.assert_array_equal(result.surface.xyz, plain.surface.xyz, err_msg=form)
    # The order of points is part of the input: samples of them are picked by it.
    reversed_copy = [np.ascontiguousarray(array[::-1]) for array in scan]
    backwards = pipeline.process(*(array[::-1] for array in scan), core.Mounting())
    in_order = pipeline.process(*reversed_copy, core.Mounting())
    np.testing.assert_array_equal(backwards.labels, in_order.labels)
    np.testing.assert_array_equal(backwards.surface.xyz, in_order.surface.xyz)
    agreeing = np.count_nonzero(backwards.labels[::-1] == plain.labels)
    assert agreeing >= 0.99 * len(plain.labels)


def test_results_outlive_what_made_them(core, scan):
    pipeline = core.Pipeline(core.PipelineParams())
    result = pipeline.process(*scan, core.Mounting())
    surface, grid = result.surface, result.occupancy
    arrays = [result.labels, result.clusters, surface.xyz, surface.ring, surface.boundary]
    arrays += [surface.intensity, surface.provenance, surface.confidence, grid.cells]
    copies = [array.copy() for array in arrays]
    del pipeline, result, surface, grid
    gc.collect()
    overwrite = [np.full(array.shape, 77, array.dtype) for array in arrays for _ in range(4)]
    for array, copied in zip(arrays, copies):
        np.testing.assert_array_equal(array, copied)
        assert array.flags.writeable
    assert len(overwrite) == 4 * len(arrays)


def test_surfaces_stay_valid_without_their_result(core, scan):
    def surface_only():
        return core.Pipeline(core.PipelineParams()).process(*scan, core.Mounting()).surface

    surface = surface_only()
    gc.collect()
    np.testing.assert_array_equal(surface.xyz, surface_only().xyz)


def test_other_threads_run_meanwhile(core, scan):
    """With a switch interval of minutes another thread runs only if the lock is let go."""
    pipeline = core.Pipeline(core.PipelineParams())
    interval = sys.getswitchinterval()
    sys.setswitchinterval(600.0)
    try:
        # A busy machine may be slow to wake the other thread: a few tries.
        assert any(runs_another_thread(pipeline, scan, core.Mounting()) for _ in range(20))
    finally:
        sys.setswitchinterval(interval)


def runs_another_thread(pipeline, scan, mounting):
    """Does a thread that waits for the interpreter get it while process() is working?"""
    start, is_working, seen = threading.Event(), [False], []

    def look():
        start.wait()
        seen.append(is_working[0])

    thread = threading.Thread(target=look)
    thread.start()
    is_working[0] = True
    start.set()
    pipeline.process(*scan, mounting)
    is_working[0] = False
    thread.join()
    return seen[0]
