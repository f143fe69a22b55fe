"""room_boundary without single ingredients: each is missed where it should be."""

import numpy as np
import pytest

pytest.importorskip("smoke_ground_reconstruction._core", reason="the package is not built")

from smoke_ground_reconstruction.evaluation import ablation, methods, runner
from smoke_ground_reconstruction.evaluation.scoring import score_output
from smoke_ground_reconstruction.reference import room

ROOMS = {
    "columns": ("empty_room", "iou"),
    "lines": ("complex_room", "iou"),
    "plane": ("tilted_floor", "height"),
    "relief": ("step", "height"),
    "drops": ("open_pit", "precision"),
}
"""Where an ingredient is missed, and the figure that shows it."""


def figure_of(scene, name, figure):
    plan = runner.Plan((name,), (scene,), ("heavy",), seeds=1, cells=(0.2,))
    (record,) = runner.run_job(plan.jobs()[0])
    floor = record["scores"]["floor"]["0.2"]
    return -abs(floor["height"]["p95"]) if figure == "height" else floor[figure]


@pytest.mark.parametrize("ingredient", ROOMS)
def test_an_ingredient_is_missed(ingredient):
    scene, figure = ROOMS[ingredient]
    whole = figure_of(scene, "room_boundary", figure)
    assert figure_of(scene, ablation.PREFIX + ingredient, figure) < whole - 0.005


@pytest.mark.parametrize("ingredient", ablation.WITHOUT)
def test_every_ablation_runs_and_leaves_the_method_whole(ingredient):
    job = runner.Plan(("room_boundary",), ("empty_room",), ("heavy",), 1, cells=(0.2,)).jobs()[0]
    scan = runner.world.scan("empty_room", "qt128", job.pose, "heavy", 0)
    truth = {0.2: runner.world.truth("empty_room", "qt128", job.pose, 0.2, "heavy", 0)}
    before = room.find_lines, room.Room._soft
    output = methods.method(ablation.PREFIX + ingredient).run(scan)
    assert score_output(output, scan, truth)["floor"]["0.2"]["iou"] > 0.3
    assert (room.find_lines, room.Room._soft) == before


def test_a_segments_boundary_is_its_nearest_column(monkeypatch):
    """Two segments of 25 columns, 2 to 4.4 m far; a third without any wall."""
    distance = np.r_[np.linspace(2.0, 4.4, 25), np.linspace(4.4, 2.0, 25), np.zeros(25)]
    profile = ablation.wall_profile.Profile(distance, np.zeros(75, int), np.arange(75))
    monkeypatch.setattr(ablation, "_column_profile", lambda: profile)
    found = ablation._least_distance()
    assert found.distance.tolist() == [2.0] * 50 + [0.0] * 25
