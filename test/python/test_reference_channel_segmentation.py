"""Segmentation against pairs worked out by hand. Thesis: Algorithm 4."""

from dataclasses import replace

import numpy as np
import pytest

from rooms import box_room, view_of
from smoke_ground_reconstruction.params import ChannelSegmentationParams
from smoke_ground_reconstruction.reference.channel_segmentation import ChannelSegmentation
from smoke_ground_reconstruction.reference.label import Label
from smoke_ground_reconstruction.reference.scan import Scan
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

DEFAULT = ChannelSegmentationParams()
# Without the tests of height, range step and margin: the angle alone.
ANGLE_ONLY = replace(
    DEFAULT, max_ground_step_height=0.0, ground_range_step="any", wall_relative_margin=False
)
SENSOR = SensorModel.from_elevations([-40.0, -30.0, -20.0, -10.0])
KEPT, NOISE, GROUND, WALL = Label.KEPT, Label.NOISE, Label.GROUND, Label.WALL


def classify(points, params=DEFAULT, ring=None, labels=None, sensor=SENSOR):
    """Labels of points, by default one per ring, all kept by the denoiser."""
    view = view_of(points, ring=np.arange(len(points)) if ring is None else ring)
    before = np.full(len(points), KEPT, np.uint8) if labels is None else np.uint8(labels)
    return ChannelSegmentation(params).classify(Scan(view), before, sensor).tolist()


def pair(angle_deg, length=0.25, start=(2.0, 0.0, -0.7)):
    """Two points in the plane y = 0, the second at an angle from the first, away from the axis."""
    angle = np.radians(angle_deg)
    end = (start[0] + length * np.cos(angle), start[1], start[2] + length * np.sin(angle))
    return [start, end]


def test_the_first_point_of_a_level_pair_is_ground():
    assert classify(pair(0.0)) == [GROUND, KEPT]


def test_the_second_point_is_labeled_on_request():
    assert classify(pair(0.0), replace(DEFAULT, label_point="second")) == [KEPT, GROUND]


@pytest.mark.parametrize(
    ("angle_deg", "label"),
    [(2.9, GROUND), (-2.9, GROUND), (3.1, KEPT), (-3.1, KEPT), (180.0, KEPT), (30.0, KEPT),
     (59.9, KEPT), (60.1, WALL), (90.0, WALL), (119.9, WALL), (120.1, KEPT), (-90.0, KEPT)],
)  # fmt: skip
def test_angle_windows_of_ground_and_wall(angle_deg, label):
    """Beyond 90 deg the wall leans towards the sensor: arcsin could not tell."""
    assert classify(pair(angle_deg), ANGLE_ONLY) == [label, KEPT]


def test_the_angle_is_taken_along_the_ground_in_any_direction():
    # 0.3 m along y, nearly the same planar range: a vertical step of 0.01 m is 1.9 deg.
    points = [(2.0, -0.15, -0.7), (2.0, 0.15, -0.69)]
    wide = replace(ANGLE_ONLY, column_width_deg=90.0)
    assert classify(points, wide)[0] == KEPT  # two columns: the +x axis parts them
    turned = [(1.5, 1.3, -0.7), (1.3, 1.5, -0.69)]
    assert classify(turned, wide)[0] == GROUND


@pytest.mark.parametrize(("step", "label"), [(0.0625, GROUND), (-0.0625, GROUND), (0.0635, KEPT)])
def test_the_height_limit_is_closed(step, label):
    params = replace(ANGLE_ONLY, max_ground_step_height=0.0625)
    points = [(2.0, 0.0, 0.0), (4.0, 0.0, step)]  # below 2 deg
    assert classify(points, params) == [label, KEPT]


@pytest.mark.parametrize(
    ("rule", "length", "label"),
    [("minimum", 0.25, GROUND), ("minimum", 0.2499, KEPT), ("increasing", 0.001, GROUND),
     ("any", 0.001, GROUND)],
)  # fmt: skip
def test_range_step_rules_of_ground(rule, length, label):
    """On the x axis the step of the range is the step in x."""
    params = replace(DEFAULT, ground_range_step=rule, min_range_step=0.25)
    assert classify([(1.0, 0.0, 0.0), (1.0 + length, 0.0, 0.0)], params) == [label, KEPT]


def test_the_thesis_feature_drops_pairs_nearer_than_30_mm():
    """Figure 3.3b: smoke right behind smoke passes the original test, not the new one."""
    smoke = [(0.5, 0.0, -0.3), (0.515, 0.0, -0.3)]
    assert classify(smoke, replace(DEFAULT, ground_range_step="increasing")) == [GROUND, KEPT]
    assert classify(smoke) == [KEPT, KEPT]


def test_a_wall_s_foot_survives_since_its_range_shrinks_upwards():
    foot = [(2.0, 0.0, -0.7), (2.0, 0.0, -0.5)]
    assert classify(foot) == [WALL, KEPT]
    assert classify(foot, replace(DEFAULT, wall_range_step="minimum")) == [KEPT, KEPT]


def test_the_relative_margin_of_walls():
    """Up a pole at 1 m: from z = 0 to 0.5 m the range grows by 11.8 %, to 0.6 m by 16.6 %."""
    short, tall = [(1, 0, 0), (1, 0, 0.5)], [(1, 0, 0), (1, 0, 0.6)]
    assert classify(short) == [WALL, KEPT]
    assert classify(tall) == [KEPT, KEPT]
    assert classify(tall, replace(DEFAULT, wall_relative_margin=False)) == [WALL, KEPT]


def test_the_relative_margin_of_ground_is_a_switch():
    points = [(1.0, 0.0, 0.0), (1.2, 0.0, 0.0)]
    assert classify(points) == [GROUND, KEPT]
    assert classify(points, replace(DEFAULT, ground_relative_margin=True)) == [KEPT, KEPT]


def test_a_point_that_passes_as_both_is_a_wall():
    params = replace(ANGLE_ONLY, max_ground_angle_deg=89.0)
    assert classify(pair(75.0), params) == [WALL, KEPT]
    # As second point of a ground pair and of a wall pair: the wall stands, whatever the order.
    points = [(1.0, 0.0, 0.0), (1.9, 0.0, 0.0), (1.9, 0.0, 0.2)]
    second = replace(params, label_point="second")
    assert classify(points, second)[2] == WALL


def test_pairs_skip_rings_that_are_absent():
    assert classify(pair(0.0), ring=[0, 3]) == [GROUND, KEPT]


def test_points_of_one_ring_are_never_paired():
    assert classify(pair(0.0), ring=[1, 1]) == [KEPT, KEPT]


def test_every_point_of_a_ring_takes_the_nearest_of_the_next():
    points = [(2.0, 0.0, -0.7), (2.3, 0.0, -0.7), (3.0, 0.0, -0.7), (2.0, 0.0, -0.5)]
    # Ring 1 holds a floor point 1 m off and a wall point 0.2 m above the first point.
    assert classify(points, ring=[0, 0, 1, 1]) == [WALL, KEPT, KEPT, KEPT]


def test_ties_go_to_the_lower_index():
    floor, wall = (2.25, 0.0, 0.0), (2.0, 0.0, 0.25)
    start = (2.0, 0.0, 0.0)
    assert classify([start, floor, wall], ring=[0, 1, 1])[0] == GROUND
    assert classify([start, wall, floor], ring=[0, 1, 1])[0] == WALL


def test_columns_are_0_4_deg_wide():
    def at(azimuth_deg, r):
        return (r * np.cos(np.radians(azimuth_deg)), r * np.sin(np.radians(azimuth_deg)), 0.0)

    assert classify([at(0.41, 2.0), at(0.79, 2.3)]) == [GROUND, KEPT]
    assert classify([at(0.39, 2.0), at(0.41, 2.3)]) == [KEPT, KEPT]
    assert classify([at(359.61, 2.0), at(-0.01, 2.3)]) == [GROUND, KEPT]


def test_rings_pair_by_elevation_not_by_number():
    reversed_sensor = SensorModel.from_elevations([-10.0, -20.0])
    assert classify(pair(0.0), ring=[1, 0], sensor=reversed_sensor) == [GROUND, KEPT]
    assert classify(pair(0.0), ring=[0, 1], sensor=reversed_sensor) == [KEPT, KEPT]


def test_only_kept_points_are_looked_at():
    points = [(2.0, 0.0, -0.7), (2.25, 0.0, -0.2), (2.5, 0.0, -0.7)]
    assert classify(points, labels=[KEPT, NOISE, KEPT]) == [GROUND, NOISE, KEPT]
    points[1] = (np.nan, 0.0, 0.0)
    assert classify(points, labels=[KEPT, Label.INVALID, KEPT]) == [GROUND, Label.INVALID, KEPT]


def test_a_clear_box_room():
    """Without noise what is called ground is floor and what is called wall is wall."""
    room, surface = box_room((3.0, 2.0, -3.0, -2.0))
    sensor = SensorModel()
    sensor.observe(room)
    labels = np.full(len(surface), KEPT, np.uint8)
    # The last floor ring before a wall may see it less than 60 deg steep: that is neither.
    answer = ChannelSegmentation(DEFAULT).classify(Scan(room), labels, sensor)
    assert np.all(surface[answer == GROUND] == 0)
    assert np.mean(answer[surface == 0] == GROUND) > 0.8
    assert np.mean(surface[answer == WALL] == 1) > 0.98
