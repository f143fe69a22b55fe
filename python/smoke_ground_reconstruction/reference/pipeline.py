"""The stages in order: what the three nodelets do between them."""

from dataclasses import dataclass
from time import perf_counter
from typing import Dict, Optional

import numpy as np

from ..params import Params
from .agdor_filter import AgdorFilter
from .channel_segmentation import ChannelSegmentation
from .floor_surface import FloorSurface, OccupancyGrid
from .label import NO_CLUSTER, Label
from .occupancy import rasterize
from .polar_segments import PolarSegments
from .room_boundary import RoomBoundary
from .scan import Mounting, Scan, ScanView
from .sensor_model import SensorModel
from .visibility import UNKNOWN, Visibility
from .wall_clustering import WallClustering


@dataclass
class PipelineResult:
    """What comes out of one scan.

    Attributes
    ----------
    labels : (N,) uint8
        Label per input point, after segmentation.
    clusters : (N,) uint32
        Wall cluster per input point, or NO_CLUSTER.
    surface : FloorSurface
    occupancy : OccupancyGrid
    visibility : Visibility
        Unknown with `polar_segments`.
    times : dict
        Milliseconds of wall time per stage, in the order of work.
    """

    labels: np.ndarray
    clusters: np.ndarray
    surface: FloorSurface
    occupancy: OccupancyGrid
    visibility: Visibility
    times: Dict[str, float]


class Pipeline:
    """Runs the stages. Thesis: Section 3.1, Figure 3.1.

    ``sensor`` learns the rings' order from each scan; seed it by assigning a SensorModel.
    Raises ValueError on bad parameters.
    """

    def __init__(self, params: Params):
        params.validate()
        self.params = params
        self.sensor = SensorModel()
        self._denoiser = AgdorFilter(params.denoiser)
        self._segmentation = ChannelSegmentation(params.segmenter)
        self._clustering = WallClustering(params.segmenter)
        self._polar_segments = PolarSegments(params.reconstructor)
        self._room_boundary = RoomBoundary(params.reconstructor)

    def process(self, view: ScanView, mounting: Optional[Mounting] = None) -> PipelineResult:
        """Work through one scan, in the sensor frame; without `mounting` a level sensor at
        ``reconstructor.sensor_height``."""
        if mounting is None:
            mounting = Mounting(sensor_height=self.params.reconstructor.sensor_height)
        if self.params.reconstructor.method == "room_boundary":
            return self._process_room(view, mounting)
        watch = _Stopwatch()
        self.sensor.observe(view)
        scan = Scan(view)  # the denoiser knows nothing of the mounting
        level = Scan(view, mounting)
        watch.lap("organise")
        denoised = self._denoiser.classify(scan)
        watch.lap("denoise")
        labels = self._segmentation.classify(level, denoised, self.sensor)
        watch.lap("segment")
        clusters = self._clustering.cluster(level, labels)
        watch.lap("cluster")
        ground, walls = view.select(labels == Label.GROUND), view.select(clusters != NO_CLUSTER)
        surface = self._polar_segments.reconstruct(ground, walls, self.sensor, mounting)
        watch.lap("reconstruct")
        resolution = self.params.reconstructor.occupancy_resolution
        occupancy = rasterize(surface, walls, mounting, resolution)
        watch.lap("rasterize")
        return PipelineResult(labels, clusters, surface, occupancy, UNKNOWN, watch.times)

    def _process_room(self, view, mounting):
        """`room_boundary` denoises and segments by itself; it has no clusters."""
        watch = _Stopwatch()
        self.sensor.observe(view)
        watch.lap("organise")
        room = self._room_boundary.reconstruct(view, self.sensor, mounting)
        watch.lap("reconstruct")
        walls = view.select(room.labels == Label.WALL)
        resolution = self.params.reconstructor.occupancy_resolution
        occupancy = rasterize(room.surface, walls, mounting, resolution)
        watch.lap("rasterize")
        clusters = np.full(len(view.xyz), NO_CLUSTER, np.uint32)
        return PipelineResult(
            room.labels, clusters, room.surface, occupancy, room.visibility, watch.times
        )


class _Stopwatch:
    def __init__(self):
        self.times = {}
        self._last = perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self.times[stage] = (now - self._last) * 1e3
        self._last = now
