"""Pieces of furniture, people and robots as upright prisms.

Each piece is a function that reads its own keys and returns prisms in the piece's own frame: x to
the front, z from the floor beneath. Tables and chairs stand on legs and have undersides.
"""

from dataclasses import dataclass

import numpy as np

from . import geometry


@dataclass(frozen=True)
class Prism:
    """An upright prism: `polygon` (N, 2) counter-clockwise, from z `bottom` to `top` [m]."""

    polygon: np.ndarray
    bottom: float
    top: float
    reflectivity: float

    def placed(self, at, yaw_deg, floor_z):
        """The prism moved into the frame of the room."""
        polygon = geometry.place(self.polygon, at, yaw_deg)
        return Prism(polygon, self.bottom + floor_z, self.top + floor_z, self.reflectivity)

    def faces(self):
        """Facets as lists of one loop (N, 3): sides, bottom and top."""

        def at_height(points, z):
            return np.column_stack([points, np.full(len(points), z)])

        sides = [
            [
                np.vstack(
                    [
                        at_height(np.array([a, b]), self.bottom),
                        at_height(np.array([b, a]), self.top),
                    ]
                )
            ]
            for a, b in geometry.edges(self.polygon)
        ]
        caps = [[at_height(self.polygon, z)] for z in (self.bottom, self.top)]
        return sides + caps

    def contains(self, position):
        """Does the point (x, y, z) lie inside?"""
        in_plan = geometry.contains(self.polygon, [position[:2]])[0]
        return bool(in_plan and self.bottom <= position[2] <= self.top)


def _block(size, bottom, top, reflectivity, offset=(0.0, 0.0)):
    return Prism(geometry.rectangle(*size, offset=offset), bottom, top, reflectivity)


def _rod(radius, bottom, top, reflectivity, offset=(0.0, 0.0), sides=8):
    return Prism(geometry.disc(radius, offset=offset, sides=sides), bottom, top, reflectivity)


def _legs(size, inset, height, radius, reflectivity):
    x, y = 0.5 * size[0] - inset, 0.5 * size[1] - inset
    corners = [(x, y), (-x, y), (-x, -y), (x, -y)]
    return [_rod(radius, 0.0, height, reflectivity, corner) for corner in corners]


def _size(keys, default):
    """[x, y, z] extents, each above 0."""
    size = keys.numbers("size", 3, default)
    if min(size) <= 0:
        raise keys.error("size", f"each extent must be above 0, not {list(size)}")
    return size


def box(keys, reflectivity):
    """A box; `lift`: how high its underside is above the floor."""
    size = _size(keys, (0.5, 0.5, 0.5))
    lift = keys.number("lift", 0.0, 0.0, 20.0)
    return [_block(size[:2], lift, lift + size[2], reflectivity)]


def cylinder(keys, reflectivity):
    """An upright cylinder; `lift` as for a box."""
    radius = keys.number("radius", 0.2, 0.01, 10.0)
    height = keys.number("height", 0.8, 0.01, 20.0)
    lift = keys.number("lift", 0.0, 0.0, 20.0)
    return [_rod(radius, lift, lift + height, reflectivity, sides=24)]


def table(keys, reflectivity):
    """A top of 4 cm on four legs."""
    size = _size(keys, (1.4, 0.7, 0.74))
    top = _block(size[:2], size[2] - 0.04, size[2], reflectivity)
    return [top] + _legs(size, 0.06, size[2] - 0.04, 0.025, reflectivity)


def desk(keys, reflectivity):
    """A table with a drawer unit under one end."""
    size = _size(keys, (1.6, 0.8, 0.74))
    drawers = _block((0.42, size[1] - 0.15), 0.05, 0.60, reflectivity, (0.5 * size[0] - 0.32, 0.0))
    top = _block(size[:2], size[2] - 0.03, size[2], reflectivity)
    return [top, drawers] + _legs(size, 0.05, size[2] - 0.03, 0.025, reflectivity)


def chair(keys, reflectivity):
    """A four-legged chair, back to the rear."""
    size = _size(keys, (0.45, 0.45, 0.85))
    seat = _block(size[:2], 0.42, 0.47, reflectivity)
    back = _block((0.04, size[1]), 0.47, size[2], reflectivity, (-0.5 * size[0] + 0.02, 0.0))
    return [seat, back] + _legs(size, 0.03, 0.42, 0.015, reflectivity)


def office_chair(keys, reflectivity):
    """Seat and back on a post with five feet on castors."""
    feet = []
    for i in range(5):
        foot = geometry.rectangle(0.27, 0.05, yaw_deg=72.0 * i, offset=(0.15, 0.0))
        feet.append(Prism(foot, 0.05, 0.10, reflectivity))
        castor = geometry.disc(0.025, yaw_deg=72.0 * i, offset=(0.27, 0.0), sides=8)
        feet.append(Prism(castor, 0.0, 0.06, reflectivity))
    post = _rod(0.03, 0.08, 0.44, reflectivity)
    seat = _block((0.48, 0.50), 0.44, 0.52, reflectivity)
    back = _block((0.06, 0.46), 0.58, 1.08, reflectivity, (-0.24, 0.0))
    return feet + [post, seat, back]


def flip_over_board(keys, reflectivity):
    """A writing board on two posts with cross feet."""
    prisms = [_block((0.03, 0.70), 0.85, 1.90, reflectivity)]
    for side in (-0.33, 0.33):
        prisms.append(_block((0.60, 0.04), 0.0, 0.05, reflectivity, (0.0, side)))
        prisms.append(_rod(0.02, 0.05, 0.85, reflectivity, (0.0, side)))
    return prisms


def sofa(keys, reflectivity):
    """Seat, back and two arms on short feet."""
    size = _size(keys, (0.85, 1.9, 0.80))
    seat = _block(size[:2], 0.10, 0.42, reflectivity)
    back = _block((0.20, size[1]), 0.42, size[2], reflectivity, (-0.5 * size[0] + 0.10, 0.0))
    arms = [
        _block((size[0], 0.18), 0.42, 0.60, reflectivity, (0.0, y))
        for y in (-0.5 * size[1] + 0.09, 0.5 * size[1] - 0.09)
    ]
    return [seat, back] + arms + _legs(size, 0.08, 0.10, 0.03, reflectivity)


def cabinet(keys, reflectivity):
    """A closed cupboard; `lift` is the gap under it, bridged by four feet."""
    size = _size(keys, (0.4, 1.0, 1.9))
    lift = keys.number("lift", 0.0, 0.0, 1.0)
    body = _block(size[:2], lift, lift + size[2], reflectivity)
    return [body] + (_legs(size, 0.05, lift, 0.025, reflectivity) if lift > 0 else [])


def shelf(keys, reflectivity):
    """An open display cabinet: two sides, a back and five boards."""
    x, y, z = _size(keys, (0.35, 0.9, 1.8))
    boards = [
        _block((x, y - 0.06), level, level + 0.025, reflectivity)
        for level in np.linspace(0.08, z - 0.025, 5)
    ]
    sides = [_block((x, 0.03), 0.0, z, reflectivity, (0.0, s * (0.5 * y - 0.015))) for s in (-1, 1)]
    back = _block((0.02, y - 0.06), 0.08, z, reflectivity, (-0.5 * x + 0.01, 0.0))
    return boards + sides + [back]


def person(keys, reflectivity):
    """Two legs, a trunk and a head."""
    height = keys.number("height", 1.75, 0.5, 2.5)
    radius = keys.number("radius", 0.22, 0.1, 0.5)
    legs = [_rod(0.08, 0.0, 0.48 * height, reflectivity, (0.0, y), 12) for y in (-0.11, 0.11)]
    trunk = _rod(radius, 0.48 * height, 0.86 * height, reflectivity, sides=20)
    head = _rod(0.10, 0.86 * height, height, reflectivity, sides=12)
    return legs + [trunk, head]


PIECES = {
    piece.__name__: piece
    for piece in (
        box,
        cylinder,
        table,
        desk,
        chair,
        office_chair,
        flip_over_board,
        sofa,
        cabinet,
        shelf,
    )
}
