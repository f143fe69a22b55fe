"""Channel-based ground and wall segmentation. Thesis: Section 3.3, Algorithm 4."""

from typing import NamedTuple

import numpy as np

from ..params import ChannelSegmentationParams
from .azimuth_bins import AzimuthBins
from .label import Label
from .predicates import AngleWindow, planar_range, range_, squared_distance
from .scan import Scan, ScanColumns
from .sensor_model import SensorModel


class ChannelSegmentation:
    """Labels ground and walls by pairs of points of consecutive rings in a column.

    "Channel" is the thesis's word for ring.

    Reading: columns by each point's own azimuth, rings in elevation order; a pair joins a point
    with the nearest point of the next higher ring that is present in its column (ties: the lower
    index), never with one of its own ring.
    Reading: the printed arcsin(h / d) cannot exceed 90 deg. The angle of (h, signed horizontal
    step) equals it up to 90 deg and gives the printed wall window 60..120 deg a meaning.
    Reading: a point that passes as wall and as ground is a wall: a missing floor is safer than a
    wrong one.

    Raises ValueError on bad parameters.
    """

    def __init__(self, params: ChannelSegmentationParams):
        ChannelSegmentationParams.validate(params)
        self.params = params
        self._columns = AzimuthBins(params.column_width_deg)

    def classify(self, scan: Scan, labels, sensor: SensorModel):
        """One label per point, uint8 (N,).

        INVALID and NOISE stay; KEPT turns into GROUND or WALL where a pair says so.

        Parameters
        ----------
        scan : Scan
        labels : (N,) uint8
            The denoiser's answer; only KEPT points are looked at.
        sensor : SensorModel
            Order of the rings.
        """
        columns = ScanColumns(scan, labels == Label.KEPT, self._columns, sensor)
        first, second = pair_up(scan, columns)
        steps = Steps.between(scan.xyz[first], scan.xyz[second])
        labeled = first if self.params.label_point == "first" else second
        answer = np.array(labels, np.uint8)
        answer[labeled[self._is_ground(steps)]] = Label.GROUND
        answer[labeled[self._is_wall(steps)]] = Label.WALL
        return answer

    def _is_ground(self, steps):
        p = self.params
        window = AngleWindow.from_degrees(p.min_ground_angle_deg, p.max_ground_angle_deg)
        return (
            window.contains(steps.horizontal, steps.height)
            & _is_low_enough(steps, p.max_ground_step_height)
            & self._passes_range_step(steps, p.ground_range_step)
            & self._passes_margin(steps, p.ground_relative_margin)
        )

    def _is_wall(self, steps):
        p = self.params
        window = AngleWindow.from_degrees(p.min_wall_angle_deg, p.max_wall_angle_deg)
        return (
            window.contains(steps.horizontal, steps.height)
            & _is_low_enough(steps, p.max_wall_step_height)
            & self._passes_range_step(steps, p.wall_range_step)
            & self._passes_margin(steps, p.wall_relative_margin)
        )

    def _passes_range_step(self, steps, rule):
        # Algorithm 4 line 11; 'increasing' is the original form of Chu et al. (2017).
        if rule == "minimum":
            return steps.range_step >= self.params.min_range_step
        if rule == "increasing":
            return steps.range_step > 0.0
        return True

    def _passes_margin(self, steps, is_on):
        # Table A.1, "Relative distance margin 15 %".
        if not is_on:
            return True
        return np.abs(steps.range_step) <= self.params.relative_distance_margin * steps.first_range


def _is_low_enough(steps, max_height):
    # Algorithm 4 line 7; printed both as h_min and as h_max.
    return True if max_height == 0.0 else np.abs(steps.height) <= max_height


class Steps(NamedTuple):
    """From the first to the second point of each pair, float64 (M,) each [m]."""

    height: np.ndarray  #: h = z(i+1) - z(i), Algorithm 4 line 2
    horizontal: np.ndarray  #: sqrt(dx^2 + dy^2), negative where the planar range shrinks
    range_step: np.ndarray  #: r(i+1) - r(i)
    first_range: np.ndarray  #: r(i)

    @classmethod
    def between(cls, first, second):
        """Steps from float32 (M, 3) points to float32 (M, 3) points."""
        dx, dy, dz = (second.astype(np.float64) - first.astype(np.float64)).T
        length = np.sqrt(dx * dx + dy * dy)
        goes_inward = planar_range(second) < planar_range(first)
        first_range = range_(first)
        return cls(
            height=dz,
            horizontal=np.where(goes_inward, -length, length),
            range_step=range_(second) - first_range,
            first_range=first_range,
        )


def pair_up(scan: Scan, columns: ScanColumns):
    """Pairs of consecutive rings: every point with the nearest one of the next ring present.

    Returns
    -------
    first, second : (M,) int64
        Point indices; `second` is of the higher ring. Points of a column's highest ring have no
        partner and are left out.
    """
    order = columns.order
    if len(order) == 0:
        return order, order
    is_new = (np.diff(columns.column) != 0) | (np.diff(columns.rank) != 0)
    begin = np.concatenate([[0], np.flatnonzero(is_new) + 1])  # of each ring in each column
    end = np.append(begin[1:], len(order))
    column = columns.column[begin]
    has_next = np.append(column[1:] == column[:-1], False)

    group = np.repeat(np.arange(len(begin)), end - begin)
    entry = np.flatnonzero(has_next[group])
    first = order[entry]
    next_begin, next_end = begin[group[entry] + 1], end[group[entry] + 1]
    return first, order[_nearest(scan, first, order, next_begin, next_end)]


def _nearest(scan, first, order, begin, end):
    """Entry of `order` in [begin, end) nearest to each first point; ties: the earliest."""
    best = begin.copy()
    best_distance = squared_distance(scan.xyz[order[best]], scan.xyz[first])
    for offset in range(1, int(np.max(end - begin, initial=1))):
        rows = np.flatnonzero(begin + offset < end)
        entry = begin[rows] + offset
        distance = squared_distance(scan.xyz[order[entry]], scan.xyz[first[rows]])
        nearer = distance < best_distance[rows]
        best[rows[nearer]] = entry[nearer]
        best_distance[rows[nearer]] = distance[nearer]
    return best
