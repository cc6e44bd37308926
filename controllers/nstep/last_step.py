"""The set of one step, whose outline depends on where the foot in the air can land."""

from __future__ import annotations

import math

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
