"""Every tunable of room_boundary acts, in the direction its name says, in both engines."""

import numpy as np
import pytest

import rooms
from smoke_ground_reconstruction.params import Params
from smoke_ground_reconstruction.pipeline import Pipeline

ELEVATIONS_DEG = np.linspace(-52.0, 50.0, 64)
ENGINES = ("cpp", "python")


def floor_of(view, engine, elevations_deg=ELEVATIONS_DEG, **values):
    """The Result of room_boundary with some parameters off their defaults."""
    if engine == "cpp":
        pytest.importorskip("smoke_ground_reconstruction._core")
    params = Params.from_dict({"reconstructor": {"method": "room_boundary", **values}})
    return Pipeline(params, engine, elevations_deg).process(*view, sensor_height=0.7)


def box(walls=(3.4, 3.0, -3.4, -3.0), ceiling=1.9, floor=-0.7):
    return rooms.box_room(walls, ceiling, floor, ELEVATIONS_DEG, 0.4, 0.005)[0]


def leaning(view, pitch_deg):
    """The scan of a sensor that leans forward and does not know it."""
    turn = rooms.tilt(0.0, pitch_deg)
    return view._replace(xyz=(view.xyz.astype(np.float64) @ turn).astype(np.float32))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_floor_farther_from_the_mounting_height_is_followed_if_allowed(engine):
    view = box(floor=-0.95)
    assert floor_of(view, engine).floor_plane[2] == pytest.approx(-0.7)
    found = floor_of(view, engine, max_height_deviation=0.3)
    assert found.floor_plane[2] == pytest.approx(-0.95, abs=0.003)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_steeper_floor_is_followed_if_allowed(engine):
    view = leaning(box(), 12.0)
    slope = np.tan(np.radians(12.0))
    assert floor_of(view, engine, max_floor_tilt_deg=13).floor_plane[0] == pytest.approx(
        slope, abs=0.003
    )
    assert abs(floor_of(view, engine, max_floor_tilt_deg=3).floor_plane[0]) < 0.5 * slope


def with_floor(view, height_of):
    """The scan with its floor lifted to the heights that a function of x gives."""
    is_floor = np.abs(view.xyz[:, 2] + 0.7) < 0.05
    xyz = view.xyz.astype(np.float64)
    xyz[is_floor, 2] += height_of(xyz[is_floor, 0])
    return view._replace(xyz=xyz.astype(np.float32)), is_floor


def labelled(found, which, label):
    """Share of some returns that have a label."""
    return np.mean(found.labels[which] == label)


GROUND, WALL, NOISE = 3, 4, 2


@pytest.mark.parametrize("engine", ENGINES)
def test_floor_strays_from_its_plane_as_far_as_is_allowed(engine):
    """Waves of 25 mm; the automatic tolerance follows from them."""
    view, is_floor = with_floor(box(), lambda x: 0.025 * np.sin(8.0 * x))
    strict = labelled(floor_of(view, engine, floor_tolerance=0.01), is_floor, GROUND)
    automatic = labelled(floor_of(view, engine), is_floor, GROUND)
    assert strict < 0.6 < 0.9 < automatic


@pytest.mark.parametrize("engine", ENGINES)
def test_a_ramp_is_floor_up_to_the_largest_slope(engine):
    view, is_floor = with_floor(box(), lambda x: np.maximum(0.0, 0.2 * (x - 1.0)))
    ramp = is_floor & (view.xyz[:, 0] > 1.5) & (view.xyz[:, 0] < 3.0)
    assert labelled(floor_of(view, engine), ramp, GROUND) > 0.9
    assert labelled(floor_of(view, engine, max_slope=0.02), ramp, GROUND) < 0.5


@pytest.mark.parametrize("engine", ENGINES)
def test_a_platform_is_floor_up_to_the_highest_step(engine):
    view, is_floor = with_floor(box(), lambda x: np.where(x > 1.2, 0.15, 0.0))
    platform = is_floor & (view.xyz[:, 0] > 1.5)
    assert labelled(floor_of(view, engine), platform, GROUND) > 0.9
    assert labelled(floor_of(view, engine, max_step_height=0.1), platform, GROUND) < 0.1


@pytest.mark.parametrize("engine", ENGINES)
def test_what_lies_deep_enough_is_a_drop(engine):
    view = box()
    xyz = view.xyz.astype(np.float64)
    fell = (np.abs(xyz[:, 2] + 0.7) < 0.05) & (xyz[:, 0] > 1.5)
    xyz[fell] *= 0.82 / 0.7  # along their beams
    view = view._replace(xyz=xyz.astype(np.float32))
    shallow = floor_of(view, engine, drop_depth=0.3)
    deep = floor_of(view, engine)
    ahead = [np.ptp(found.boundary[:, 0]) for found in (deep, shallow)]
    assert ahead[0] == pytest.approx(1.5 + 3.4, abs=0.1)
    assert ahead[1] == pytest.approx(3.4 + 3.4, abs=0.1)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_gate_tells_how_weak_smoke_is(engine):
    """Returns 1 m away, as strong as 1.5 times the floor's; so an intensity falls with range."""
    view = box()
    strength = np.where(np.abs(view.xyz[:, 2] + 0.7) < 0.05, 10.0, 40.0)
    square = (view.xyz.astype(np.float64) ** 2).sum(axis=1)
    view = view._replace(intensity=(strength / square).astype(np.float32))
    azimuth = np.radians(np.linspace(0.0, 30.0, 200))
    smoke = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(200)])
    view = rooms.joined(view, rooms.view_of(smoke, 15.0, 30))
    puff = np.arange(len(view.xyz)) >= len(view.xyz) - 200
    assert labelled(floor_of(view, engine), puff, NOISE) == 1.0
    assert labelled(floor_of(view, engine, smoke_gate=1.2), puff, NOISE) == 0.0
    assert labelled(floor_of(view, engine, smoke_gate=0.0), puff, NOISE) == 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_returns_below_the_lowest_wall_are_no_wall(engine):
    view = box()
    foot = (view.xyz[:, 2] > -0.5) & (view.xyz[:, 2] < -0.3) & (view.xyz[:, 0] > 3.35)
    assert labelled(floor_of(view, engine), foot, WALL) > 0.9
    assert labelled(floor_of(view, engine, min_wall_height=0.5), foot, WALL) == 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_where_the_view_is_higher_than_furniture_walls_are_told_from_it(engine):
    """A sensor that looks up by 15 deg sees the walls, 3 m away, up to 1.5 m and more, and a
    pillar 2 m ahead up to 1.24 m."""
    elevations_deg = np.linspace(-45.0, 15.0, 64)
    view = rooms.box_room((3.4, 3.0, -3.4, -3.0), 1.9, -0.7, elevations_deg, 0.4, 0.005)[0]
    xyz = view.xyz.astype(np.float64)
    at_pillar = xyz * (2.0 / np.maximum(xyz[:, :1], 1e-3))
    hits = (xyz[:, 0] > 2.0) & (np.abs(at_pillar[:, 1]) < 0.3)
    view = view._replace(xyz=np.where(hits[:, None], at_pillar, xyz).astype(np.float32))

    def ahead(**values):
        surface = floor_of(view, engine, elevations_deg=elevations_deg, **values).surface
        return surface[np.abs(surface[:, 1]) < 0.1, 0].max()

    assert ahead() == pytest.approx(1.95, abs=0.05)
    assert ahead(furniture_height=1.35) == pytest.approx(3.39, abs=0.02)
    assert ahead(furniture_height=0.9) == pytest.approx(1.95, abs=0.05)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_corner_is_drawn_as_far_as_its_walls_allow(engine):
    """Smoke hides the corner at 41 deg, from 10 to 70 deg, the floor there too."""
    view = box()
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0]))
    view = view.select((azimuth < 15.0) | (azimuth > 65.0))

    def to_the_corner(**values):
        surface = floor_of(view, engine, **values).surface
        return np.hypot(surface[:, 0] - 3.4, surface[:, 1] - 3.0).min()

    assert to_the_corner() < 0.1
    assert to_the_corner(max_bridge_ratio=0.0) > 1.0


@pytest.mark.parametrize("engine", ENGINES)
def test_no_floor_is_claimed_beyond_the_range(engine):
    for farthest in (2.0, 3.2):
        surface = floor_of(box(), engine, max_range=farthest).surface
        planar = np.hypot(surface[:, 0], surface[:, 1])
        assert planar.max() == pytest.approx(farthest, abs=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_larger_cells_make_a_sparser_floor(engine):
    """Half of the floor is hidden; drawn points per area go with the cell's edge squared."""
    view = box()
    view = view.select((view.xyz[:, 2] > -0.65) | (view.xyz[:, 0] < 0.0))
    fine, coarse = (floor_of(view, engine, cell_size=size) for size in (0.1, 0.3))
    drawn = [np.count_nonzero(found.provenance == 1) for found in (fine, coarse)]
    assert drawn[1] < 0.8 * drawn[0]
    for found in (fine, coarse):
        ahead = found.surface[found.surface[:, 0] > 0.5]
        assert ahead[:, 0].max() == pytest.approx(3.39, abs=0.02)


TURNED = [
    {"max_floor_tilt_deg": 3},
    {"max_height_deviation": 0.05},
    {"floor_tolerance": 0.015, "drop_depth": 0.02},
    {"max_slope": 0.05, "max_step_height": 0.06},
    {"smoke_gate": 5.0, "min_wall_height": 0.3},
    {"furniture_height": 1.0, "max_bridge_ratio": 0.4},
    {"max_range": 2.5, "cell_size": 0.25},
]


@pytest.mark.parametrize("values", TURNED, ids=lambda values: "+".join(values))
def test_both_engines_turn_alike(core, values):
    for seed in range(3):
        view = rooms.seeded_cloud(seed)
        actual, expected = (floor_of(view, engine, **values) for engine in ENGINES)
        np.testing.assert_array_equal(actual.labels, expected.labels)
        np.testing.assert_array_equal(actual.surface, expected.surface)
        np.testing.assert_array_equal(actual.boundary_kind, expected.boundary_kind)
