"""`room_boundary` without one of its ingredients: what does each of them gain?

Each entry of WITHOUT puts something plainer, the thesis's own way where it has one, in the place of
one step of the Python reference. The reference itself knows nothing of it.
"""

from contextlib import ExitStack, contextmanager
from dataclasses import replace
from unittest import mock

import numpy as np

from smoke_ground_reconstruction.reference import room, room_boundary, wall_profile
from smoke_ground_reconstruction.reference.drop_offs import DropOffs
from smoke_ground_reconstruction.reference.floor_model import fit_floor
from smoke_ground_reconstruction.reference.floor_relief import FLAT
from smoke_ground_reconstruction.reference.wall_lines import Lines

PREFIX = "room_boundary-"
SEGMENT_COLUMNS = 25
"""Columns of 0.4 deg in one of the thesis's segments of 10 deg."""
_LOWEST = 0.15
"""The floor is looked for this near to the mounting height [m], as the plane is."""

_column_profile, _claim_floor = room.column_profile, room_boundary.claim_floor


def _segments(values):
    return values.reshape(-1, SEGMENT_COLUMNS)


def _least_distance(*arguments):
    """The boundary of a segment is the nearest of its columns' (thesis Section 3.4)."""
    profile = _column_profile(*arguments)
    known = np.where(profile.distance > 0.0, profile.distance, np.inf)
    least = np.repeat(_segments(known).min(axis=1), SEGMENT_COLUMNS)
    distance = np.where(np.isfinite(least), least, 0.0)
    return replace(profile, distance=distance, line=np.full(len(distance), -1))


def _lowest_return(xyz, sensor_height, before=None, params=None):
    """A level floor through the lowest return (the thesis: the lowest wall point)."""
    floor = fit_floor(xyz, sensor_height, before, params)
    low = xyz[np.abs(xyz[:, 2] + sensor_height) < _LOWEST, 2]
    height = low.min() if len(low) else -sensor_height
    return replace(floor, plane=np.array([0.0, 0.0, height]))


def _whole_segments(seen):
    """A segment with a boundary is drawn anew, one without keeps what was measured of it."""
    claim = _claim_floor(seen)
    replaced = np.repeat(_segments(seen.profile.distance > 0.0).any(axis=1), SEGMENT_COLUMNS)
    limit = np.where(replaced, claim.limit, 0.0)
    return replace(claim, limit=limit, measured=claim.measured & ~replaced[seen.column])


def _no_drops(column, planar, height, is_floor, sensor_height, directions, walls, feet, depth):
    none = np.full(len(directions), np.inf)
    return DropOffs(none, none, np.zeros(len(directions)), np.zeros(len(directions), bool))


def _nothing(*arguments):
    return None


WITHOUT = {
    "columns": (
        "one least distance per 10 deg segment",
        [(room, "column_profile", _least_distance)],
    ),
    "lines": (
        "no lines through posts",
        [(room, "find_lines", lambda *_: Lines(*[np.zeros(0)] * 3))],
    ),
    "bridges": (
        "gaps between walls left open",
        [(wall_profile, name, _nothing) for name in ("_bridge", "_follow", "_close_openings")],
    ),
    "ceiling": (
        "ceilings and lintels not looked at",
        [(room, "ceiling_height", lambda height, planar, column: np.inf)],
    ),
    "plane": (
        "a level floor through the lowest return",
        [
            (room_boundary, "fit_floor", _lowest_return),
            (room.Room, "stands_on_walls", lambda self: False),  # nothing doubts that return
        ],
    ),
    "relief": ("a plane alone", [(room, "find_relief", lambda xy, height, planar, params: FLAT)]),
    "merge": (
        "segments of 10 deg kept or replaced whole",
        [(room_boundary, "claim_floor", _whole_segments)],
    ),
    "soft": (
        "near smoke not told from walls",
        [(room.Room, "_soft", lambda seen: np.zeros(len(seen.xyz), bool))],
    ),
    "drops": ("drop-offs not looked for", [(room, "find_drop_offs", _no_drops)]),
}
"""By name: what stands in the ingredient's place, and the steps that are replaced."""


@contextmanager
def without(name):
    """The reference without an ingredient, within this context and this process."""
    with ExitStack() as stack:
        for place, step, stand_in in WITHOUT[name][1]:
            stack.enter_context(mock.patch.object(place, step, stand_in))
        yield
