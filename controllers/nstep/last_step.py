"""The set of one step, whose outline depends on where the foot in the air can land."""

from __future__ import annotations

import math

import numpy as np

from controllers.nstep.box import Box, box_tangents
from controllers.nstep.build import SetTables


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
    for nx, ny in box_tangents(box):
        slack = max([nx * cx + ny * cy for cx, cy in tables.last_corners[k]]) - nx * x - ny * y
        best = best if slack >= best else slack
    return best


def last_slacks(tables: SetTables, point: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """`last_slack` of the DCM `point` (2,) for 0, 1, ... ticks left, as (count,).

    Args:
        tables: of the sets.
        point: (2,) [m].
        boxes: (4, count) of x and y of the upper corner, then of the lower one.
    """
    count = boxes.shape[1]
    x2, y2, x1, y1 = boxes
    above = bool(y1[0] > 0.0)
    if not (y1.min() > 0.0 if above else y2.max() < 0.0):
        x, y = point.tolist()
        each = enumerate(boxes.T.tolist())
        return np.array([last_slack(tables, x, y, k, ((c, d), (a, b))) for k, (a, b, c, d) in each])
    reach = tables.row[:, :4].dot(boxes)
    reach *= np.where(reach > 0.0, tables.weights[1], tables.weights[0])
    reach *= tables.decay[:count]
    reach += tables.last[:, :count]
    reach += tables.row[:, 4:].dot(point)[:, None]
    best = np.minimum.reduce(reach, axis=0)
    # As `box_tangents`: the corners that the two lines through the stance foot touch.
    near, far = (y1, y2) if above else (y2, y1)
    across = np.empty((2, 2, count))
    across[1, 0], across[1, 1] = x1, -x2
    across[0, 0], across[0, 1] = -np.where(x1 < 0.0, near, far), np.where(x2 > 0.0, near, far)
    if not above:
        across *= -1.0
    across /= np.hypot(across[0], across[1])
    x, y = across
    corners_x, corners_y = tables.outlines[:, :, None, :count]
    slack = np.maximum.reduce(corners_x * x + corners_y * y, axis=0)
    slack -= point[0] * x + point[1] * y
    return np.asarray(np.minimum(best, np.minimum(slack[0], slack[1])))
