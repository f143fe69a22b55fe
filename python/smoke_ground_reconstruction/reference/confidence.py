"""How sure each point of the floor is."""

import numpy as np

from .floor_surface import BoundaryKind

_MEASURED = 0.99
_DRAWN = {
    BoundaryKind.WALL_SEEN: 0.99,
    BoundaryKind.WALL_INFERRED: 0.97,
    BoundaryKind.LIMIT_OF_KNOWLEDGE: 0.96,
}


def measured_confidence(room, claim):
    """Of the measured points, float32 in the order of ``np.flatnonzero(claim.measured)``.

    Parameters
    ----------
    room : Room
    claim : FloorClaim
    """
    return np.full(np.count_nonzero(claim.measured), _MEASURED, np.float32)


def drawn_confidence(room, claim, drawn):
    """Of the drawn points, float32 (M,).

    Parameters
    ----------
    room : Room
    claim : FloorClaim
    drawn : DrawnFloor
    """
    by_kind = np.array([_DRAWN[BoundaryKind(kind)] for kind in range(3)], np.float32)
    return by_kind[room.profile.kind[drawn.column]]
