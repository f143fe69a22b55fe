"""What the nodes tell of a scan: the sensor's height and how far it sees."""

from types import SimpleNamespace

import numpy as np

from smoke_ground_reconstruction.nodes.findings import findings_of, height_warning
from smoke_ground_reconstruction.reference.floor_model import FloorSource, fit_floor
from smoke_ground_reconstruction.reference.visibility import UNKNOWN, Visibility


def floor_at(height, given):
    rng = np.random.default_rng(0)
    xy = rng.uniform(-3.0, 3.0, (3000, 2))
    z = -height + 0.005 * rng.standard_normal(3000)
    return fit_floor(np.column_stack([xy, z]).astype(np.float32), given)


def test_a_wrong_sensor_height_is_named_with_the_measured_one():
    warning = height_warning(floor_at(0.81, 0.70), 0.70, "sensor_height")
    assert warning == "sensor_height puts the sensor 0.70 m above the floor, measured is 0.81 m"


def test_a_height_within_three_centimetres_is_no_matter():
    assert height_warning(floor_at(0.72, 0.70), 0.70, "sensor_height") == ""


def test_a_floor_out_of_reach_is_said_not_to_be_measured():
    floor = floor_at(1.20, 0.70)
    assert floor.source == FloorSource.MOUNTING
    warning = height_warning(floor, 0.70, "tf from 'base_link'")
    assert "not measured, tf from 'base_link' is believed" in warning
    room = SimpleNamespace(floor=floor, visibility=UNKNOWN)
    assert findings_of(room, 0.70, "tf")["floor's height from"] == "tf"


def test_findings_of_a_scan():
    room = SimpleNamespace(floor=floor_at(0.81, 0.70), visibility=Visibility(0.3, 0.03))
    found = findings_of(room, 0.70, "sensor_height")
    assert found["sensor height given [m]"] == "0.700"
    assert found["sensor height measured [m]"].startswith("0.81")
    assert found["floor's height from"] == "this scan"
    assert found["extinction [1/m]"] == "0.300"
    assert found["meteorological range [m]"] == "10.0"  # ln(20) / 0.3
    room.visibility = UNKNOWN
    assert findings_of(room, 0.70, "sensor_height")["meteorological range [m]"] == "unknown"
