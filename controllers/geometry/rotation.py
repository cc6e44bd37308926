"""Rotations and cross products of single vectors; numpy's own cost many times more for three numbers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Below this angle [rad] the series is exact to rounding.
_SMALL = 1e-6


def skew(v: Array) -> Array:
    """(3, 3) with skew(v) @ u = v x u."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: Array, b: Array) -> Array:
    """(3,) a x b."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def turn(v: Array) -> Array:
    """(3, 3) rotation about a vector (3,) by its length [rad]."""
    x, y, z = v.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < _SMALL:
        a, b = 1.0, 0.5
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / (angle * angle)
    ax, ay, az = a * x, a * y, a * z
    xx, yy, zz, xy, xz, yz = b * x * x, b * y * y, b * z * z, b * x * y, b * x * z, b * y * z
    return np.array(
        [
            [1.0 - yy - zz, xy - az, xz + ay],
            [xy + az, 1.0 - xx - zz, yz - ax],
            [xz - ay, yz + ax, 1.0 - xx - yy],
        ]
    )


def from_quaternion(quaternion: Array) -> Array:
    """(3, 3) rotation of a unit quaternion (w x y z)."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def to_quaternion(rotation: Array) -> Array:
    """Unit quaternion (w x y z) of a rotation (3, 3), with its largest component positive."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    # four times the squares of w, x, y, z: the largest is the one to divide by
    squares = (1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i)
    largest = max(range(4), key=squares.__getitem__)
    if largest == 0:
        parts = (squares[0], h - f, c - g, d - b)
    elif largest == 1:
        parts = (h - f, squares[1], b + d, c + g)
    elif largest == 2:
        parts = (c - g, b + d, squares[2], f + h)
    else:
        parts = (d - b, c + g, f + h, squares[3])
    quaternion = np.array(parts)
    quaternion /= math.sqrt(float(quaternion @ quaternion))
    return quaternion
