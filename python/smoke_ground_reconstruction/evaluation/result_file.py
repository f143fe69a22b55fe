"""Score the floors in a file, which reconstruct or the nodelets wrote, and report on them."""

import numpy as np

from smoke_ground_reconstruction.evaluation import drawing, report, tables, world
from smoke_ground_reconstruction.evaluation.methods import method
from smoke_ground_reconstruction.evaluation.summary import statistics
from smoke_ground_reconstruction.evaluation.yardstick import CELL_SIZES, score_floor, to_level


class AtRest:
    """Where the floors of a file were seen: at one pose of a scene, by name.

    The knowable floor is that of the smoke's pattern of seed 0.
    """

    def __init__(self, scene, sensor, pose, level):
        self.names = {"scene": scene, "sensor": sensor, "pose": pose, "level": level}
        self._scan = world.scan(scene, sensor, pose, level, 0)
        self._truths = {cell: world.truth(scene, sensor, pose, cell, level) for cell in CELL_SIZES}

    def of(self, stamp_ns):
        """T_world_sensor (4, 4), and FloorTruth by edge of the cells, whatever the stamp."""
        return self._scan.T_world_sensor, self._truths

    def raw_cloud(self):
        """The floor points of one scan there, (N, 3) in the sensor frame [m]."""
        return method("raw_cloud").run(self._scan).surface


class Driven:
    """Where the floors of a file were seen: along the way of a simulated bag.

    Args:
        scene, sensor: by name.
        path: of the .npz that `simulate --truth` wrote beside the bag.

    Raises:
        ValueError: the file is another kind of file.
    """

    def __init__(self, scene, sensor, path):
        with np.load(path) as stored:
            missing = {"stamp_ns", "pose", "sensor_height", "extinction"} - set(stored.files)
            if missing:
                raise ValueError(f"{path}: lacks {', '.join(sorted(missing))}: not by --truth")
            self._places = {
                int(stamp): (pose, float(height), float(extinction))
                for stamp, pose, height, extinction in zip(
                    *(stored[name] for name in ("stamp_ns", "pose", "sensor_height", "extinction"))
                )
            }
        self.names = {"scene": scene, "sensor": sensor, "pose": "along the way", "level": "driven"}
        self._path = path

    def of(self, stamp_ns):
        """T_world_sensor (4, 4), and FloorTruth by edge of the cells, of one scan.

        Raises:
            ValueError: the bag of the truth has no scan of that stamp.
        """
        if stamp_ns not in self._places:
            raise ValueError(f"{self._path}: no scan of stamp {stamp_ns} ns, which a floor has")
        matrix, height, extinction = self._places[stamp_ns]
        names = self.names["scene"], self.names["sensor"]
        truths = {
            cell: world.truth_at(*names, matrix, height, extinction, cell) for cell in CELL_SIZES
        }
        return matrix, truths

    def raw_cloud(self):
        """None: a scan there is not simulated again."""
        return None


class ResultFile:
    """The floors of a .bag, .npz or .pcd and the places where their scans were made.

    Args:
        path: of the file.
        places: AtRest or Driven.
        progress: wraps the iterator over floors; gets their number, too.

    Raises:
        ValueError: the file holds no floor, or places has none for it.
    """

    def __init__(self, path, places, progress=lambda floors, number: floors):
        from smoke_ground_reconstruction.io import files

        self.names, self.path, self._places = places.names, path, places
        floors = files.open_floors(path)
        self.scores = [
            self._score(floor.xyz, floor.stamp_ns) for floor in progress(floors, len(floors))
        ]
        if not self.scores:
            raise ValueError(f"{path}: no floor in it")

    def _score(self, xyz, stamp_ns=None):
        matrix, truths = self._places.of(stamp_ns)
        level = to_level(xyz, matrix)
        return {f"{cell:g}": score_floor(level, truth) for cell, truth in truths.items()}

    def to_dict(self):
        """Scene by names, and the scores of every floor by edge of the cells."""
        floors = [
            {cell: score.to_dict() for cell, score in scores.items()} for scores in self.scores
        ]
        return dict(self.names, file=str(self.path), floors=floors)

    def table(self):
        """Mean and worst floor, at rest beside the raw cloud of one scan: a tables.Table."""
        rows = [self._row(str(self.path), self.to_dict()["floors"])]
        raw = self._places.raw_cloud()
        if raw is not None:
            scores = {cell: score.to_dict() for cell, score in self._score(raw).items()}
            rows.insert(0, self._row("raw cloud", [scores]))
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
