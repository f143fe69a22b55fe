"""`smoke_ground benchmark`: what each stage and engine costs, as a table and a plot."""

import argparse
import json
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Sequence

import numpy as np

from smoke_ground_reconstruction.console import CommandError, note, progress

POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2")])
"""A point as benchmark/stage_times.cpp reads it."""

SENSORS = ("qt128/8", "qt128/4", "qt128/2", "qt128", "vlp16", "vlp32c", "os0_128")
"""16 to 128 rings; `/2` keeps every other ring."""

LEVELS = ("clear", "light", "heavy", "very_heavy")
OTHERS = ("PCL", "nanoflann", "Patchwork++")
MAIN_SENSOR, MAIN_LEVEL = "qt128", "heavy"


@dataclass(frozen=True)
class Case:
    """Scans of one kind.

    Attributes
    ----------
    name : what they are
    scans : records of POINT, one array a scan
    """

    name: str
    scans: List[np.ndarray]


def add_parser(subparsers) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "benchmark",
        help="time every stage and engine",
        description="Times every stage and engine on simulated scans and on those of files: "
        "medians and 99th percentiles of thread CPU time, wall time beside. Writes results.json, "
        "results.md and results.png.",
    )
    parser.add_argument("--output", default="benchmark_results", metavar="DIR")
    parser.add_argument("--scene", default="basic_room", help="simulated room (%(default)s)")
    parser.add_argument("--sensors", nargs="*", default=SENSORS, metavar="SENSOR")
    parser.add_argument("--levels", nargs="*", default=LEVELS, metavar="LEVEL")
    parser.add_argument("--no-dual", action="store_true", help="leave dual returns out")
    parser.add_argument("--input", nargs="*", default=(), metavar="FILE", help="recorded scans")
    parser.add_argument("--seeds", type=int, default=3, help="simulated scans of a kind")
    parser.add_argument("--runs", type=int, default=1000, help="calls of a stage (%(default)s)")
    parser.add_argument(
        "--reference-runs", type=int, default=10, help="calls of a tree (%(default)s)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    if min(arguments.seeds, arguments.runs, arguments.reference_runs) < 1:
        raise CommandError("--seeds, --runs and --reference-runs must be at least 1")
    program = stage_times()
    cases = list(_cases(arguments))
    if not cases:
        raise CommandError("nothing to time: give --sensors or --input")
    results = {}
    for case in progress(cases, len(cases), "case"):
        results[case.name] = timed(program, case, arguments.runs, arguments.reference_runs)
        results[case.name]["stages"].append(patchworkpp(case, arguments.reference_runs))
    output = Path(arguments.output)
    output.mkdir(parents=True, exist_ok=True)
    (output / "results.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (output / "results.md").write_text(as_markdown(results), encoding="utf-8")
    plot(results).savefig(str(output / "results.png"))
    note(f"wrote {output}/results.md, results.png and results.json")


def stage_times() -> Path:
    """The compiled program that does the timing, beside the compiled module.

    Raises
    ------
    CommandError : it was not built.
    """
    from smoke_ground_reconstruction import _core

    for parent in Path(_core.__file__).resolve().parents:
        if (parent / "benchmark" / "stage_times").is_file():
            return parent / "benchmark" / "stage_times"
    raise CommandError(
        "the benchmarks are not built: run scripts/setup in a checkout "
        "(CMake option SMOKE_GROUND_WITH_BENCHMARKS)"
    )


def timed(program: Path, case: Case, runs: int, reference_runs: int) -> dict:
    """What the program says of a case: see report() in benchmark/stage_times.cpp."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [str(Path(folder) / f"{number}.bin") for number in range(len(case.scans))]
        for path, scan in zip(paths, case.scans):
            scan.tofile(path)
        command = [str(program), str(runs), str(reference_runs), *paths]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise CommandError(f"{case.name}: {done.stderr.strip() or 'stage_times failed'}")
    return json.loads(done.stdout)


def patchworkpp(case: Case, runs: int, ground: Optional[Callable] = None) -> dict:
    """Patchwork++ on a case, ground alone, its object and the copies of its binding included.

    `ground` stands in for evaluation.baselines.ground.patchworkpp. Where that is not installed the
    row has no times but the reason under "absent".
    """
    from smoke_ground_reconstruction.evaluation.baselines import ground as baseline
    from smoke_ground_reconstruction.evaluation.baselines.native import BaselineUnavailableError

    row = {"stage": "segment", "engine": "Patchwork++", "runs": runs}
    scans = [
        (np.stack([scan[axis] for axis in "xyz"], 1), scan["intensity"]) for scan in case.scans
    ]
    times = []
    try:
        for number in range(-len(scans), runs):  # a first round to warm up
            xyz, intensity = scans[number % len(scans)]
            begin = time.thread_time_ns(), time.perf_counter_ns()
            (ground or baseline.patchworkpp)(xyz, intensity, 0.7)
            end = time.thread_time_ns(), time.perf_counter_ns()
            if number >= 0:
                times.append((end[0] - begin[0], end[1] - begin[1]))
    except BaselineUnavailableError as error:
        return {**row, "absent": str(error)}
    cpu, wall = 1e-6 * np.sort(np.array(times), axis=0).T
    return {**row, "cpu_ms": _percentiles(cpu), "wall_ms": _percentiles(wall)}


def _percentiles(times: np.ndarray) -> dict:
    """As percentiles() in benchmark/stage_times.cpp, of sorted times."""
    return {f"p{p}": times[-(-p * len(times) // 100) - 1] for p in (50, 99)}


def _cases(arguments: argparse.Namespace) -> Iterator[Case]:
    for sensor in arguments.sensors:
        yield _simulated(arguments, sensor, MAIN_LEVEL)
    if MAIN_SENSOR in arguments.sensors:
        for level in arguments.levels:
            if level != MAIN_LEVEL:
                yield _simulated(arguments, MAIN_SENSOR, level)
        if not arguments.no_dual:
            yield _simulated(arguments, MAIN_SENSOR, MAIN_LEVEL, mode="dual")
    for path in arguments.input:
        yield _recorded(path)


def _simulated(arguments, sensor_name: str, level: str, mode=None) -> Case:
    from smoke_ground_reconstruction import simulation
    from smoke_ground_reconstruction.evaluation import world
    from smoke_ground_reconstruction.simulation.levels import level_smoke

    name, _, every = sensor_name.partition("/")
    scene, sensor = simulation.load_scene(arguments.scene), simulation.load_sensor(name)
    pose = scene.pose(world.poses(arguments.scene, "main")[0])
    smoke = level_smoke(scene, sensor, pose, level)
    scans = []
    for seed in range(arguments.seeds):
        scan = simulation.simulate(scene, sensor, pose, smoke, seed, mode)
        rank = np.argsort(np.argsort(sensor.elevation_deg))[scan.ring]
        scans.append(packed(scan, rank % int(every or 1) == 0))
    title = f"{sensor_name} {level.replace('_', ' ')}" + (f" {mode}" if mode else "")
    return Case(title, scans)


def _recorded(path: str) -> Case:
    from smoke_ground_reconstruction.io import files

    scans = [packed(scan, np.ones(len(scan.ring), bool)) for scan in files.open_scans(path)]
    file = Path(path).resolve()  # a sensor's folder, and the scan
    return Case(f"{file.parent.name}/{file.stem}", scans)


def packed(scan, chosen: np.ndarray) -> np.ndarray:
    """The chosen points, (N,) bool, of a scan as records of POINT."""
    points = np.zeros(np.count_nonzero(chosen), POINT)
    for axis, name in enumerate("xyz"):
        points[name] = scan.xyz[chosen, axis]
    points["intensity"] = scan.intensity[chosen]
    points["ring"] = scan.ring[chosen]
    return points


def as_markdown(results: dict) -> str:
    """Two tables: the main case in full, and the medians of all cases."""
    main = f"{MAIN_SENSOR} {MAIN_LEVEL}"
    main = main if main in results else next(iter(results))
    lines = [f"Thread CPU time and wall time [ms], {main}: {_described(results[main])}.", ""]
    head = ("stage", "engine", "CPU p50", "CPU p99", "wall p50", "wall p99", "PCL / this")
    lines += _table(
        (*head, "allocations", "kB allocated", "kB touched"),
        (_full_row(stage, results[main]) for stage in results[main]["stages"]),
    )
    lines += ["", "Median thread CPU time [ms] of every kind of scan.", ""]
    lines += _table(
        ("stage", "engine", *results),
        (_median_row(stage, results) for stage in results[main]["stages"]),
    )
    points = [f"{_count(result['points'])}" for result in results.values()]
    lines.append(f"| points | | {' | '.join(points)} |")
    return "\n".join(lines) + "\n"


def _described(result: dict) -> str:
    return (
        f"{_count(result['points'])} points, {_count(result['dark_points'])} of intensity below "
        f"25, {_count(result['wall_points'])} on walls"
    )


def _count(number: int) -> str:
    return f"{number:,}"


def _table(head: Sequence[str], rows) -> List[str]:
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return lines + [f"| {' | '.join(row)} |" for row in rows]


def _full_row(stage: dict, result: dict) -> List[str]:
    if "absent" in stage:
        return [stage["stage"], stage["engine"], "not installed", *[""] * 7]
    reference = _of(result, stage["stage"], "PCL")
    ratio = ""
    if reference is not None and reference is not stage:
        ratio = f"{reference['cpu_ms']['p50'] / stage['cpu_ms']['p50']:.0f}"
    times = [stage[clock][share] for clock in ("cpu_ms", "wall_ms") for share in ("p50", "p99")]
    sizes = [stage.get(f"{kind}_bytes") for kind in ("allocated", "touched")]
    memory = [stage.get("allocations"), *(None if size is None else size // 1000 for size in sizes)]
    counts = ["" if number is None else _count(number) for number in memory]
    return [stage["stage"], stage["engine"], *(f"{time:.2f}" for time in times), ratio, *counts]


def _median_row(stage: dict, results: dict) -> List[str]:
    cells = [stage["stage"], stage["engine"]]
    for result in results.values():
        same = _of(result, stage["stage"], stage["engine"])
        is_timed = same is not None and "absent" not in same
        cells.append(f"{same['cpu_ms']['p50']:.2f}" if is_timed else "")
    return cells


def _of(result: dict, stage: str, engine: str):
    for candidate in result["stages"]:
        if (candidate["stage"], candidate["engine"]) == (stage, engine):
            return candidate
    return None


def plot(results: dict):
    """Cost against points: a panel for our stages, one for the trees; lines through the origin.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from smoke_ground_reconstruction.evaluation import drawing

    figure, axes = drawing.new_figure(2, width=5.6)
    first = next(iter(results.values()))["stages"]
    stages = [(s["stage"], s["engine"]) for s in first if "absent" not in s]
    for axis, is_other in zip(axes[0], (False, True)):
        chosen = [key for key in stages if (key[1] in OTHERS) == is_other]
        for number, key in enumerate(chosen):
            _plot_stage(axis, f"C{number % 10}", "os"[number // 10], key, results)
        axis.set_xlim(left=0)
        axis.set_ylim(bottom=0)
        axis.set_xlabel("points of the scan [thousands]")
        axis.set_ylabel("median thread CPU time [ms]")
        axis.set_title("others to compare with" if is_other else "ours", fontsize=10)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=6)
    drawing.finish(figure)
    return figure


def _plot_stage(axis, colour: str, marker: str, key, results: dict) -> None:
    pairs = [(result["points"] / 1000, _of(result, *key)) for result in results.values()]
    pairs = sorted((x, same["cpu_ms"]["p50"]) for x, same in pairs if same is not None)
    axis.plot(*zip(*pairs), marker, color=colour, markersize=4, label=", ".join(filter(None, key)))
    slope = np.median([time / points for points, time in pairs])
    axis.plot([0, pairs[-1][0]], [0, slope * pairs[-1][0]], "-", color=colour, linewidth=0.8)
