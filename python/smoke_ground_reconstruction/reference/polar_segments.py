"""Wall-based reconstruction on a polar grid, the thesis's own method.

Thesis: Section 3.4, Eq. 3.1, Algorithms 3 and 5, Table A.1.
"""

import math
from dataclasses import dataclass

import numpy as np

from ..params import PolarSegmentsParams
from .azimuth_bins import AzimuthBins
from .floor_surface import BoundaryKind, FloorSurface, Provenance
from .predicates import Direction, planar_range, range_
from .scan import Mounting, Scan, ScanView
from .sensor_model import SensorModel

# Measured floor that ends this near to the wall ends at the wall [m].
_WALL_CONTACT = 0.2


@dataclass
class PolarSegment:
    """What is known of one segment of the polar grid (Algorithm 5, Steps 1-3), level frame."""

    wall_points: int = 0
    ground_points: int = 0
    lowest_z: float = 0.0  #: of the wall points [m]
    rings_below_wall: int = 0  #: number of rings below the wall's lowest ring
    min_distance: float = 0.0  #: to the wall [m]
    has_wall: bool = False
    keeps_measured: bool = False  #: ground points stay; else the segment is reconstructed
    adjusted_z: float = 0.0  #: floor height at the wall after Step 3 [m]


class PolarSegments:
    """The floor of each 10 deg segment: its measured points, or rings drawn up to its wall.

    Raises ValueError on bad parameters.
    """

    def __init__(self, params: PolarSegmentsParams):
        PolarSegmentsParams.validate(params)
        self.params = params
        self._bins = AzimuthBins(params.segment_angle_deg)

    def reconstruct(
        self, ground: ScanView, walls: ScanView, sensor: SensorModel, mounting: Mounting
    ) -> FloorSurface:
        """The floor from segmented points. Algorithm 5 lines 35-38.

        Measured points come first, in input order, then reconstructed points by segment, radius and
        azimuth. Confidence: 1 where measured; where reconstructed the share of the segment's
        azimuth steps in which a wall point was seen (a support, not a probability).

        Parameters
        ----------
        ground, walls : ScanView
            In the sensor frame; the walls are the clustered ones.
        sensor : SensorModel
        mounting : Mounting
        """
        level_ground, level_walls = Scan(ground, mounting), Scan(walls, mounting)
        segments = self.segments(level_ground, level_walls, sensor, mounting)
        support = self._wall_support(level_walls)
        parts = [self._measured(ground, level_ground, segments)]
        for number, segment in enumerate(segments):
            if not segment.keeps_measured:
                parts.append(self._drawn(number, segment, support[number], sensor, mounting))
        columns = [np.concatenate(column) for column in zip(*parts)]
        outline = _outline(self._reach_of(segments, level_ground, mounting), mounting)
        return FloorSurface(*columns, *outline, _level_plane(mounting))

    def segments(self, ground: Scan, walls: Scan, sensor: SensorModel, mounting: Mounting):
        """The polar grid, a list of PolarSegment. Algorithm 5, Steps 1 to 3."""
        segments = self._step_1(ground, walls, sensor)
        for segment in segments:
            self._step_2(segment)
        self._step_3(segments, -mounting.sensor_height)
        return segments

    def _step_1(self, ground, walls, sensor):
        """Minima over the wall points of each segment, each on its own; points counted.

        Reading: rings count in elevation order, so the "lowest ring" is a rank, and the number of
        rings below the wall is what Eq. 3.1 and Algorithm 3 call the ring value.
        Points whose ring has no rank are left out.
        """
        rank = sensor.rank(walls.ring).astype(np.int64)
        usable = np.flatnonzero(walls.valid & (rank != SensorModel.NO_RANK))
        distance = self._distance_of(walls.xyz)
        wall_segment = self._segment_of(walls, usable)
        ground_segment = self._segment_of(ground, np.flatnonzero(ground.valid))
        segments = []
        for number in range(self._bins.count()):
            points = usable[wall_segment == number]
            segment = PolarSegment(len(points), np.count_nonzero(ground_segment == number))
            if len(points) > 0:
                segment.lowest_z = float(walls.xyz[points, 2].min())  # line 16
                segment.rings_below_wall = int(rank[points].min())  # line 17
                segment.min_distance = float(distance[points].min())  # line 23
            segments.append(segment)
        return segments

    def _distance_of(self, xyz):
        return range_(xyz) if self.params.wall_distance == "range" else planar_range(xyz)

    def _segment_of(self, scan, points):
        return self._bins.index(scan.xyz[points, 0], scan.xyz[points, 1])

    def _step_2(self, segment):
        """Eq. 3.1: strictly more ground points than expected keep the measured points.

        Reading: a segment with fewer than ``min_wall_points`` has no wall, keeps its measured
        ground and reconstructs nothing.
        """
        p = self.params
        segment.has_wall = segment.wall_points >= p.min_wall_points
        steps = p.segment_angle_deg / p.horizontal_resolution_deg
        expected_points = segment.rings_below_wall * steps * p.reconstruction_gain
        segment.keeps_measured = not segment.has_wall or segment.ground_points > expected_points

    def _step_3(self, segments, origin_z):
        """Heights of the walls' feet of the segments to be reconstructed, on unadjusted values.

        Reading: the prose of Section 3.4; the else-branch of the listing (lines 26-32) contradicts
        it. Higher than the lower neighbour by more than the threshold: that one's height. Then, if
        steeper than the limit seen from the sensor's foot: `origin_z`. Else untouched. Indices
        wrap, neighbours without wall are ignored.
        Deviation: the limit is printed as "5 %" in Table A.1 and as 5 deg in line 28: degrees.
        Deviation: line 21 prints origin_z = -0.70 m; here minus the sensor's height.
        """
        steepest = Direction.from_degrees(self.params.max_elevation_angle_deg)
        for number, segment in enumerate(segments):
            z = segment.lowest_z
            if not segment.keeps_measured:
                beside = (segments[number - 1], segments[(number + 1) % len(segments)])
                lower = min((s.lowest_z for s in beside if s.has_wall), default=math.inf)
                if z - lower > self.params.height_difference_threshold:
                    z = lower
                if steepest.cosine * abs(z - origin_z) > steepest.sine * segment.min_distance:
                    z = origin_z
            segment.adjusted_z = z

    def _measured(self, ground, level_ground, segments):
        keeps = np.array([segment.keeps_measured for segment in segments])
        valid = np.flatnonzero(level_ground.valid)
        view = ground.select(valid[keeps[self._segment_of(level_ground, valid)]])
        ones = np.ones(len(view.xyz), np.float32)
        return *view, np.full(len(ones), Provenance.MEASURED, np.uint8), ones

    def _drawn(self, number, segment, support, sensor, mounting):
        """Algorithm 3 for one segment.

        Reading: n radii from 0 to the wall, both ends, for the n rings below the wall, and heights
        with the radius' index (the printed z_values[i] is a misprint); azimuths with both ends of
        the segment. Radius 0 is one point, not one per azimuth. Point j carries the j-th ring.
        """
        n = segment.rings_below_wall
        radii = np.linspace(0.0, segment.min_distance, n)  # line 4
        heights = np.linspace(-mounting.sensor_height, segment.adjusted_z, n)  # line 5
        azimuths = np.radians(self._azimuths_of(number))  # line 6
        ring = np.repeat(np.arange(n), len(azimuths))[len(azimuths) - 1 :]
        azimuth = np.tile(azimuths, n)[len(azimuths) - 1 :]
        x, y = radii[ring] * np.cos(azimuth), radii[ring] * np.sin(azimuth)  # lines 8 and 9
        xyz = np.stack([x, y, heights[ring]], axis=1).astype(np.float32)
        return (
            mounting.to_sensor(xyz),
            np.zeros(len(xyz), np.float32),
            sensor.rings_by_elevation()[ring],
            np.full(len(xyz), Provenance.RECONSTRUCTED, np.uint8),
            np.full(len(xyz), support, np.float32),
        )

    def _azimuths_of(self, number):
        """Azimuths of a segment [deg] in steps of the horizontal resolution, both ends included."""
        width, step = 360.0 / self._bins.count(), self.params.horizontal_resolution_deg
        whole_steps = math.floor(width / step + 1e-9)
        offsets = [i * step for i in range(whole_steps + 1)]
        if width - whole_steps * step > 1e-9:
            offsets.append(width)
        return number * width + np.array(offsets)

    def _wall_support(self, walls):
        """Share of each segment's azimuth steps in which a wall point was seen, float32."""
        width = 360.0 / self._bins.count()
        steps = max(1, math.floor(width / self.params.horizontal_resolution_deg + 1e-9))
        bins = AzimuthBins(360.0 / (self._bins.count() * steps))
        seen = np.zeros(bins.count(), bool)
        seen[bins.index(walls.xyz[walls.valid, 0], walls.xyz[walls.valid, 1])] = True
        return seen.reshape(-1, steps).mean(axis=1).astype(np.float32)

    def _reach_of(self, segments, ground, mounting):
        """How far each segment's claimed floor reaches: radius, z and BoundaryKind."""
        valid = np.flatnonzero(ground.valid)
        farthest = np.zeros(len(segments))
        np.maximum.at(farthest, self._segment_of(ground, valid), planar_range(ground.xyz[valid]))
        nothing = (0.0, -mounting.sensor_height, BoundaryKind.LIMIT_OF_KNOWLEDGE)
        reach = []
        for segment, radius in zip(segments, farthest):
            if segment.keeps_measured:
                nearly = segment.min_distance - _WALL_CONTACT
                at_wall = segment.has_wall and radius > 0.0 and radius >= nearly
                kind = BoundaryKind.WALL_SEEN if at_wall else BoundaryKind.LIMIT_OF_KNOWLEDGE
                reach.append((radius, -mounting.sensor_height, kind))
            elif segment.rings_below_wall >= 2:
                reach.append((segment.min_distance, segment.adjusted_z, BoundaryKind.WALL_SEEN))
            else:
                reach.append(nothing)
        return reach


def _outline(reach, mounting):
    """Two vertices a segment, at its ends; the sensor's foot once where segments in a row claim
    nothing. Where the outline is torn the first end stands twice, the second time as a limit of
    knowledge: the edge along the line of sight that follows is no wall that anybody saw.
    Returns boundary (K, 3) float32 and boundary_kind (K,) uint8."""
    width = 2.0 * math.pi / len(reach)
    vertices = []  # number of the segment's end, radius, z, kind
    for number, (radius, z, kind) in enumerate(reach):
        foot_stands = number > 0 and reach[number - 1][0] == 0.0
        if radius > 0.0 or not foot_stands:
            vertices.append((number, radius, z, kind))
        if radius > 0.0:
            vertices.append((number + 1, radius, z, kind))
        if _is_torn(reach[number], reach[(number + 1) % len(reach)]):
            vertices.append((number + 1, radius, z, BoundaryKind.LIMIT_OF_KNOWLEDGE))
    if all(radius == 0.0 for radius, _, _ in reach):
        vertices = []
    end, radius, z, kind = np.array(vertices, np.float64).reshape(-1, 4).T
    x, y = radius * np.cos(end * width), radius * np.sin(end * width)
    boundary = np.stack([x, y, z], axis=1).astype(np.float32)
    return mounting.to_sensor(boundary), kind.astype(np.uint8)


def _is_torn(before, after):
    """Are walls of both segments seen, but at different distances?"""
    walls = before[2] == BoundaryKind.WALL_SEEN and after[2] == BoundaryKind.WALL_SEEN
    return walls and abs(before[0] - after[0]) > _WALL_CONTACT


def _level_plane(mounting):
    r = mounting.rotation
    return np.array([-r[2, 0], -r[2, 1], -mounting.sensor_height]) / r[2, 2]
