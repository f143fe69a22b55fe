"""Segmentation: equal labels on seeded rooms, real scans and lattices full of ties."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from parity import compiled_group, compiled_mounting
from rooms import box_room, joined, read_scan, seeded_cloud, tilt, view_of
from smoke_ground_reconstruction.params import Params, SegmenterParams
from smoke_ground_reconstruction.reference.channel_segmentation import ChannelSegmentation
from smoke_ground_reconstruction.reference.label import Label
from smoke_ground_reconstruction.reference.scan import Mounting, Scan
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

DEFAULT = SegmenterParams()
VARIANTS = {
    "default": DEFAULT,
    "original form": replace(DEFAULT, ground_range_step="increasing", wall_range_step="increasing"),
    "no range step": replace(DEFAULT, ground_range_step="any", wall_range_step="minimum"),
    "second point": replace(DEFAULT, label_point="second"),
    "wide columns": replace(DEFAULT, column_width_deg=7.5),
    "margins swapped": replace(DEFAULT, ground_relative_margin=True, wall_relative_margin=False),
    "no height limit": replace(DEFAULT, max_ground_step_height=0.0, max_wall_step_height=0.05),
    "windows overlap": replace(
        DEFAULT, min_ground_angle_deg=-60.0, max_ground_angle_deg=90.0, ground_range_step="any"
    ),
    "almost half a turn": replace(
        DEFAULT, min_ground_angle_deg=-89.9, max_ground_angle_deg=89.9, ground_range_step="any"
    ),
    "obtuse ground": replace(DEFAULT, min_ground_angle_deg=100.0, max_ground_angle_deg=180.0),
}


def assert_parity(core, params, view, labels, mounting=None):
    mounting = mounting or Mounting()
    compiled_sensor, sensor = core.SensorModel(), SensorModel()
    compiled_sensor.observe(view.xyz, view.ring)
    sensor.observe(view)
    expected = ChannelSegmentation(params).classify(Scan(view, mounting), labels, sensor)
    group = compiled_group(Params(segmenter=params), "segmenter.segmentation")
    actual = core.ChannelSegmentation(group).classify(
        view.xyz, view.ring, labels, compiled_sensor, compiled_mounting(core, mounting)
    )
    np.testing.assert_array_equal(actual, expected)
    return expected


def some_noise(view, seed):
    rng = np.random.default_rng(seed)
    return rng.choice([Label.KEPT, Label.NOISE], len(view.xyz), p=[0.9, 0.1]).astype(np.uint8)


@pytest.mark.parametrize("seed", range(12))
def test_seeded_rooms(core, seed):
    view = seeded_cloud(seed)
    labels = assert_parity(core, DEFAULT, view, some_noise(view, seed))
    assert {Label.GROUND, Label.WALL, Label.KEPT, Label.NOISE} <= set(labels)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("seed", [1, 2])
def test_every_parameter(core, name, seed):
    view = seeded_cloud(seed)
    labels = assert_parity(core, VARIANTS[name], view, some_noise(view, seed))
    default = ChannelSegmentation(DEFAULT)
    sensor = SensorModel()
    sensor.observe(view)
    before = default.classify(Scan(view), some_noise(view, seed), sensor)
    assert name == "default" or not np.array_equal(labels, before)


@pytest.mark.parametrize("name", ["default", "second point", "wide columns", "windows overlap"])
@pytest.mark.parametrize("seed", [0, 3, 7])
def test_few_points_share_ring_and_column(core, name, seed):
    """One place in forty holds two points or three, in the lowest and the highest ring as well."""
    rng = np.random.default_rng(seed)
    view = one_a_place(VARIANTS[name], seed)
    again = view.select(rng.choice(len(view.xyz), len(view.xyz) // 40))
    view = joined(view, moved(again, rng))
    view = view.select(rng.permutation(len(view.xyz)))
    assert_parity(core, VARIANTS[name], view, some_noise(view, seed))


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("order", ["in turns", "one after the other", "shuffled"])
def test_dual_returns(core, name, order):
    """Nearly every place holds two points, of which one in three is a copy; some hold three."""
    rng = np.random.default_rng(5)
    view = one_a_place(VARIANTS[name], 5)
    size = len(view.xyz)
    again = view.select(np.flatnonzero(rng.uniform(size=size) < 0.9))
    far = np.flatnonzero(rng.uniform(size=len(again.xyz)) < 2.0 / 3.0)
    again.xyz[far] = moved(again.select(far), rng).xyz
    third = view.select(rng.choice(size, size // 100))
    view = joined(joined(view, again), moved(third, rng))
    if order == "in turns":
        view = view.select(np.argsort(np.arange(len(view.xyz)) % size, kind="stable"))
    if order == "shuffled":
        view = view.select(rng.permutation(len(view.xyz)))
    assert_parity(core, VARIANTS[name], view, some_noise(view, 5))


def one_a_place(params, seed):
    """A room whose points have each a ring and column of their own."""
    view, _ = box_room(range_noise=0.01, seed=seed)
    columns = round(360.0 / params.column_width_deg)
    azimuth = np.arctan2(view.xyz[:, 1], view.xyz[:, 0]) % (2.0 * np.pi)
    places = view.ring * columns + (azimuth / (2.0 * np.pi) * columns).astype(int)
    return view.select(np.sort(np.unique(places, return_index=True)[1]))


def moved(view, rng):
    """The same points up to a tenth nearer or farther."""
    return view._replace(xyz=view.xyz * rng.uniform(0.9, 1.1, (len(view.xyz), 1)).astype("f4"))


@pytest.mark.parametrize("angles_deg", [(3.0, -2.0), (0.0, 12.0)])
def test_tilted_sensor(core, angles_deg):
    view = seeded_cloud(4)
    assert_parity(core, DEFAULT, view, some_noise(view, 4), Mounting(tilt(*angles_deg), 0.6))


@pytest.mark.parametrize("name", ["default", "second point", "wide columns"])
def test_real_scans(core, real_scan, name):
    view = read_scan(real_scan)
    assert_parity(core, VARIANTS[name], view, np.full(len(view.xyz), Label.KEPT, np.uint8))


# Few distinct coordinates and rings: equal distances, vertical pairs, one column, one ring.
COORDINATE = st.one_of(
    st.integers(-3, 3).map(lambda i: i * 0.5),
    st.sampled_from([np.nan, np.inf, -0.0, 1e-30, 0.02, 1e6]),
)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE, st.sampled_from([0, 1, 2, 9, 65535]))


@settings(max_examples=200, deadline=None)
@given(points=st.lists(POINT, max_size=50), name=st.sampled_from(list(VARIANTS)))
@example(points=[(1e-30, 0.0, 0.0, 0), (0.5, 0.0, 0.0, 1)], name="default")
def test_odd_clouds(core, points, name):
    table = np.array(points, np.float64).reshape(-1, 4)
    view = view_of(table[:, :3], ring=table[:, 3])
    assert_parity(core, VARIANTS[name], view, np.full(len(points), Label.KEPT, np.uint8))
