"""Convex polygons of the plane by arrays of their corners, compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]

SHORT = 1e-10
"""An edge shorter than this [m] is a corner: far below a sole, far above the rounding of a clip."""
FAR = 1e3
"""Half the side of the square that clipping starts from [m]; no robot in sight steps as far."""
# Twice an area below this [m^2] is none.
_FLAT = 1e-18
# Splits a double into two halves of 26 bits.
_HALVES = 134217729.0


@compiled
def length_of(x: float, y: float) -> float:
    """`math.hypot(x, y)` [m], also in its last bit, of numbers whose squares neither overflow nor vanish.

    The library's own is off by a last bit once in some hundred times.
    """
    square = x * x + y * y
    if square == 0.0 or not math.isfinite(square):
        return math.sqrt(square)
    length = math.sqrt(square)
    # What is left of x^2 + y^2 - length^2, exactly but for its own rounding.
    left = 0.0
    total = 0.0
    for value, sign in ((x, 1.0), (y, 1.0), (length, -1.0)):
        cut = value * _HALVES
        high = cut - (cut - value)
        low = value - high
        part = sign * (value * value)
        left += sign * (((high * high - value * value) + 2.0 * high * low) + low * low)
        new = total + part
        kept = new - total
        left += (total - (new - kept)) + (part - kept)
        total = new
    return length + (total + left) / (2.0 * length)


@compiled
def nearest(points: Array, x: float, y: float) -> tuple[float, float]:
    """Point of a convex polygon (n, 2), counter-clockwise, not empty, perhaps flat, that is nearest to (x, y)."""
    inside, twice = True, 0.0
    best, found = math.inf, (points[0, 0], points[0, 1])
    ax, ay = points[-1, 0], points[-1, 1]
    for i in range(len(points)):
        bx, by = points[i, 0], points[i, 1]
        ex, ey, wx, wy = bx - ax, by - ay, x - ax, y - ay
        turn = ex * wy - ey * wx
        twice += turn
        if turn < 0.0:
            inside = False
        square = ex * ex + ey * ey
        along = min(max((wx * ex + wy * ey) / square, 0.0), 1.0) if square > 0.0 else 0.0
        px, py = ax + along * ex, ay + along * ey
        distance = (x - px) * (x - px) + (y - py) * (y - py)
        if distance < best:
            best, found = distance, (px, py)
        ax, ay = bx, by
    # Every point in line with a flat polygon is on no outer side of its edges.
    return (x, y) if inside and twice > _FLAT else found


@compiled
def clipped(points: Array, normals: Array, offsets: Array) -> Array:
    """What half-planes, normals (m, 2) and offsets (m,), leave of a convex polygon (n, 2); none if nothing."""
    # A cut adds one corner, and rounding seldom another.
    count = len(points)
    now, then = np.empty((count + 2 * len(offsets), 2)), np.empty((count + 2 * len(offsets), 2))
    now[:count] = points
    for k in range(len(offsets)):
        if count == 0:
            break
        if len(then) < 2 * count:
            then = np.empty((2 * count, 2))
        nx, ny, offset = normals[k, 0], normals[k, 1], offsets[k]
        kept = 0
        ax, ay = now[count - 1, 0], now[count - 1, 1]
        before = offset - nx * ax - ny * ay
        for i in range(count):
            bx, by = now[i, 0], now[i, 1]
            after = offset - nx * bx - ny * by
            if (before < 0.0) != (after < 0.0):
                t = before / (before - after)
                then[kept, 0], then[kept, 1] = ax + t * (bx - ax), ay + t * (by - ay)
                kept += 1
            if after >= 0.0:
                then[kept, 0], then[kept, 1] = bx, by
                kept += 1
            ax, ay, before = bx, by, after
        now, then, count = then, now, kept
    return now[:count]


@compiled
def tangents(points: Array) -> Array:
    """Outward unit normals (2, 2) of the two lines through the origin that touch a convex polygon (n, 2).

    None (0, 2) if the polygon holds the origin.
    """
    left = right = 0
    for i in range(1, len(points)):
        x, y = points[i, 0], points[i, 1]
        if points[left, 0] * y - points[left, 1] * x > 0.0:
            left = i
        if points[right, 0] * y - points[right, 1] * x < 0.0:
            right = i
    found = np.array([[-points[left, 1], points[left, 0]], [points[right, 1], -points[right, 0]]])
    for k in range(2):
        nx, ny = found[k, 0], found[k, 1]
        length = length_of(nx, ny)
        most = -math.inf
        for i in range(len(points)):
            most = max(most, nx * points[i, 0] + ny * points[i, 1])
        if length <= SHORT or most > SHORT * length:
            return np.empty((0, 2))
        found[k, 0], found[k, 1] = nx / length, ny / length
    return found
