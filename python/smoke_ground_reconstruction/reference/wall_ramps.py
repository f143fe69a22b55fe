"""A ramp that the feet of walls show where smoke hides its floor.

A ramp stops the beams that would meet a wall below it: the wall's lowest returns rise along it as
the ramp does, from the floor's plane on. Not in the thesis.
"""

from dataclasses import dataclass

import numpy as np

from .ordered import ordered_sum
from .relief_facets import LEVEL, ON_PLANE, STEEPER

_BIN = 0.1  # along a wall; its lowest return tells [m]
_FARTHEST = 69.9  # place along a wall [m]
_SHORTEST = 0.5  # ramp along a wall [m]
_LEAST_RISE = 2.0 * ON_PLANE
_SEEN = 0.05  # a wall's lowest returns lie so near above its foot ... [m]
_SEEN_SHARE = 0.85  # in so many bins where smoke does not cut them off


@dataclass(frozen=True)
class WallRamp:
    """A slope from the floor's plane up, along a wall.

    Attributes
    ----------
    facet : list of float
        a, b [1], c [m] of height = a x + b y + c over the plane.
    top : float
        How high it is seen [m].
    """

    facet: list
    top: float


def find_wall_ramp(line, along, height, normals, max_slope):
    """The longest ramp along a wall, None where none is seen.

    Parameters
    ----------
    line : (N,) int64
        Number of the wall that a return stands on.
    along, height : (N,) float64
        Place along it, which is nx y - ny x, and height over the plane [m].
    normals : (lines, 2) float64
        nx, ny.
    max_slope : float
    """
    best, longest = None, 0.0
    for number, feet in _feet_by_wall(line, along, height):
        hull = _lower_hull(feet)
        for ends in zip(hull[:-1], hull[1:]):
            (x, h), (to_x, to_h) = ends
            slope = (to_h - h) / (to_x - x)
            if to_x - x > longest and _may_be_ramp(ends, slope, max_slope):
                over = _over(feet, ends, slope)
                if len(over) >= _SEEN_SHARE * ((to_x - x) / _BIN):
                    longest = to_x - x
                    best = WallRamp(_facet(ends, slope, over, normals[number]), max(h, to_h))
    return best


def places_of_feet(line, along, height, normals, rho):
    """Places and heights (M, 3) of the feet of walls, one after the other.

    The arguments are those of `find_wall_ramp`, and the walls' distances rho (lines,) [m].
    """
    places = [np.zeros((0, 3))]
    for number, feet in _feet_by_wall(line, along, height):
        (nx, ny), (place, low) = normals[number], feet.T
        x, y = nx * rho[number] - ny * place, ny * rho[number] + nx * place
        places.append(np.column_stack([x, y, low]))
    return np.concatenate(places)


def _feet_by_wall(line, along, height):
    """Pairs of a wall's number and its feet."""
    near = np.abs(along) < _FARTHEST
    line, along, height = line[near], along[near], height[near]
    return [(n, _feet(along[line == n], height[line == n])) for n in np.unique(line)]


def _feet(along, height):
    """Place and height (B, 2) of the lowest return of each bin, by place."""
    slot = np.floor(along / _BIN).astype(np.int64)
    order = np.lexsort((along, height, slot))
    _, first = np.unique(slot[order], return_index=True)
    return np.column_stack([along[order][first], height[order][first]])


def _lower_hull(feet):
    hull = []
    for x, h in feet:
        while len(hull) > 1:
            (x0, h0), (x1, h1) = hull[-2:]
            if (x1 - x0) * (h - h1) > (x - x1) * (h1 - h0):
                break
            hull.pop()
        hull.append((x, h))
    return hull


def _may_be_ramp(ends, slope, max_slope):
    """Does a stretch of the hull rise from the plane as a climbable slope does?"""
    (x, h), (to_x, to_h) = ends
    climbs = LEVEL < abs(slope) < STEEPER * max_slope and max(h, to_h) > _LEAST_RISE
    return climbs and to_x - x > _SHORTEST and min(abs(h), abs(to_h)) < ON_PLANE


def _over(feet, ends, slope):
    """How far the feet along a stretch lie over it [m], of those that are near."""
    (x, h), (to_x, _) = ends
    inside = feet[(feet[:, 0] >= x) & (feet[:, 0] <= to_x)]
    over = inside[:, 1] - (h + slope * (inside[:, 0] - x))
    return over[over < _SEEN]


def _facet(ends, slope, over, normal):
    """The plane that rises along a wall, lower than its feet by what the lowest of so many are."""
    x, h = ends[0]
    count = len(over)
    rest = (h - slope * x) - 2.0 * ordered_sum(over) / (count * (count - 2.0))
    return [-slope * normal[1], slope * normal[0], rest]
