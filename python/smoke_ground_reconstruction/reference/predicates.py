"""Every decision of the method, written once.

Only operations that IEEE 754 defines to the last bit are used (+, -, *, sqrt on float64), in one
fixed order, so that this module and the compiled core decide alike. Trees and angles may propose
candidates; these functions judge. Inputs are float32 arrays of one shape, results float64 or bool.
"""

import math
from typing import NamedTuple

import numpy as np

#: Largest coordinate of a return [m]. No LiDAR ranges so far: it is garbage, of which squares in
#: single precision, grids and rotations would make infinities.
FARTHEST_RETURN = 1e6


def is_return(xyz):
    """Is each (N, 3) point a return? Returns bool (N,).

    Finite, no coordinate beyond `FARTHEST_RETURN`, and not (0, 0, 0).
    """
    with np.errstate(invalid="ignore"):  # old NumPy warns of NaN, for which this is False
        in_reach = (np.abs(xyz) <= FARTHEST_RETURN).all(axis=1)
    return in_reach & (xyz != 0.0).any(axis=1)


def squared_distance(a, b):
    """Squared distance [m^2] of points ``a`` and ``b``, float32 (..., 3): (dx^2 + dy^2) + dz^2."""
    difference = a.astype(np.float64) - b.astype(np.float64)
    dx, dy, dz = difference[..., 0], difference[..., 1], difference[..., 2]
    return (dx * dx + dy * dy) + dz * dz


def planar_range(xyz):
    """Planar range sqrt(x^2 + y^2) [m] of float32 (..., 3) points."""
    x, y = xyz[..., 0].astype(np.float64), xyz[..., 1].astype(np.float64)
    return np.sqrt(x * x + y * y)


def range_(xyz):
    """Range sqrt(x^2 + y^2 + z^2) [m] of float32 (..., 3) points. Algorithm 1 line 13."""
    x, y, z = (xyz[..., axis].astype(np.float64) for axis in range(3))
    return np.sqrt((x * x + y * y) + z * z)


class Direction(NamedTuple):
    """Unit vector at an angle, rounded to float32.

    Libraries that differ in the last bit of cos and sin then still give the same vector. The
    rounding turns it by less than 1e-7 rad.
    """

    cosine: float
    sine: float

    @classmethod
    def from_degrees(cls, angle_deg: float) -> "Direction":
        """Direction at ``angle_deg`` counter-clockwise of the first axis."""
        angle = angle_deg * (math.pi / 180.0)
        return cls(_snapped(math.cos(angle)), _snapped(math.sin(angle)))


def _snapped(value: float) -> float:
    # cos(pi/2) is 6e-17 in doubles; the axes are meant exactly.
    return 0.0 if abs(value) < 1e-12 else float(np.float32(value))


def is_at_or_after(cosine, sine, u, v):
    """True where (u, v) lies counter-clockwise of an edge or on it (within half a turn)."""
    return cosine * v >= sine * u


def is_ahead(direction, u, v):
    """True where (u, v) lies less than a quarter turn from a Direction."""
    return direction.cosine * u + direction.sine * v > 0.0


class AngleWindow(NamedTuple):
    """Closed window of angles, less than half a turn wide, decided by comparing products."""

    start: Direction
    end: Direction

    @classmethod
    def from_degrees(cls, from_deg: float, to_deg: float) -> "AngleWindow":
        """Window of the angles from ``from_deg`` to ``to_deg``."""
        return cls(Direction.from_degrees(from_deg), Direction.from_degrees(to_deg))

    def contains(self, u, v):
        """Is the angle of the vector (u, v) in the window? A zero vector has no angle: False."""
        after_start = is_at_or_after(self.start.cosine, self.start.sine, u, v)
        before_end = self.end.cosine * v <= self.end.sine * u
        # The products alone would take the opposite of a window without width for the window.
        return after_start & before_end & (is_ahead(self.start, u, v) | is_ahead(self.end, u, v))
