"""Rotations and cross products of single vectors; numpy's own cost many times more for three numbers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]

# Below this angle [rad] the series is exact to rounding.
_SMALL = 1e-6


@compiled
def skew(v: Array) -> Array:
    """(3, 3) with skew(v) @ u = v x u."""
    x, y, z = v[0], v[1], v[2]
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@compiled
def cross(a: Array, b: Array) -> Array:
    """(3,) a x b."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@compiled
def turn(v: Array) -> Array:
    """(3, 3) rotation about a vector (3,) by its length [rad]."""
    x, y, z = v[0], v[1], v[2]
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


@compiled
def from_quaternion(quaternion: Array) -> Array:
    """(3, 3) rotation of a unit quaternion (w x y z)."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@compiled
def to_quaternion(rotation: Array) -> Array:
    """Unit quaternion (w x y z) of a rotation (3, 3), with its largest component positive."""
    a, b, c = rotation[0, 0], rotation[0, 1], rotation[0, 2]
    d, e, f = rotation[1, 0], rotation[1, 1], rotation[1, 2]
    g, h, i = rotation[2, 0], rotation[2, 1], rotation[2, 2]
    # four times the squares of w, x, y, z: the largest is the one to divide by
    squares = np.array([1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i])
    largest = squares.argmax()
    if largest == 0:
        parts = np.array([squares[0], h - f, c - g, d - b])
    elif largest == 1:
        parts = np.array([h - f, squares[1], b + d, c + g])
    elif largest == 2:
        parts = np.array([c - g, b + d, squares[2], f + h])
    else:
        parts = np.array([d - b, c + g, f + h, squares[3]])
    return parts / math.sqrt((parts * parts).sum())
