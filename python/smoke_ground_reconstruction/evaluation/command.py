"""`smoke_ground evaluate`, `figures`, `tune`, `calibrate`: experiments on any method."""

import json
import warnings
from itertools import product
from pathlib import Path

from smoke_ground_reconstruction.console import CommandError, note, progress

DEFAULT_METHODS = ("raw_cloud", "polar_segments", "room_boundary")
SENSOR = "qt128"


def add_parser(subparsers):
    """Add the commands to an argparse subparsers object."""
    _add_evaluate(subparsers)
    _add_figures(subparsers)
    _add_tune(subparsers)
    _add_calibrate(subparsers)


def _add_evaluate(subparsers):
    parser = subparsers.add_parser(
        "evaluate",
        help="score methods on simulated rooms in smoke",
        description="Scores methods on simulated rooms: JSON for machines, one HTML page for"
        " people, and the tables of the thesis beside what it prints.",
    )
    parser.add_argument(
        "methods",
        nargs="*",
        metavar="METHOD",
        help="names (see --list), parameter files .yaml, or DENOISER+METHOD;"
        f" default: {' '.join(DEFAULT_METHODS)}",
    )
    parser.add_argument("--list", action="store_true", help="list methods, scenes and levels")
    parser.add_argument("--scenes", nargs="+", metavar="SCENE", help="default: all")
    parser.add_argument("--levels", nargs="+", metavar="LEVEL", help="smoke levels; default: all")
    parser.add_argument("--seeds", type=int, default=10, help="scans a scene and level")
    parser.add_argument("--poses", choices=("main", "all"), default="main")
    parser.add_argument("--sensor", default=SENSOR)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--output", default="out/evaluation", metavar="FOLDER")
    parser.add_argument(
        "--result",
        metavar="FILE",
        help="score the floors in this .bag, .npz or .pcd instead of running methods; the scene,"
        " level and pose it was made in must be given; the sensor stood still, or see --truth",
    )
    parser.add_argument("--pose", help="pose of --result; default: the scene's main pose")
    parser.add_argument(
        "--truth",
        metavar="FILE",
        help="poses and smoke of --result's scans, as `simulate --truth` wrote them for a drive",
    )
    parser.add_argument(
        "--overlay",
        nargs="+",
        metavar="SCAN",
        help="run on these recorded clear scans under simulated smoke instead of on scenes;"
        " SENSOR=FILE where the sensor is not --sensor; --levels default: heavy",
    )
    parser.set_defaults(run=run_evaluate)


def _add_figures(subparsers):
    parser = subparsers.add_parser(
        "figures",
        help="draw one figure of the thesis",
        description="Draws one figure of the thesis on simulated rooms and prints the numbers"
        " behind it as JSON.",
    )
    parser.add_argument("figure", metavar="FIGURE", help="number in the thesis, or a name")
    parser.add_argument("output", metavar="OUT.png")
    parser.add_argument("--method", default="polar_segments", help="that reconstructs the floor")
    parser.add_argument("--sensor", default=SENSOR)
    parser.add_argument("--seed", type=int, default=0, help="of the smoke")
    parser.set_defaults(run=run_figures)


def _add_tune(subparsers):
    parser = subparsers.add_parser(
        "tune",
        help="search polar_segments' best parameters on the basic room",
        description="Searches the parameters under which polar_segments does its best on the basic"
        " room in heavy smoke; this made config/polar_segments_best.yaml.",
    )
    parser.add_argument("output", metavar="OUT.yaml")
    parser.add_argument("--processes", type=int, default=2)
    parser.set_defaults(run=run_tune)


def _add_calibrate(subparsers):
    parser = subparsers.add_parser(
        "calibrate",
        help="fit room_boundary's confidence on simulated rooms",
        description="Fits the weights of room_boundary's confidence on seeds that no evaluation"
        " uses; this made config/confidence.yaml.",
    )
    parser.add_argument("output", metavar="OUT.yaml")
    parser.add_argument("--seeds", type=int, default=3, help="scans a scene and level")
    parser.add_argument("--processes", type=int, default=2)
    parser.set_defaults(run=run_calibrate)


def run_calibrate(arguments):
    """Fit the confidence. Returns the exit code."""
    from smoke_ground_reconstruction.evaluation import confidence_fit

    show = lambda items, count: progress(items, count, "scan")  # noqa: E731
    weights, cells, wrong = confidence_fit.fit(arguments.seeds, arguments.processes, show)
    confidence_fit.write(Path(arguments.output), weights, cells, wrong, arguments.seeds)
    note(f"wrote {arguments.output}: {cells} cells, {wrong} of them wrong")
    return 0


def run_tune(arguments):
    """Tune. Returns the exit code."""
    from smoke_ground_reconstruction.evaluation import tuning

    tuning.write(arguments.output, *tuning.tune(arguments.processes, note))
    note(f"wrote {arguments.output}")
    return 0


def run_figures(arguments):
    """Draw one figure. Returns the exit code."""
    from smoke_ground_reconstruction.evaluation.figures import FIGURES, Request

    if arguments.figure not in FIGURES:
        raise CommandError(f"no figure '{arguments.figure}' (there are {', '.join(FIGURES)})")
    request = Request(arguments.method, arguments.sensor, arguments.seed)
    figure, numbers = FIGURES[arguments.figure](request)
    figure.savefig(arguments.output)
    print(json.dumps(numbers, indent=2))
    note(f"wrote {arguments.output}")
    return 0


def run_evaluate(arguments):
    """Evaluate. Returns the exit code."""
    if arguments.list:
        return _list()
    if arguments.result:
        return _evaluate_result(arguments)
    if arguments.overlay:
        return _evaluate_overlay(arguments)
    from smoke_ground_reconstruction.evaluation import results
    from smoke_ground_reconstruction.evaluation.journal import Journal

    plan = _plan(arguments)
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    journal = Journal(folder / "records.partial.jsonl")
    found = results.collect(plan, _records(plan, arguments.processes, journal))
    results.write_json(found, folder / "results.json")
    journal.remove()
    tables = results.write_report(found, plan, folder / "report.html")
    print("\n\n".join(table.text() for table in tables))
    note(f"wrote {folder / 'results.json'} and {folder / 'report.html'}")
    return 0


def _records(plan, processes, journal):
    """The records of a plan; an interruption says what is kept of them."""
    from smoke_ground_reconstruction.evaluation import runner

    def bar(items, jobs):
        done = len(plan.jobs()) - jobs
        if done:
            note(f"goes on after {done} of {len(plan.jobs())} scans, from {journal.path}")
        return progress(items, jobs, "scan")

    try:
        return runner.run(plan, processes, bar, journal)
    except KeyboardInterrupt:
        kept = f"the same command goes on from {journal.path}" if journal.path.exists() else ""
        raise KeyboardInterrupt("interrupted; " + (kept or "no scan was finished")) from None


def _plan(arguments):
    from smoke_ground_reconstruction.evaluation import runner, world

    _check_numbers(arguments)
    _require_known("scene", arguments.scenes, world.scenes())
    return runner.Plan(
        methods=_methods(arguments),
        scenes=tuple(arguments.scenes or world.scenes()),
        levels=tuple(arguments.levels or world.LEVELS),
        seeds=arguments.seeds,
        poses=arguments.poses,
        sensor=arguments.sensor,
    )


def _check_numbers(arguments):
    from smoke_ground_reconstruction.evaluation import world

    _require_known("level", arguments.levels, world.LEVELS)
    for name, value in (("seeds", arguments.seeds), ("processes", arguments.processes)):
        if value < 1:
            raise CommandError(f"--{name} must be at least 1, not {value}")


def _methods(arguments):
    """Those that were asked for and can run here."""
    from smoke_ground_reconstruction.evaluation import runner

    with warnings.catch_warnings(record=True) as left_out:
        warnings.simplefilter("always")
        methods = runner.available(arguments.methods or DEFAULT_METHODS)
    for warning in left_out:
        note(str(warning.message))
    if not methods:
        raise CommandError("none of the methods can run here")
    return methods


def _require_known(kind, names, known):
    for name in names or ():
        is_file = kind == "scene" and name.endswith((".yaml", ".yml"))
        if name not in known and not is_file:
            raise CommandError(f"unknown {kind} '{name}' (known: {', '.join(known)})")


def _list():
    from smoke_ground_reconstruction.evaluation import world
    from smoke_ground_reconstruction.evaluation.methods import METHODS

    for entry in METHODS.values():
        print(f"{entry.name:22} {entry.kind:10} {entry.about}")
    print("scenes:", ", ".join(world.scenes()))
    print("levels:", ", ".join(world.LEVELS))
    return 0


def _evaluate_result(arguments):
    """Score the floors of a file against the scene they were made in."""
    from smoke_ground_reconstruction.evaluation import results, world
    from smoke_ground_reconstruction.evaluation.result_file import ResultFile

    places = _places(arguments, world)
    bar = lambda floors, number: progress(floors, number, "floor")  # noqa: E731
    found = ResultFile(arguments.result, places, bar)
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    results.write_json(found.to_dict(), folder / "results.json")
    (folder / "report.html").write_text(found.page(), encoding="utf-8")
    print(found.table().text())
    note(f"wrote {folder / 'results.json'} and {folder / 'report.html'}")
    return 0


def _places(arguments, world):
    """Where the scans of --result were made."""
    from smoke_ground_reconstruction.evaluation.result_file import AtRest, Driven

    if len(arguments.scenes or ()) != 1:
        raise CommandError("--result needs one --scenes SCENE, and one --levels LEVEL or --truth")
    scene = arguments.scenes[0]
    _require_known("scene", [scene], world.scenes())
    if arguments.truth:
        if arguments.pose or arguments.levels:
            raise CommandError("--truth tells pose and smoke: leave out --pose and --levels")
        return Driven(scene, arguments.sensor, arguments.truth)
    if len(arguments.levels or ()) != 1:
        raise CommandError("--result needs one --levels LEVEL, or --truth FILE of a drive")
    _require_known("level", arguments.levels, world.LEVELS)
    pose = arguments.pose or world.poses(scene, "main")[0]
    return AtRest(scene, arguments.sensor, pose, arguments.levels[0])


def _evaluate_overlay(arguments):
    """Score methods on recorded scans under smoke."""
    from smoke_ground_reconstruction.evaluation import overlay_report, results
    from smoke_ground_reconstruction.evaluation.overlay import Recording

    if arguments.scenes:
        raise CommandError("give either --scenes or --overlay")
    _check_numbers(arguments)
    methods, levels = _methods(arguments), arguments.levels or ["heavy"]
    recordings = [Recording.open(text, arguments.sensor) for text in arguments.overlay]
    total = len(recordings) * len(levels) * arguments.seeds * len(methods)
    made = overlay_report.records_of(recordings, methods, levels, arguments.seeds)
    records = list(progress(made, total, "result"))
    folder = Path(arguments.output)
    folder.mkdir(parents=True, exist_ok=True)
    results.write_json({"format": results.FORMAT, "records": records}, folder / "results.json")
    shown = overlay_report.table(records)
    pictures = [
        (f"{recording.name}, {level}, {name}", overlay_report.picture(recording, level, name))
        for recording, level, name in product(recordings, levels, methods)
    ]
    (folder / "report.html").write_text(overlay_report.page(shown, pictures), encoding="utf-8")
    print(shown.text())
    note(f"wrote {folder / 'results.json'} and {folder / 'report.html'}")
    return 0
