"""The slacks of a state in the sets of one step, of two, ..., compiled; see `build` for what the sets are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.planar_kernel import length_of, tangents

Array = NDArray[np.float64]


@compiled
def corners_of(box: Array) -> Array:
    """The four (4, 2), counter-clockwise, of a box (4,) of lower and upper corner."""
    x1, y1, x2, y2 = box
    return np.array([[x1, y1], [x2, y1], [x2, y2], [x1, y2]])


@compiled
def tangents_of(box: Array) -> Array:
    """`tangents` of a box (4,): most lie on one side of the x axis, and then it is clear which corners they touch."""
    x1, y1, x2, y2 = box
    if y1 > 0.0:
        left_x, left_y, right_x, right_y = x1, y1 if x1 < 0.0 else y2, x2, y1 if x2 > 0.0 else y2
    elif y2 < 0.0:
        left_x, left_y, right_x, right_y = x2, y2 if x2 > 0.0 else y1, x1, y2 if x1 < 0.0 else y1
    else:
        return tangents(corners_of(box))
    wide, narrow = length_of(left_x, left_y), length_of(right_x, right_y)
    return np.array([[-left_y / wide, left_x / wide], [right_y / narrow, -right_x / narrow]])


@compiled
def last_slack(
    normals: Array, offsets: Array, outlines: Array, k: int, near: float, far: float, box: Array, x: float, y: float
) -> float:
    """Slack [m of DCM] of the DCM (x, y) in the set of one step, NaN for NaN.

    Args:
        normals: (J, 2).
        offsets: (J, K + 1) of the set before the landing, without what the box adds.
        outlines: (2, n, K + 1) its corners.
        k: ticks left.
        near, far: the weights of a foothold, seen k ticks before.
        box: (4,) where the foot can land.
        x, y: seen from the stance foot [m].
    """
    x1, y1, x2, y2 = box
    best = math.inf
    for j in range(len(normals)):
        nx, ny = normals[j, 0], normals[j, 1]
        reach = (x2 if nx > 0.0 else x1) * nx + (y2 if ny > 0.0 else y1) * ny
        slack = (far if reach > 0.0 else near) * reach + offsets[j, k] - nx * x - ny * y
        # Written so that a NaN is kept.
        best = best if slack >= best else slack
    across = tangents_of(box)
    for j in range(len(across)):
        nx, ny = across[j, 0], across[j, 1]
        most = -math.inf
        for i in range(outlines.shape[1]):
            most = max(most, nx * outlines[0, i, k] + ny * outlines[1, i, k])
        slack = most - nx * x - ny * y
        best = best if slack >= best else slack
    return best


@compiled
def step_slacks(
    normals: Array,
    last: Array,
    outlines: Array,
    row: Array,
    ahead: Array,
    k: int,
    decay: float,
    near: float,
    far: float,
    boxes: Array,
    x: float,
    y: float,
) -> Array:
    """Slacks [m of DCM] of the DCM (x, y) in the sets of 1, 2, ... steps (N,).

    Args:
        normals, last, outlines: as of `SetTables`.
        row, ahead: as of a `StanceTable`.
        k: ticks left.
        decay: a^{-k}.
        near, far: weights of a last foothold.
        boxes: (8,) where the foot can land: if that is the last step, then if more follow.
        x, y: seen from the stance foot [m].
    """
    slacks = np.empty(1 + ahead.shape[1])
    slacks[0] = last_slack(normals, last, outlines, k, near * decay, far * decay, boxes[:4], x, y)
    slacks_ahead(row, ahead, k, decay, boxes[4:], x, y, slacks[1:])
    return slacks


@compiled
def slacks_ahead(row: Array, ahead: Array, k: int, decay: float, box: Array, x: float, y: float, out: Array) -> None:
    """Write the slacks [m of DCM] of the DCM (x, y) in the sets of 2, 3, ... steps to out (N - 1,).

    Args:
        row: (J, 6) of a `StanceTable`.
        ahead: (J, N - 1, K + 1) of it.
        k: ticks left.
        decay: a^{-k}.
        box: (4,) where the foot can land.
        x, y: seen from the stance foot [m].
        out: written.
    """
    x1, y1, x2, y2 = box
    along = np.dot(row, np.array([decay * x2, decay * y2, decay * x1, decay * y1, x, y]))
    for n in range(len(out)):
        least = math.inf
        for j in range(len(along)):
            slack = ahead[j, n, k] + along[j]
            if not slack >= least:
                least = slack
                if slack != slack:
                    break
        out[n] = least
