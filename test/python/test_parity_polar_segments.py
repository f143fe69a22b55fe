"""Reconstruction and occupancy: the same surface from both engines."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from parity import assert_same_grid, assert_same_surface, compiled_group, compiled_mounting
from rooms import seeded_cloud, tilt, view_of
from smoke_ground_reconstruction.params import Params, ReconstructorParams
from smoke_ground_reconstruction.reference.floor_surface import Provenance
from smoke_ground_reconstruction.reference.occupancy import rasterize
from smoke_ground_reconstruction.reference.polar_segments import PolarSegments
from smoke_ground_reconstruction.reference.scan import Mounting
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

DEFAULT = ReconstructorParams()
VARIANTS = {
    "default": DEFAULT,
    "narrow segments": replace(DEFAULT, segment_angle_deg=2.5, min_wall_points=1),
    "wide segments": replace(DEFAULT, segment_angle_deg=90.0, reconstruction_gain=0.0),
    "step does not divide": replace(DEFAULT, horizontal_resolution_deg=0.3),
    "one step": replace(DEFAULT, horizontal_resolution_deg=10.0),
    "always reconstruct": replace(DEFAULT, reconstruction_gain=10.0, min_wall_points=1),
    "no step 3": replace(
        DEFAULT, height_difference_threshold=10.0, max_elevation_angle_deg=89.0
    ),
    "strict step 3": replace(DEFAULT, height_difference_threshold=0.0, max_elevation_angle_deg=0.0),
    "planar": replace(DEFAULT, wall_distance="planar_range", reconstruction_gain=3.0),
}  # fmt: skip
MOUNTINGS = {
    "level": Mounting(),
    "low": Mounting(sensor_height=0.1),
    "tilted": Mounting(tilt(4.0, -9.0), 0.65),
}


def split(view, seed):
    """Ground and walls drawn from a cloud; some directions get plenty of ground, some none."""
    draw = np.random.default_rng(seed).random(len(view.xyz))
    plenty = np.abs(np.floor(np.nan_to_num(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) * 3.0))
    is_ground = (view.xyz[:, 2] < -0.5) & (draw < 0.1 * plenty)
    is_wall = ~is_ground & (view.intensity > 50.0) & (draw < 0.3)
    return view.select(is_ground), view.select(is_wall)


def assert_parity(core, params, ground, walls, mounting, observed):
    compiled_sensor, sensor = core.SensorModel(), SensorModel()
    compiled_sensor.observe(observed.xyz, observed.ring)
    sensor.observe(observed)
    group = compiled_group(Params(reconstructor=params), "reconstructor.polar_segments")
    place = compiled_mounting(core, mounting)
    expected = PolarSegments(params).reconstruct(ground, walls, sensor, mounting)
    actual = core.PolarSegments(group).reconstruct(
        *ground, walls.xyz, walls.ring, compiled_sensor, place
    )
    assert_same_surface(actual, expected)
    for resolution in (0.1, 0.37):
        assert_same_grid(
            core.rasterize(actual, walls.xyz, place, resolution, 20.0),
            rasterize(expected, walls, mounting, resolution, 20.0),
        )
    return expected


@pytest.mark.parametrize("mounting", MOUNTINGS)
@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_seeded_rooms(core, seed, name, mounting):
    view = seeded_cloud(seed)
    ground, walls = split(view, seed)
    surface = assert_parity(core, VARIANTS[name], ground, walls, MOUNTINGS[mounting], view)
    if name == "default":
        assert set(surface.provenance) == {Provenance.MEASURED, Provenance.RECONSTRUCTED}


def test_no_ground_and_no_walls(core):
    view = seeded_cloud(0)
    ground, walls = split(view, 0)
    nothing = view.select(slice(0, 0))
    for pair in ((nothing, walls), (ground, nothing), (nothing, nothing)):
        assert_parity(core, DEFAULT, *pair, Mounting(), view)


def test_walls_of_rings_never_seen_are_left_out(core):
    view = seeded_cloud(0)
    ground, walls = split(view, 0)
    low_rings = view.select(view.ring < 20)
    assert_parity(core, VARIANTS["always reconstruct"], ground, walls, Mounting(), low_rings)


COORDINATE = st.one_of(
    st.integers(-3, 3).map(float), st.sampled_from([np.nan, np.inf, -0.0, 1e-30, 1e4])
)
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE, st.integers(0, 6))


@settings(max_examples=100, deadline=None)
@given(
    ground=st.lists(POINT, max_size=20),
    walls=st.lists(POINT, max_size=40),
    name=st.sampled_from(list(VARIANTS)),
    mounting=st.sampled_from(list(MOUNTINGS)),
)
def test_odd_clouds(core, ground, walls, name, mounting):
    views = []
    for points in (ground, walls):
        table = np.array(points, np.float64).reshape(-1, 4)
        views.append(view_of(table[:, :3], ring=table[:, 3]))
    params = replace(VARIANTS[name], min_wall_points=2)
    assert_parity(core, params, *views, MOUNTINGS[mounting], views[1])
