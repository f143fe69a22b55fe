"""What a scan of a room shows, for /diagnostics; free of ROS."""

import math

from ..reference.floor_model import FloorSource

_HEIGHT_TOLERANCE = 0.03  # between the given and the measured height of the sensor [m]
_HEIGHT_FROM = {
    FloorSource.MEASURED: "this scan",
    FloorSource.MEASURED_BEFORE: "an earlier scan",
}


def findings_of(room, sensor_height, given_by):
    """Texts by name of a RoomBoundaryResult.

    Parameters
    ----------
    room : RoomBoundaryResult
    sensor_height : float
        As given [m].
    given_by : str
        What gives it, MountingSource.height_is_from.
    """
    told = room.visibility
    is_known = not math.isnan(told.extinction)
    return {
        "sensor height given [m]": f"{sensor_height:.3f}",
        "sensor height measured [m]": f"{_measured_height(room.floor):.3f}",
        "floor's height from": _HEIGHT_FROM.get(room.floor.source, given_by),
        "extinction [1/m]": f"{told.extinction:.3f}" if is_known else "unknown",
        "extinction sigma [1/m]": f"{told.sigma:.3f}" if is_known else "unknown",
        "meteorological range [m]": f"{told.meteorological_range:.1f}" if is_known else "unknown",
    }


def height_warning(floor, sensor_height, given_by):
    """What is wrong with the height given, in one line; empty where nothing is.

    Parameters
    ----------
    floor : FloorModel
    sensor_height : float
        As given [m].
    given_by : str
        What gives it, MountingSource.height_is_from.
    """
    if floor.source == FloorSource.MOUNTING:
        return (
            f"the floor's height is not measured, {given_by} is believed: too few returns lie "
            f"about {sensor_height:.2f} m below the sensor (thick smoke, or a wrong height)"
        )
    measured = _measured_height(floor)
    if abs(measured - sensor_height) <= _HEIGHT_TOLERANCE:
        return ""
    return (
        f"{given_by} puts the sensor {sensor_height:.2f} m above the floor, "
        f"measured is {measured:.2f} m"
    )


def _measured_height(floor):
    return -float(floor.plane[2])
