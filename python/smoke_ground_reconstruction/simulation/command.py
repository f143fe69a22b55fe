"""`smoke_ground simulate`: scans of a smoke-filled room, or smoke over a recorded scan."""

import argparse
from dataclasses import replace

import numpy as np

from ..commands.options import add_scan, add_topic
from ..console import CommandError, note, progress
from ..io import files, format_of, replacing
from .levels import LEVELS, calibrate
from .overlay import RecordedScan, extinction_for_survival, overlay
from .scan import simulate
from .scene import load_scene, scene_names, sensor_problem
from .sensor import load_sensor, sensor_names
from .sequence import drive_through, scan_count, stand_still
from .smoke import SOOT_BACKSCATTER_RATIO, Smoke, meteorological_range, optical_density
from .truth import floor_truth
from .world import Truth

_ATTITUDE = ("yaw_deg", "pitch_deg", "roll_deg")


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "simulate",
        help="simulate scans of a smoke-filled room",
        description="Simulates a LiDAR in a smoke-filled room, or lays smoke over a recorded clear "
        "scan (--overlay; then SCENE is left out). .npz and .pcd hold one scan and the truth class "
        "of each point; .bag holds scans as the LiDAR's own driver publishes them, and /tf.",
        epilog=f"scenes: {', '.join(scene_names())}. sensors: {', '.join(sensor_names())}. truth "
        f"classes: {', '.join(f'{t.value} {t.name.lower()}' for t in Truth)}.",
    )
    parser.add_argument("scene", metavar="SCENE", nargs="?", help="name, or path of a scene file")
    parser.add_argument("output", metavar="OUTPUT", help=".bag, .npz or .pcd to write")
    parser.add_argument("--sensor", default="qt128", help="name, or path of a sensor file (qt128)")
    parser.add_argument("--seed", type=int, default=0, help="of smoke pattern and noise (0)")
    parser.add_argument("--mode", choices=("strongest", "last", "dual"), help="return mode")
    _add_smoke_arguments(parser)
    _add_room_arguments(parser)
    group = parser.add_argument_group("smoke over a recorded scan")
    group.add_argument("--overlay", metavar="SCAN", help="clear scan (.npz, .pcd, .bag)")
    group.add_argument(
        "--survival",
        type=float,
        metavar="SHARE",
        help="share of the scan's floor returns that survive (0.66)",
    )
    group.add_argument("--sensor-height", type=float, metavar="M", help="estimated if not given")
    add_topic(group)
    add_scan(group)
    parser.set_defaults(run=run)


def _add_smoke_arguments(parser):
    group = parser.add_argument_group("smoke")
    thickness = group.add_mutually_exclusive_group()
    thickness.add_argument(
        "--level",
        choices=tuple(LEVELS),
        help="extinction by the share of floor cells that is left (heavy)",
    )
    thickness.add_argument("--extinction", type=float, metavar="A", help="mean extinction [1/m]")
    group.add_argument(
        "--soot", action="store_true", help="absorbing particles: little backscatter"
    )
    group.add_argument("--patchiness", type=float, metavar="S", help="sigma of ln extinction (0.6)")
    group.add_argument(
        "--layer", type=float, metavar="Z", help="smoke hangs above this height [m], thin below"
    )


def _add_room_arguments(parser):
    group = parser.add_argument_group("sensor and time")
    group.add_argument("--pose", help="name or number of one of the scene's poses (its first)")
    group.add_argument("--height", type=float, metavar="M", help="above the floor")
    for name in _ATTITUDE:
        group.add_argument(
            f"--{name.replace('_', '-')}", type=float, metavar="DEG", help="of the pose"
        )
    group.add_argument(
        "--sequence",
        type=float,
        metavar="SECONDS",
        help="as many scans as fit, into a .bag: along the scene's drive, or at --pose",
    )
    group.add_argument("--truth", metavar="FILE", help="also write poses and truth of a bag (.npz)")
    group.add_argument(
        "--show-calibration",
        action="store_true",
        help="print every level of the pose, and how this one was found",
    )


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    format_of(arguments.output)
    if (arguments.scene is None) == (arguments.overlay is None):
        raise CommandError("give either SCENE OUTPUT, or --overlay SCAN OUTPUT")
    if arguments.overlay is not None:
        _run_overlay(arguments)
        return
    _check_room_options(arguments)
    scene, sensor = load_scene(arguments.scene), load_sensor(arguments.sensor)
    pose = _pose(arguments, scene)
    smoke = _room_smoke(arguments, scene, sensor, pose)
    mode = arguments.mode or sensor.return_mode
    if format_of(arguments.output) == ".bag":
        _write_bag(arguments, scene, sensor, pose, smoke, mode)
        return
    scan = simulate(scene, sensor, pose, smoke, arguments.seed, mode)
    _say_what_is_left(scene, sensor, pose, scan, arguments.seed, mode)
    _write_points(
        arguments.output,
        {
            "xyz": scan.xyz,
            "intensity": scan.intensity,
            "ring": scan.ring,
            "t": scan.t,
            "truth": scan.truth,
        },
        pose=scan.pose,
        sensor_height=scan.sensor_height,
        extinction=scan.extinction,
    )


def _check_room_options(arguments):
    if arguments.survival is not None:
        raise CommandError("--survival is for --overlay; a scene's smoke is set by --level")
    for option in ("sequence", "truth"):
        if getattr(arguments, option) is not None and format_of(arguments.output) != ".bag":
            raise CommandError(f"--{option} needs a .bag as OUTPUT")


def _pose(arguments, scene):
    which = arguments.pose or 0
    pose = scene.pose(int(which) if str(which).isdigit() else which)
    changes = {name: getattr(arguments, name) for name in ("height",) + _ATTITUDE}
    pose = replace(pose, **{name: value for name, value in changes.items() if value is not None})
    problem = sensor_problem(scene, pose.at, pose.height)
    if problem is not None:
        raise CommandError(f"{scene.file}: pose {pose.name} at height {pose.height:g}: {problem}")
    return pose


def _smoke(arguments, scene_smoke):
    """Smoke of unknown thickness from the options, on top of what the scene says."""
    values = dict(scene_smoke)
    if arguments.soot:
        values["backscatter_ratio"] = SOOT_BACKSCATTER_RATIO
    if arguments.patchiness is not None:
        values["sigma_ln"] = arguments.patchiness
    if arguments.layer is not None:
        values.update(layer_height=arguments.layer, layer_thickness=0.4, below_layer=0.2)
    return Smoke(**values)


def _calibrated(*what):
    return calibrate(*what, progress=lambda seeds, number: progress(seeds, number, "pattern"))


def _room_smoke(arguments, scene, sensor, pose):
    smoke = _smoke(arguments, scene.smoke)
    level = arguments.level or "heavy"
    if arguments.show_calibration:
        for name in LEVELS:
            note(_calibrated(scene, sensor, pose, name, smoke).summary())
        found = _calibrated(scene, sensor, pose, level, smoke)
        for extinction, share in zip(found.extinctions, found.shares):
            note(f"{level}: {extinction:.4f} /m keeps {100 * share:.2f} %")
    if arguments.extinction is not None:
        return _of_thickness(smoke, arguments.extinction)
    if level == "clear":
        return None
    found = _calibrated(scene, sensor, pose, level, smoke)
    note(found.summary())
    return smoke.with_extinction(found.mean_extinction)


def _of_thickness(smoke, extinction):
    if not extinction >= 0:
        raise CommandError(f"--extinction must be at least 0, not {extinction:g}")
    if extinction == 0:
        return None
    note(
        f"extinction {extinction:.3f} /m, MOR {meteorological_range(extinction):.1f} m, "
        f"optical density {optical_density(extinction):.3f} /m"
    )
    return smoke.with_extinction(extinction)


def _say_what_is_left(scene, sensor, pose, scan, seed, mode):
    """The level as this very scan has it: measured, not expected."""
    truth = floor_truth(scene, sensor, pose)
    counted = truth.visible_floor & ~truth.under_sensor

    def cells(points):
        found = np.zeros(counted.size, dtype=bool)
        index = truth.cells_of(points.level_xyz[points.truth == Truth.FLOOR])
        found[index[index >= 0]] = True
        return found.reshape(counted.shape) & counted

    clear = cells(simulate(scene, sensor, pose, None, seed, mode))
    kept = np.count_nonzero(cells(scan) & clear)
    note(
        f"{len(scan)} points; {kept} of {np.count_nonzero(clear)} clear-air floor cells are left "
        f"({100 * kept / max(1, np.count_nonzero(clear)):.1f} %)"
    )


def _write_bag(arguments, scene, sensor, pose, smoke, mode):
    from .bags import START_NS, SequenceWriter  # ROS's Python packages are needed here alone

    seconds = 1.0 / sensor.rate if arguments.sequence is None else arguments.sequence
    if not seconds > 0:
        raise CommandError(f"--sequence must be above 0, not {seconds:g}")
    drives = arguments.sequence is not None and arguments.pose is None and scene.drive is not None
    chosen = () if drives else (pose,)
    make = drive_through if drives else stand_still
    steps = make(scene, sensor, *chosen, seconds, smoke, arguments.seed, mode)
    truths, scans = [], []
    with SequenceWriter(arguments.output, sensor, mode) as writer:
        for step in progress(steps, scan_count(sensor, seconds), "scan"):
            truths.append(writer.add(step))
            scans.append(replace(step.scan, **_NO_POINTS))
        writer.close_tf(step)
    if arguments.truth is not None:
        _write_truth(arguments.truth, scans, truths, START_NS)


_NO_POINTS = {name: np.empty(0) for name in ("xyz", "intensity", "ring", "t", "truth", "step")}


def _write_truth(path, scans, truths, start_ns):
    """Stamps, poses and the class of each point of a bag's clouds, message after message."""
    with replacing(path) as part, open(part, "wb") as file:
        np.savez_compressed(
            file,
            stamp_ns=np.array([start_ns + int(round(1e9 * scan.stamp)) for scan in scans]),
            pose=np.array([scan.pose for scan in scans]),
            sensor_height=np.array([scan.sensor_height for scan in scans]),
            extinction=np.array([scan.extinction for scan in scans]),
            points=np.array([len(truth) for truth in truths]),
            truth=np.concatenate(truths),
        )


def _run_overlay(arguments):
    for option in ("level", "pose", "height", "sequence", "truth", *_ATTITUDE):
        if getattr(arguments, option) is not None:
            raise CommandError(f"--{option.replace('_', '-')} is for scenes, not for --overlay")
    if format_of(arguments.output) == ".bag":
        raise CommandError("--overlay writes .npz or .pcd (`smoke_ground convert` makes a bag)")
    sensor = load_sensor(arguments.sensor)
    scans = files.open_scans(arguments.overlay, arguments.topic, arguments.scan)
    files.check_room(arguments.overlay, scans, arguments.output, ["scan", "scans"])
    recorded = RecordedScan.of(next(iter(scans)), arguments.sensor_height)
    smoke = _smoke(arguments, {})
    if arguments.extinction is None:
        survival = 0.66 if arguments.survival is None else arguments.survival
        found = extinction_for_survival(
            recorded, sensor, smoke, survival, arguments.seed, arguments.mode
        )
        smoke = _of_thickness(smoke, found)
    elif arguments.survival is not None:
        raise CommandError("give either --extinction or --survival")
    else:
        smoke = _of_thickness(smoke, arguments.extinction) or smoke.with_extinction(0.0)
    result = overlay(recorded, sensor, smoke, arguments.seed, arguments.mode)
    left, floor = (
        np.count_nonzero(result["truth"] == Truth.FLOOR),
        np.count_nonzero(recorded.is_floor),
    )
    note(
        f"sensor {recorded.sensor_height:.2f} m above the floor; {left} of {floor} floor returns "
        f"survive ({100 * left / floor:.1f} %)"
    )
    _write_points(
        arguments.output,
        result,
        sensor_height=recorded.sensor_height,
        extinction=smoke.mean_extinction,
    )


def _write_points(path, points, **about):
    """One scan with its truth; `about` goes into an .npz only."""
    fields = {axis: np.ascontiguousarray(points["xyz"][:, k]) for k, axis in enumerate("xyz")}
    fields.update({name: points[name] for name in ("intensity", "ring", "t", "truth")})
    if format_of(path) == ".npz":
        with replacing(path) as part, open(part, "wb") as file:
            np.savez_compressed(file, **fields, **about)
        return
    from .. import _core

    if not hasattr(_core, "write_pcd"):
        raise CommandError(".pcd files need bindings built with PCL")
    with replacing(path) as part:
        _core.write_pcd(part, fields)
