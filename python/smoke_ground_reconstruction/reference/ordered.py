"""Sums in one fixed order, and small linear algebra written out.

np.sum adds in an order of its own and LAPACK in another on each machine; what decisions hang on is
added here in the order in which the compiled core adds, so that both agree to the last bit.
"""

import math

import numpy as np

_LANES = 4


def ordered_sum(values):
    """Sum (float) of float64 values (N,): four running sums, of every fourth each, then theirs."""
    padded = np.zeros(-(-len(values) // _LANES) * _LANES + _LANES)
    padded[_LANES : _LANES + len(values)] = values
    a, b, c, d = np.cumsum(padded.reshape(-1, _LANES), axis=0)[-1]
    return float((a + b) + (c + d))


def symmetric_inverse(m):
    """Inverse (3, 3) of a symmetric matrix, by its cofactors; only the upper half is read."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = m.tolist()
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, e, f = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = (xx * a + xy * b) + xz * c
    return np.array([[a, b, c], [b, d, e], [c, e, f]]) / determinant


def times(m, v):
    """Product of a matrix (3, 3) and a vector (3,) in the written order."""
    return np.array([(row[0] * v[0] + row[1] * v[1]) + row[2] * v[2] for row in m])


def least_axis(xx, xy, yy):
    """Unit vector (x, y) along which a symmetric (2, 2) spread is least, and that spread."""
    half = 0.5 * (xx - yy)
    radius = math.sqrt(half * half + xy * xy)
    x, y = (-xy, half + radius) if half >= 0.0 else (radius - half, -xy)
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 1.0, 0.0, 0.5 * (xx + yy)
    return x / length, y / length, 0.5 * (xx + yy) - radius
