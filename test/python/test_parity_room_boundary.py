"""room_boundary: the compiled core and the reference agree to the last bit."""

import numpy as np
import pytest

import rooms
from parity import assert_same_grid, compiled_mounting
from smoke_ground_reconstruction import Params, Pipeline
from smoke_ground_reconstruction.reference.floor_model import FloorSource, fit_floor
from smoke_ground_reconstruction.reference.room_boundary import RoomBoundary
from smoke_ground_reconstruction.reference.scan import Mounting
from smoke_ground_reconstruction.reference.sensor_model import SensorModel

ELEVATIONS_DEG = np.linspace(-52.0, 50.0, 64)
FLOOR_NUMBERS = ("weight", "noise", "uneven", "height_error")
SURFACE = ("xyz", "intensity", "ring", "provenance", "boundary", "boundary_kind")


def box(
    noise=0.01, walls=(3.4, 3.0, -3.4, -3.0), ceiling=1.9, seed=0, elevations_deg=ELEVATIONS_DEG
):
    """A room seen from 0.7 m."""
    return rooms.box_room(walls, ceiling, -0.7, elevations_deg, 0.4, noise, seed)[0]


def turned(view, roll_deg, pitch_deg):
    """The scan of a sensor that hangs askew, and the rotation that levels it."""
    rotation = rooms.tilt(roll_deg, pitch_deg)
    xyz = (view.xyz.astype(np.float64) @ rotation).astype(np.float32)
    return view._replace(xyz=xyz), rotation


def drilled(view, seed):
    """The scan with sectors of it hidden by thick smoke."""
    rng = np.random.default_rng(seed)
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0])) % 360.0
    keep = np.ones(len(azimuth), bool)
    for _ in range(6):
        begin, width = rng.uniform(0.0, 360.0), rng.uniform(3.0, 40.0)
        keep &= ((azimuth - begin) % 360.0 > width) | (view.xyz[:, 2] < rng.uniform(-0.7, 1.0))
    return view.select(keep & (rng.random(len(keep)) < rng.uniform(0.2, 1.0)))


def assert_same_floor(actual, expected):
    np.testing.assert_array_equal(actual.plane, expected.plane)
    np.testing.assert_array_equal(actual.covariance, expected.covariance.ravel())
    assert actual.source == expected.source
    for name in FLOOR_NUMBERS:
        assert getattr(actual, name) == getattr(expected, name)


def assert_parity(core, view, mounting=None, methods=None):
    """Both engines on one scan; returns the reference's answer."""
    mounting = mounting or Mounting()
    compiled, reference = methods or (core.RoomBoundary(), RoomBoundary())
    sensor, compiled_sensor = SensorModel(), core.SensorModel()
    sensor.observe(view)
    compiled_sensor.observe(view.xyz, view.ring)
    expected = reference.reconstruct(view, sensor, mounting)
    actual = compiled.reconstruct(*view, compiled_sensor, compiled_mounting(core, mounting))
    assert_same_floor(actual.floor, expected.floor)
    for name in ("distance", "kind", "line"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected.profile, name))
    np.testing.assert_array_equal(actual.drop_begin, expected.drops.begin)
    np.testing.assert_array_equal(actual.limit, expected.limit)
    np.testing.assert_allclose(actual.extinction, expected.visibility.extinction, rtol=1e-6)
    np.testing.assert_array_equal(actual.labels, expected.labels)
    for name in SURFACE:
        found, wanted = (getattr(surface, name) for surface in (actual.surface, expected.surface))
        np.testing.assert_array_equal(found, wanted)
    np.testing.assert_allclose(
        actual.surface.confidence, expected.surface.confidence, rtol=1e-5, atol=1e-7
    )
    for name in ("confidence", "sigma"):
        found, wanted = (getattr(surface, name) for surface in (actual.surface, expected.surface))
        np.testing.assert_allclose(found, wanted, rtol=1e-4)
    np.testing.assert_array_equal(actual.surface.floor_plane, expected.surface.floor_plane)
    return expected


@pytest.mark.parametrize("seed", range(4))
def test_floor_among_walls_and_furniture(core, seed):
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-4.0, 4.0, (2000, 2))
    z = 0.03 * xy[:, 0] - 0.72 + 0.01 * rng.standard_normal(2000)
    wall = np.column_stack([np.full(500, 4.0), rng.uniform(-4, 4, 500), rng.uniform(-0.8, 1, 500)])
    xyz = np.vstack([np.column_stack([xy, z]), wall]).astype(np.float32)
    assert_same_floor(core.fit_floor(xyz, 0.7), fit_floor(xyz.astype(np.float64), 0.7))


@pytest.mark.parametrize("noise", [0.01, 0.04, 0.08])
def test_floor_of_a_sensor_of_few_rings(core, noise):
    rings = rooms.box_room((5.0, 4.0, -5.0, -4.0), 1.9, -0.7, [-25.0, -15.0, -8.0], 0.4, noise)[0]
    for xyz in (rings.xyz, rings.xyz[rings.ring == 1]):
        assert_same_floor(core.fit_floor(xyz, 0.7), fit_floor(xyz.astype(np.float64), 0.7))


def test_no_floor(core):
    assert_same_floor(
        core.fit_floor(np.zeros((0, 3), np.float32), 0.7), fit_floor(np.zeros((0, 3)), 0.7)
    )


@pytest.mark.parametrize("seed", range(6))
def test_seeded_rooms(core, seed):
    assert len(assert_parity(core, rooms.seeded_cloud(seed)).surface) > 0


@pytest.mark.parametrize("noise", [0.03, 0.05, 0.1])
def test_a_sensor_of_much_range_noise(core, noise):
    assert_parity(core, box(noise=noise))
    assert_parity(core, drilled(box(noise=noise), 3))


def test_a_piece_of_wall_before_a_corner(core):
    view = box()
    azimuth = np.degrees(np.arctan2(view.xyz[:, 1], view.xyz[:, 0]))
    view = view.select((np.abs(azimuth - 41.4) > 8.0) | (view.xyz[:, 2] < -0.69))
    middle, z = np.meshgrid(np.radians([41.0, 41.4, 41.8]), np.arange(-0.65, 1.89, 0.05))
    piece = np.stack([2.5 * np.cos(middle), 2.5 * np.sin(middle), z], axis=-1).reshape(-1, 3)
    ring = np.r_[view.ring, np.full(len(piece), 60)]
    view = rooms.view_of(np.vstack([view.xyz, piece]), 60.0, ring)
    assert (assert_parity(core, view).profile.kind[93:100] == 2).all()


def test_a_room_whose_floor_sends_nothing_back(core):
    for noise in (0.0, 0.01):
        view = box(noise)
        assert_parity(core, view.select(view.xyz[:, 2] > -0.66))


def test_walls_on_a_floor_that_few_rings_meet(core):
    for seed in range(3):
        found = assert_parity(core, rooms.few_rings_in_smoke(0.01, seed))
        assert found.floor.source == FloorSource.MEASURED


def test_a_terrace_behind_glass(core):
    for seed in range(3):
        view = rooms.glass_front(0.005, seed)
        assert_same_floor(core.fit_floor(view.xyz, 0.7), fit_floor(view.xyz.astype(float), 0.7))
        assert_parity(core, view)


def test_rooms_half_hidden(core):
    found = [assert_parity(core, drilled(box(seed=seed), seed)) for seed in range(4)]
    assert len(set(np.concatenate([result.profile.kind for result in found]))) > 1


def test_what_stands_in_smoke(core):
    found = assert_parity(core, rooms.standing_in_smoke(box(), [0.2, 0.3, 0.25, 0.3, 0.6]))
    assert found.limit[450] > 2.5


def test_floor_thinly_measured_behind_a_door(core):
    view = box(noise=0.005, walls=(8.0, 3.0, -3.4, -3.0))
    x, y, z = view.xyz.T
    beside = (x > 3.4) & (np.abs(y) > 0.15 * x)  # of the wall x = 3.4 only a door is open
    shade = np.where(beside & (x < 8.1), 3.4 / np.maximum(x, 0.1), 1.0)
    xyz = (view.xyz * shade[:, None].astype(np.float32)).astype(np.float32)
    thin = (x > 3.5) & ~beside & (np.arange(len(x)) % 3 != 0)
    found = assert_parity(core, view._replace(xyz=xyz).select(~thin))
    assert np.any(found.room.planar[found.claim.measured] > 3.7)


def test_thick_smoke(core):
    found = assert_parity(core, rooms.thick_smoke(box(noise=0.0)))
    assert np.any(found.limit[found.profile.distance > 2.5] < 2.0)


@pytest.mark.parametrize("knows", [True, False], ids=["known", "found"])
def test_tilted_sensor(core, knows):
    view, rotation = turned(box(), 2.0, -3.0)
    assert_parity(core, view, Mounting(rotation, 0.7) if knows else None)


def test_ceiling_out_of_view(core):
    assert_parity(core, box(ceiling=8.0, walls=(6.0, 9.0, -5.0, -7.0)))


@pytest.mark.parametrize("noise", [0.01, 0.03])
def test_a_sensor_that_looks_up_15_deg(core, noise):
    view = box(noise)
    assert_parity(core, view.select(view.xyz[:, 2] < 0.268 * np.hypot(*view.xyz[:, :2].T)))


def test_ramp(core):
    view, _ = rooms.with_ramp(box(walls=(5.0, 3.0, -3.4, -3.0)))
    found = assert_parity(core, view)
    assert not found.room.relief.is_flat()


def test_a_ramp_that_many_returns_tell(core):
    level = box(walls=(5.0, 3.0, -3.4, -3.0), elevations_deg=np.linspace(-52.0, 50.0, 192))
    view, _ = rooms.with_ramp(level)
    assert not assert_parity(core, view).room.relief.is_flat()


@pytest.mark.parametrize("seed", range(3))
def test_a_ramp_that_only_walls_show(core, seed):
    found = assert_parity(core, rooms.ramp_in_smoke(0.008, seed))
    assert len(found.room.relief.facets) > 1


def test_a_ramp_that_measured_floor_denies(core):
    flat = rooms.ramp_in_smoke(0.008, 0, denied=True)
    assert assert_parity(core, flat).room.relief.is_flat()


def test_the_last_good_floor_is_kept(core):
    methods = core.RoomBoundary(), RoomBoundary()
    view = box()
    assert_parity(core, view, methods=methods)
    above = view.select(view.xyz[:, 2] > 0.0)
    found = assert_parity(core, above, methods=methods)
    assert found.floor.source == 1


def test_real_scans(core, every_real_scan):
    assert len(assert_parity(core, rooms.read_scan(every_real_scan)).surface) > 0


@pytest.mark.parametrize("count", [0, 1, 10])
def test_few_points(core, count):
    assert_parity(core, box().select(slice(0, count)))


def test_one_ring_nothing_but_nan_and_no_order(core):
    view = box()
    assert_parity(core, view.select(view.ring == 3))
    assert_parity(core, view._replace(xyz=np.full_like(view.xyz, np.nan)))
    order = np.random.default_rng(0).permutation(len(view.xyz))
    assert_parity(core, view.select(order))


@pytest.mark.parametrize("seed", range(3))
def test_the_pipeline_s_answer(core, seed):
    params = Params.from_dict({"reconstructor": {"method": "room_boundary"}})
    view, rotation = turned(drilled(box(seed=seed), seed), 1.0, 4.0)
    actual, expected = (
        Pipeline(params, engine).process(*view, rotation=rotation) for engine in ("cpp", "python")
    )
    np.testing.assert_array_equal(actual.labels, expected.labels)
    np.testing.assert_array_equal(actual.clusters, expected.clusters)
    np.testing.assert_array_equal(actual.surface, expected.surface)
    np.testing.assert_allclose(actual.sigma, expected.sigma, rtol=1e-4)
    assert_same_grid(actual.occupancy, expected.occupancy)
    assert list(actual.times) == list(expected.times)
