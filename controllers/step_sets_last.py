"""The set of one step, whose outline depends on where the foot in the air can land."""

from __future__ import annotations

import math

import numpy as np

from controllers.planar import tangents
from controllers.step_sets_build import Box, SetTables, box_corners


def last_slack(tables: SetTables, x: float, y: float, k: int, box: Box) -> float:
    """Slack [m of DCM] of the DCM (x, y) in the set of one step, NaN for NaN.

    Plain numbers, for there are few normals and they depend on the box.

    Args:
        tables: of the sets.
        x, y: DCM seen from the stance foot [m].
        k: ticks left.
        box: where the foot can land.
    """
    decay = float(tables.decay[k])
    near, far = tables.weights[0] * decay, tables.weights[1] * decay
    (x1, y1), (x2, y2) = box
    best = math.inf
    for nx, ny, offset in tables.last_rows[k]:
        reach = (x2 if nx > 0.0 else x1) * nx + (y2 if ny > 0.0 else y1) * ny
        slack = (far if reach > 0.0 else near) * reach + offset - nx * x - ny * y
        # Written so that a NaN is kept.
        best = best if slack >= best else slack
    for nx, ny in tangents(box_corners(box)):
        offset = max([nx * cx + ny * cy for cx, cy in tables.last_corners[k]])
        slack = offset - nx * x - ny * y
        best = best if slack >= best else slack
    return best


def last_slacks(tables: SetTables, point: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """`last_slack` of the DCM `point` (2,) for 0, 1, ... ticks left and boxes (count, 2, 2), as (count,)."""
    count = len(boxes)
    decay = tables.decay[:count]
    near, far = tables.weights
    normals = tables.normals
    reach = boxes[:, 1] @ np.maximum(normals, 0.0).T + boxes[:, 0] @ np.minimum(normals, 0.0).T
    reach = decay[:, None] * np.maximum(near * reach, far * reach)
    best = (reach + tables.last[:count] - normals @ point).min(axis=1)
    # Support functions hold for any normals: those across all four corners have the two that touch among them.
    corners = boxes[:, [[0, 0], [1, 0], [1, 1], [0, 1]], [0, 1]]
    across = np.concatenate((corners[:, :, ::-1] * [-1.0, 1.0], corners[:, :, ::-1] * [1.0, -1.0]), axis=1)
    length = np.hypot(across[:, :, 0], across[:, :, 1])
    reach = (across @ corners.transpose(0, 2, 1)).max(axis=2)
    reach = decay[:, None] * np.maximum(near * reach, far * reach)
    reach += (across @ tables.outlines[:count].transpose(0, 2, 1)).max(axis=2) - across @ point
    # A foothold on the stance foot itself has nothing across it.
    reach = np.divide(reach, length, out=np.full_like(reach, np.inf), where=length > 0.0)
    return np.asarray(np.minimum(best, reach.min(axis=1)))
