"""What a scan of a room shows, for /diagnostics; free of ROS."""

import math

from ..reference.floor_model import FloorSource

_HEIGHT_TOLERANCE = 0.03  # between the given and the measured height of the sensor [m]
_HEIGHT_FROM = {
    FloorSource.MEASURED: "this scan",
    FloorSource.MEASURED_BEFORE: "an earlier scan",
    FloorSource.MOUNTING: "sensor_height",
}


def findings_of(room, sensor_height):
    """Texts by name of a RoomBoundaryResult.

    Parameters
    ----------
    room : RoomBoundaryResult
    sensor_height : float
        As given [m].
    """
    told = room.visibility
    is_known = not math.isnan(told.extinction)
    return {
        "sensor height given [m]": f"{sensor_height:.3f}",
        "sensor height measured [m]": f"{_measured_height(room.floor):.3f}",
        "floor's height from": _HEIGHT_FROM[room.floor.source],
        "extinction [1/m]": f"{told.extinction:.3f}" if is_known else "unknown",
        "extinction sigma [1/m]": f"{told.sigma:.3f}" if is_known else "unknown",
        "meteorological range [m]": f"{told.meteorological_range:.1f}" if is_known else "unknown",
    }


def height_warning(floor, sensor_height):
    """What is wrong with the height given, in one line; empty where nothing is.

    Parameters
    ----------
    floor : FloorModel
    sensor_height : float
        As given [m].
    """
    if floor.source == FloorSource.MOUNTING:
        return "the floor's height is not measured: too little floor near sensor_height is seen"
    measured = _measured_height(floor)
    if abs(measured - sensor_height) <= _HEIGHT_TOLERANCE:
        return ""
    return f"sensor_height is given as {sensor_height:.2f} m, measured {measured:.2f} m"


def _measured_height(floor):
    return -float(floor.plane[2])
