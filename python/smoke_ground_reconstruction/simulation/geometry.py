"""Polygons in the plane: what scene files are made of. All lengths in metres."""

import math

import numpy as np


def arc(centre, radius, from_deg, to_deg, segments):
    """Vertices (segments + 1, 2) along a circle, both ends included."""
    angles = np.radians(np.linspace(from_deg, to_deg, segments + 1))
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def area(polygon):
    """Signed area [m^2], positive for counter-clockwise (N, 2)."""
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def counter_clockwise(polygon):
    """The same polygon with positive area."""
    return polygon if area(polygon) > 0 else polygon[::-1]


def contains(polygon, points):
    """Even-odd test: which of the points (M, 2) lie inside the polygon (N, 2); bool (M,)."""
    points = np.asarray(points, dtype=float)
    inside = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (x0, y0), (x1, y1) in edges(polygon):
        if y0 == y1:
            continue
        crosses = (y0 > y) != (y1 > y)
        inside ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return inside


def edges(polygon):
    """Pairs of consecutive vertices, the last joined to the first."""
    return list(zip(polygon, np.roll(polygon, -1, axis=0)))


def distance_to_edges(polygon, points):
    """Distance [m] of each point (M, 2) to the polygon's outline; (M,)."""
    points = np.asarray(points, dtype=float)
    nearest = np.full(len(points), math.inf)
    for start, end in edges(polygon):
        nearest = np.minimum(nearest, distance_to_segment(start, end, points))
    return nearest


def distance_to_segment(start, end, points):
    """Distance [m] of each point (M, 2) to the segment from start to end; (M,)."""
    along = np.asarray(end, dtype=float) - start
    share = (points - start) @ along / max(float(along @ along), 1e-300)
    foot = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.linalg.norm(points - foot, axis=1)


def crossing_edges(polygon):
    """Two edges that cross or touch without being neighbours, or None."""
    sides = edges(polygon)
    for i in range(len(sides)):
        for j in range(i + 1, len(sides)):
            are_neighbours = j == i + 1 or (i == 0 and j == len(sides) - 1)
            if not are_neighbours and _cross(*sides[i], *sides[j]):
                return i, j
    return None


def _cross(a, b, c, d):
    def side(p, q, r):
        return np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    if side(a, b, c) * side(a, b, d) > 0 or side(c, d, a) * side(c, d, b) > 0:
        return False
    overlap_x = max(min(a[0], b[0]), min(c[0], d[0])) <= min(max(a[0], b[0]), max(c[0], d[0]))
    overlap_y = max(min(a[1], b[1]), min(c[1], d[1])) <= min(max(a[1], b[1]), max(c[1], d[1]))
    return bool(overlap_x and overlap_y)


def rectangle(size_x, size_y, at=(0.0, 0.0), yaw_deg=0.0, offset=(0.0, 0.0)):
    """A rectangle (4, 2), counter-clockwise, its centre at `offset` in a frame at `at` and yaw."""
    corners = 0.5 * np.array(
        [[-size_x, -size_y], [size_x, -size_y], [size_x, size_y], [-size_x, size_y]]
    ) + np.asarray(offset)
    return place(corners, at, yaw_deg)


def disc(radius, at=(0.0, 0.0), yaw_deg=0.0, offset=(0.0, 0.0), sides=20):
    """A regular polygon (sides, 2) of the circle's own area."""
    circumradius = radius * math.sqrt(2 * math.pi / (sides * math.sin(2 * math.pi / sides)))
    angles = 2 * math.pi * np.arange(sides) / sides
    corners = circumradius * np.column_stack([np.cos(angles), np.sin(angles)]) + np.asarray(offset)
    return place(corners, at, yaw_deg)


def place(points, at, yaw_deg):
    """Turns (N, 2) by yaw about the origin and moves it to `at`."""
    yaw = math.radians(yaw_deg)
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    return points @ turn.T + np.asarray(at)


def rotation(yaw_deg, pitch_deg=0.0, roll_deg=0.0):
    """Rotation matrix (3, 3): roll about x first, then pitch about y, then yaw about z."""
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    about_z = np.array(
        [[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]]
    )
    about_y = np.array(
        [[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]]
    )
    about_x = np.array(
        [[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]]
    )
    return about_z @ about_y @ about_x
