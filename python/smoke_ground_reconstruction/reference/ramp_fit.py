"""The slope of a ramp, fitted to all that lies on it.

A few cells, or the feet of one wall, tell roughly how a ramp rises. Returns of its floor that lie
near to that, be they ever so scattered, and the feet of all walls, which stand on it or are seen no
farther down, tell better. Not in the thesis.
"""

import math

import numpy as np

from .ordered import ordered_sum
from .relief_facets import LEVEL, STEEPER, Crease

_NEAR = 0.03  # what lies so near to the ramp belongs to it [m]
_CLEAR = 0.05  # of the lines at which it begins and ends [m]
_ON_FOOT, _OVER_FOOT = 0.2, 0.01  # weight of a wall's lowest returns below the ramp and over it
_FEWEST = 12
_PASSES = 5
_PRIOR = 0.05  # weight of the slope as it was [m^2]
_ALONG = 0.996  # cosine between the slope and a wall's normal or the wall: 5 deg


def find_slope(facets):
    """Number of the only facet that slopes; None if there is none, or more."""
    slopes = np.flatnonzero((facets[:, 0] != 0.0) | (facets[:, 1] != 0.0))
    return int(slopes[0]) if len(slopes) == 1 else None


def fit_ramp(facets, creases, floor, feet, normals, max_slope):
    """Facets and creases with the only slope fitted anew.

    As they are if more or less than one slopes, or if too little lies on it.

    Parameters
    ----------
    facets : (F, 3) float64
        Of a relief.
    creases : sequence of Crease
    floor, feet : (N, 3) float64
        Place and height over the plane of low returns off the walls, and of the lowest ones of
        walls [m].
    normals : (W, 2) float64
        Of the room's walls: a slope nearly along one, or across it, is taken to be so.
    max_slope : float
    """
    number = find_slope(facets)
    if number is None:
        return facets, creases
    before = facets[number]
    rise = math.sqrt(before[0] * before[0] + before[1] * before[1])
    up = _up((before[0] / rise, before[1] / rise), normals)
    ends = _ends(number, facets, creases, up)
    facet, slope = before, rise
    for _ in range(_PASSES):
        place, height, weight = _on(facet, slope, ends, up, floor, feet)
        if len(place) < _FEWEST:
            return facets, creases
        slope, facet = _through(place, height, weight, rise, up)
        if not LEVEL < slope < STEEPER * max_slope:
            return facets, creases
    fitted = facets.copy()
    fitted[number] = facet
    turned = [_moved(crease, number, fitted, up, slope) for crease in creases]
    return fitted, tuple(turned)


def _up(gradient, normals):
    """The way up: along or across a wall if nearly so."""
    for x, y in normals:
        for way in ((x, y), (-y, x), (-x, -y), (y, -x)):
            if way[0] * gradient[0] + way[1] * gradient[1] > _ALONG:
                return way
    return gradient


def _ends(number, facets, creases, up):
    """Heights between which the slope lies [m]."""
    lowest, highest = -math.inf, math.inf
    for crease in creases:
        if crease.of == number:
            level = facets[crease.to][2]
            if crease.nx * up[0] + crease.ny * up[1] > 0.0:
                highest = min(highest, level)
            else:
                lowest = max(lowest, level)
    return lowest, highest


def _on(facet, slope, ends, up, floor, feet):
    """What lies on the ramp: place along the slope, height, weight."""
    margin = _CLEAR * slope
    found = []
    for points, weights in ((floor, (1.0, 1.0)), (feet, (_ON_FOOT, _OVER_FOOT))):
        x, y, height = points.T
        model = (facet[0] * x + facet[1] * y) + facet[2]
        on = (np.abs(height - model) < _NEAR) & (model > ends[0] + margin)
        on &= model < ends[1] - margin
        weight = np.where(height < model, *weights)
        found.append([(up[0] * x + up[1] * y)[on], height[on], weight[on]])
    return (np.concatenate(parts) for parts in zip(*found))


def _through(place, height, weight, rise, up):
    """Weighted least squares along the slope: how it rises, and the facet."""
    total = ordered_sum(weight)
    mean_place = ordered_sum(weight * place) / total
    mean_height = ordered_sum(weight * height) / total
    place, height = place - mean_place, height - mean_height
    square = ordered_sum(weight * (place * place)) + _PRIOR
    slope = (ordered_sum(weight * (place * height)) + _PRIOR * rise) / square
    return slope, [slope * up[0], slope * up[1], mean_height - slope * mean_place]


def _moved(crease, number, facets, up, slope):
    """A crease of the slope where it meets the other facet now."""
    if number not in (crease.of, crease.to):
        return crease
    other = crease.to if crease.of == number else crease.of
    rho = (facets[other][2] - facets[number][2]) / slope
    if crease.nx * up[0] + crease.ny * up[1] > 0.0:
        return Crease(crease.of, crease.to, up[0], up[1], rho)
    return Crease(crease.of, crease.to, -up[0], -up[1], -rho)
