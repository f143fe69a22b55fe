"""Score the floors in a file, which reconstruct or the nodelets wrote, and report on them."""

import numpy as np

from smoke_ground_reconstruction.evaluation import drawing, report, tables, world
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.summary import statistics
from smoke_ground_reconstruction.evaluation.yardstick import CELL_SIZES, score_floor


class ResultFile:
    """The floors of a .bag, .npz or .pcd and the scene they were made in.

    Args:
        path: of the file.
        scene, sensor, pose, level: where its scans were made, by name; the pose is at rest. The
            knowable floor is that of the smoke's pattern of seed 0.

    Raises:
        ValueError: the file holds no floor, or a name is unknown.
    """

    def __init__(self, path, scene, sensor, pose, level):
        from smoke_ground_reconstruction.io import files

        self.names = {"scene": scene, "sensor": sensor, "pose": pose, "level": level}
        self.path = path
        self._scan = world.scan(scene, sensor, pose, level, 0)
        self._truths = {cell: world.truth(scene, sensor, pose, cell, level) for cell in CELL_SIZES}
        self.scores = [self._score(floor.xyz) for floor in files.open_floors(path)]
        if not self.scores:
            raise ValueError(f"{path}: no floor in it")

    def _score(self, xyz):
        level = self._scan.to_level(xyz)
        return {f"{cell:g}": score_floor(level, truth) for cell, truth in self._truths.items()}

    def to_dict(self):
        """Scene by names, and the scores of every floor by edge of the cells."""
        floors = [
            {cell: score.to_dict() for cell, score in scores.items()} for scores in self.scores
        ]
        return dict(self.names, file=str(self.path), floors=floors)

    def table(self):
        """Mean and worst floor beside the raw cloud of one scan: a tables.Table."""
        raw = {
            cell: score.to_dict()
            for cell, score in self._score(method("raw_cloud").run(self._scan).surface).items()
        }
        rows = [
            self._row("raw cloud", [raw]),
            self._row(str(self.path), self.to_dict()["floors"]),
        ]
        cells = [f"{cell:g}" for cell in CELL_SIZES]
        return tables.floor_table("Floor of the file", rows, cells)

    def _row(self, name, floors):
        records = [{"scores": {"floor": floor, "times": {}}} for floor in floors]
        row = {"method": name, "scene": self.names["scene"], "level": self.names["level"]}
        return {**row, "failed": 0, **statistics(records, list(floors[0]))}

    def page(self):
        """One self-contained HTML page."""
        worst = int(np.argmin([scores["0.2"].counts.iou for scores in self.scores]))
        sections = [
            ("Floor", report.table_html(self.table())),
            ("Cells of the worst floor", self._picture(worst)),
        ]
        return report.page(f"Floors in {self.path}", sections)

    def _picture(self, index):
        figure, axes = drawing.new_figure(2, height=5.0)
        for panel, (cell, score) in zip(axes[0], self.scores[index].items()):
            title = f"{cell} m cells: IoU {score.counts.iou:.3f}"
            drawing.draw_classification(panel, score.grid, score.classification, title)
        drawing.finish(figure, drawing.OUTCOME_COLOURS)
        return report.figure_html(figure, f"Floor {index} of {len(self.scores)}, from above")
