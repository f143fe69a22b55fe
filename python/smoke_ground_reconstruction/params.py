"""Parameters of the pipeline: names, units and defaults as in ``cfg/*.cfg``.

One dataclass per nodelet, gathered in :class:`Params`. A parameter file is plain YAML keyed
``denoiser:``, ``segmenter:`` and ``reconstructor:``; what a file leaves out keeps its default, and
a name it misspells is refused. Choices are strings (``engine: window``).
"""

import dataclasses
import math
import numbers
from dataclasses import dataclass, field
from typing import Any, Dict, Mapping

import yaml

THETA_UNITS = ("degrees", "radians")
DENOISER_ENGINES = ("window", "kdtree")
RANGE_STEP_RULES = ("minimum", "increasing", "any")
LABEL_POINTS = ("first", "second")
CLUSTER_ENGINES = ("kdtree", "grid")
RECONSTRUCTION_METHODS = ("polar_segments", "room_boundary")
WALL_DISTANCES = ("range", "planar_range")

_INT_MAX = 2**31 - 1


@dataclass
class AgdorParams:
    """Parameters of the denoiser. Thesis: Section 3.2, Algorithm 1, Table A.1."""

    intensity_threshold: float = 25.0  #: below it a point is a candidate for removal [sensor scale]
    alpha: float = 0.5  #: factor of the search radius
    theta_deg: float = 0.4  #: angle of the search radius: the horizontal resolution [deg]
    theta_unit: str = "degrees"  #: unit in which theta enters alpha * theta * r
    min_neighbors: int = 100  #: a candidate is kept only with more neighbours than this
    max_neighbors: int = 5000  #: ... and at most this many; 0: unlimited
    engine: str = "window"

    def radius_per_range(self) -> float:
        """alpha * theta: the search radius per metre of range."""
        theta = self.theta_deg
        if self.theta_unit == "radians":
            theta = self.theta_deg * (math.pi / 180.0)
        return self.alpha * theta

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _check_at_least(self, "intensity_threshold", 0.0)
        _check_above(self, "alpha", 0.0)
        _check_above(self, "theta_deg", 0.0)
        _check_choice(self, "theta_unit", THETA_UNITS)
        _check_whole(self, "min_neighbors", 0)
        _check_whole(self, "max_neighbors")
        _check_choice(self, "engine", DENOISER_ENGINES)
        has_room = self.max_neighbors == 0 or self.max_neighbors > self.min_neighbors
        rule = "0 (unlimited) or above min_neighbors"
        _require(has_room, "max_neighbors", rule, self.max_neighbors)


@dataclass
class ChannelSegmentationParams:
    """Parameters of the segmentation. Thesis: Section 3.3, Algorithm 4, Table A.1."""

    column_width_deg: float = 0.4  #: azimuth of a column [deg]; divides 360
    min_ground_angle_deg: float = -3.0
    max_ground_angle_deg: float = 3.0
    max_ground_step_height: float = 0.05  #: |dz| of a ground pair [m]; 0: unlimited
    ground_range_step: str = "minimum"
    ground_relative_margin: bool = False  #: apply relative_distance_margin to ground pairs
    min_wall_angle_deg: float = 60.0
    max_wall_angle_deg: float = 120.0
    max_wall_step_height: float = 0.0  #: |dz| of a wall pair [m]; 0: unlimited
    wall_range_step: str = "any"
    wall_relative_margin: bool = True  #: apply relative_distance_margin to wall pairs
    min_range_step: float = 0.03  #: of the rule 'minimum' [m]
    relative_distance_margin: float = 0.15  #: largest |r(i+1) - r(i)| / r(i) of a pair
    label_point: str = "first"

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _check_divides_circle(self, "column_width_deg")
        _check_angle_window(self, "min_ground_angle_deg", "max_ground_angle_deg")
        _check_at_least(self, "max_ground_step_height", 0.0)
        _check_choice(self, "ground_range_step", RANGE_STEP_RULES)
        _check_switch(self, "ground_relative_margin")
        _check_angle_window(self, "min_wall_angle_deg", "max_wall_angle_deg")
        _check_at_least(self, "max_wall_step_height", 0.0)
        _check_choice(self, "wall_range_step", RANGE_STEP_RULES)
        _check_switch(self, "wall_relative_margin")
        _check_at_least(self, "min_range_step", 0.0)
        _check_above(self, "relative_distance_margin", 0.0)
        _check_choice(self, "label_point", LABEL_POINTS)


@dataclass
class WallClusteringParams:
    """Parameters of the clustering. Thesis: Section 3.3 "Clustering", Table A.1."""

    cluster_tolerance: float = 0.05  #: largest gap inside a cluster [m]
    cluster_tolerance_per_range: float = 0.0  #: added per metre of range of the nearer point
    min_cluster_size: int = 50  #: smaller clusters are dropped [points]
    max_cluster_size: int = 5000  #: larger clusters are dropped [points]; 0: unlimited
    cluster_engine: str = "kdtree"

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _check_above(self, "cluster_tolerance", 0.0)
        _check_at_least(self, "cluster_tolerance_per_range", 0.0)
        _check_whole(self, "min_cluster_size", 1)
        _check_whole(self, "max_cluster_size")
        _check_choice(self, "cluster_engine", CLUSTER_ENGINES)
        has_room = self.max_cluster_size == 0 or self.max_cluster_size >= self.min_cluster_size
        rule = "0 (unlimited) or at least min_cluster_size"
        _require(has_room, "max_cluster_size", rule, self.max_cluster_size)


@dataclass
class SegmenterParams(WallClusteringParams, ChannelSegmentationParams):
    """Parameters of the Segmenter nodelet: segmentation, then clustering."""

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        ChannelSegmentationParams.validate(self)
        WallClusteringParams.validate(self)


@dataclass
class PolarSegmentsParams:
    """Parameters of ``polar_segments``. Thesis: Eq. 3.1, Algorithms 3 and 5, Table A.1."""

    segment_angle_deg: float = 10.0  #: angle of a segment of the polar grid; divides 360
    horizontal_resolution_deg: float = 0.4  #: azimuth step of the sensor
    reconstruction_gain: float = 0.15  #: share of the expected ground points that suffices
    min_wall_points: int = 10  #: fewer: the segment has no wall
    height_difference_threshold: float = 0.05  #: over the lower neighbour [m], Step 3
    max_elevation_angle_deg: float = 5.0  #: of the floor's slope, Step 3
    wall_distance: str = "range"

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _check_divides_circle(self, "segment_angle_deg")
        step = self.horizontal_resolution_deg
        _require_number("horizontal_resolution_deg", step)
        rule = "at least 0.01 and at most segment_angle_deg"
        fits = 0.01 <= step <= self.segment_angle_deg
        _require(fits, "horizontal_resolution_deg", rule, step)
        _check_at_least(self, "reconstruction_gain", 0.0)
        _check_whole(self, "min_wall_points", 1)
        _check_at_least(self, "height_difference_threshold", 0.0)
        slope = self.max_elevation_angle_deg
        _require_number("max_elevation_angle_deg", slope)
        _require(0.0 <= slope < 90.0, "max_elevation_angle_deg", "from 0 to below 90", slope)
        _check_choice(self, "wall_distance", WALL_DISTANCES)


@dataclass
class RoomBoundaryParams:
    """Parameters of ``room_boundary``; all of them may stay as they are."""

    max_floor_tilt_deg: int = 6  #: of floor and mounting together [deg]
    max_height_deviation: float = 0.15  #: of the floor from the mounting height [m]
    floor_tolerance: float = 0.0  #: returns so near to the plane are floor [m]; 0: automatic
    max_slope: float = 0.16  #: rise of a ramp per metre
    max_step_height: float = 0.2  #: of a platform over the floor [m]
    drop_depth: float = 0.0  #: so far below the floor is a drop [m]; 0: automatic
    smoke_gate: float = 2.0  #: weaker near returns are smoke, in strengths of the floor
    min_wall_height: float = 0.1  #: returns so far above the floor may be wall [m]
    furniture_height: float = 3.0  #: walls are told where the view is higher [m]
    max_bridge_ratio: float = 1.6  #: a wall is drawn on to so many times its seen length
    max_range: float = 50.0  #: no floor is claimed beyond [m]
    cell_size: float = 0.1  #: measured floor wins in cells of this edge [m]

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _check_whole(self, "max_floor_tilt_deg")
        _check_within(self, "max_floor_tilt_deg", 1, 15)
        _check_within(self, "max_height_deviation", 0.02, 0.5)
        _check_within(self, "floor_tolerance", 0.0, 0.2)
        _check_within(self, "max_slope", 0.02, 0.5)
        _check_within(self, "max_step_height", 0.05, 0.5)
        _check_within(self, "drop_depth", 0.0, 0.5)
        _check_within(self, "smoke_gate", 0.0, 20.0)
        _check_within(self, "min_wall_height", 0.05, 2.0)
        _check_within(self, "furniture_height", 0.0, 12.0)
        _check_within(self, "max_bridge_ratio", 0.0, 10.0)
        _check_within(self, "max_range", 1.0, 50.0)
        _check_within(self, "cell_size", 0.1, 0.5)


@dataclass
class _OutputParams:
    method: str = "room_boundary"
    sensor_height: float = 0.70  #: of the sensor above the floor [m]
    occupancy_resolution: float = 0.1  #: edge of a cell of the occupancy grid [m]

    def validate(self) -> None:
        _check_choice(self, "method", RECONSTRUCTION_METHODS)
        _check_above(self, "sensor_height", 0.0)
        _check_at_least(self, "occupancy_resolution", 0.01)


@dataclass
class ReconstructorParams(RoomBoundaryParams, PolarSegmentsParams, _OutputParams):
    """Parameters of the Reconstructor nodelet: the output's, then the methods'."""

    def validate(self) -> None:
        """Raise ValueError naming the parameter, its value and what it may be."""
        _OutputParams.validate(self)
        PolarSegmentsParams.validate(self)
        RoomBoundaryParams.validate(self)


@dataclass
class Params:
    """Parameters of the whole pipeline, one group per nodelet."""

    denoiser: AgdorParams = field(default_factory=AgdorParams)
    segmenter: SegmenterParams = field(default_factory=SegmenterParams)
    reconstructor: ReconstructorParams = field(default_factory=ReconstructorParams)

    def validate(self) -> None:
        """Raise ValueError naming the first bad parameter, its value and what it may be."""
        self.denoiser.validate()
        self.segmenter.validate()
        self.reconstructor.validate()

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Params":
        """Params from ``{"denoiser": {"alpha": 0.5, ...}, ...}``; what is left out is the default.

        Raises ValueError naming an unknown group or parameter, or a value out of its limits.
        """
        _refuse_unknown("group", values, [group.name for group in dataclasses.fields(cls)])
        params = cls()
        for name, group in values.items():
            _update_group(getattr(params, name), name, {} if group is None else group)
        params.validate()
        return params

    def to_dict(self) -> Dict[str, Dict[str, Any]]:
        """The groups as plain dicts, in the order of the cfg files."""
        return dataclasses.asdict(self)

    @classmethod
    def from_yaml(cls, path) -> "Params":
        """Read a parameter file.

        Raises OSError where it cannot be opened, ValueError naming the file where it is no plain
        YAML or :meth:`from_dict` refuses it.
        """
        with open(path, encoding="utf-8") as file:
            try:
                return cls.from_dict(yaml.safe_load(file) or {})
            except yaml.YAMLError as error:
                reason = " ".join(str(error).split())
                raise ValueError(f"{path}: not plain YAML: {reason}") from None
            except ValueError as error:
                raise ValueError(f"{path}: {error}") from None

    def to_yaml(self, path) -> None:
        """Write a parameter file that :meth:`from_yaml` and ``rosparam load`` read."""
        with open(path, "w", encoding="utf-8") as file:
            yaml.safe_dump(self.to_dict(), file, default_flow_style=False, sort_keys=False)


def _update_group(group, group_name: str, values: Mapping[str, Any]) -> None:
    defaults = {entry.name: getattr(group, entry.name) for entry in dataclasses.fields(group)}
    _refuse_unknown(f"parameter of {group_name}", values, list(defaults))
    for name, value in values.items():
        is_plain_number = isinstance(value, int) and not isinstance(value, bool)
        if isinstance(defaults[name], float) and is_plain_number:
            value = float(value)
        setattr(group, name, value)


def _refuse_unknown(kind: str, values, known) -> None:
    if not isinstance(values, Mapping):
        raise ValueError(f"expected a mapping of {', '.join(known)}, found {values!r}")
    for name in values:
        if name not in known:
            raise ValueError(f"unknown {kind}: {name} (known: {', '.join(known)})")


def _require(holds: bool, name: str, rule: str, value) -> None:
    if not holds:
        shown = f"{value:g}" if _is_number(value) else str(value)
        raise ValueError(f"{name} must be {rule}, is {shown}")


def _is_number(value) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _require_number(name: str, value) -> None:
    _require(_is_number(value) and math.isfinite(value), name, "a finite number", value)


def _check_above(params, name: str, limit: float) -> None:
    value = getattr(params, name)
    _require_number(name, value)
    _require(value > limit, name, f"> {limit:g}", value)


def _check_at_least(params, name: str, limit: float) -> None:
    value = getattr(params, name)
    _require_number(name, value)
    _require(value >= limit, name, f">= {limit:g}", value)


def _check_within(params, name: str, least: float, most: float) -> None:
    value = getattr(params, name)
    _require_number(name, value)
    _require(least <= value <= most, name, f"from {least:g} to {most:g}", value)


def _check_whole(params, name: str, limit: int = -_INT_MAX) -> None:
    value = getattr(params, name)
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    _require(is_whole and value <= _INT_MAX, name, "a whole number of at most 2147483647", value)
    _require(value >= limit, name, f">= {limit}", value)


def _check_switch(params, name: str) -> None:
    value = getattr(params, name)
    _require(isinstance(value, bool), name, "true or false", value)


def _check_choice(params, name: str, choices) -> None:
    value = getattr(params, name)
    _require(value in choices, name, f"one of {', '.join(choices)}", value)


def _check_angle_window(params, from_name: str, to_name: str) -> None:
    start, end = getattr(params, from_name), getattr(params, to_name)
    _require_number(from_name, start)
    _require_number(to_name, end)
    rule = f"at least -180 and at most {to_name}"
    _require(-180.0 <= start <= end, from_name, rule, start)
    rule = f"at most 180 and less than 180 above {from_name}"
    _require(end <= 180.0 and end - start < 180.0, to_name, rule, end)


def _check_divides_circle(params, name: str) -> None:
    require_divides_circle(name, getattr(params, name))


def require_divides_circle(name: str, width_deg: float) -> None:
    """Raise ValueError unless ``width_deg`` is an angle that :func:`divides_circle`."""
    _require_number(name, width_deg)
    rule = "a divisor of 360 deg from 0.01 to 90"
    _require(divides_circle(width_deg), name, rule, width_deg)


def divides_circle(width_deg: float) -> bool:
    """Does an angle [deg] divide 360 into 4 to 36,000 bins (1e-6 relative)?"""
    if not 0.009 < width_deg < 91.0:
        return False
    bins = round(360.0 / width_deg)
    return 4 <= bins <= 36000 and abs(bins * width_deg - 360.0) <= 360.0 * 1e-6
