"""Which foothold and which ZMP: one small program a tick, so that the DCM lands where the remaining steps suffice."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import mul

import daqp
import numpy as np

from controllers.geometry.linear_program import LinearProgram
from controllers.geometry.planar import Points, clipped, nearest, tangents
from controllers.nstep.box import Box, box_corners, box_tangents
from controllers.nstep.step_sets import StepSets
from models.errors import InputError
from models.robot import Side

# Against a metre of slack: so small that it only decides among choices with the same slack.
_NEARNESS = 1e-6
# The last entry is for the solver, which wants a definite cost. Leaving the wanted foothold counts less than leaving
# the calmest ZMP: the foot gives way first.
_WEIGHTS = _NEARNESS * np.diag([1.0, 1.0, 1e-2, 1e-2, 1.0])
_PULL = (-_WEIGHTS.diagonal()[:4]).tolist()
_OPTIMAL = 1
_TOLERANCE = 1e-9
# A state on the rim would be lost to rounding: so much slack [m] is always sought.
_LEAST = 1e-6
# Slacks this near [m] are one: above the accuracy of the solver.
_SAME = 1e-8
# Half the side of the square that holds all footholds and DCMs worth a step [m].
_FAR = 1e3


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Foothold:
    """Where to land and how to get there; all points (2,) seen from the stance foot [m].

    Attributes:
        position: where the foot in the air should land.
        zmp: where to keep the ZMP until then.
        landing_dcm: where the DCM then is at landing.
        slack: of the DCM at landing in the set of the steps that are left, seen from the new stance foot, or in that of
            the regulator after the last one [m]; whatever the errors of the ZMP until then.
    """

    position: np.ndarray
    zmp: np.ndarray
    landing_dcm: np.ndarray
    slack: float


def choose_foothold(
    sets: StepSets,
    dcm: np.ndarray,
    stance: Side,
    time_left: float,
    swing: np.ndarray | None,
    step_time: float,
    steps: int,
    toward: np.ndarray,
    margin: float,
    *,
    held: bool = False,
) -> Foothold:
    """Where to land, and where to keep the ZMP until then, when exactly `steps` steps are to do.

    The slack at landing is made as large as it can be, up to the margin. Then the ZMP is the one nearest to the point
    of the sole nearest to the DCM, and the foothold the one nearest to `toward`.

    Args:
        sets: the sets.
        dcm, stance, time_left, swing, step_time: as for `StepSets.slacks`.
        steps: 1 to max_steps, the one under way included.
        toward: (2,) foothold that is best where the state leaves the choice [m].
        margin: slack [m] beyond which more is of no use.
        held: whether the ZMP stays until landing, free of errors.

    Raises:
        InputError: an argument is none of the sets', or not finite.
    """
    sets.require_steps(steps)
    point, wanted = np.array(dcm, dtype=float), np.array(toward, dtype=float)
    if not (math.isfinite(sum(point.tolist()) + sum(wanted.tolist())) and 0.0 <= margin < math.inf):
        raise InputError(
            f"dcm, toward, margin: must be finite and the margin not negative, got {dcm!r}, {toward!r}, {margin!r}"
        )
    k, tables = sets.tick(time_left), sets.tables
    last, more = sets.boxes(stance, k, swing, step_time)
    usable, growth = tables.usable, 1.0 / float(tables.decay[k])
    calm = usable.nearest(point)
    if steps == 1:
        box, share = last, 0.5
        normals, ahead, rows = tables.normals, tables.last, tables.program.copy()
        near, far = tables.weights
        sides = (box[1][0], box[1][1], -box[0][0], -box[0][1])
        reach = np.array((*[(far if side > 0.0 else near) * side for side in sides], 0.0, 0.0))
        if across := box_tangents(box):
            rows[len(usable.v) + 4 : len(usable.v) + 6, 2:4] = across
    else:
        table = sets.table(stance, step_time)
        box, share = more, 1.0
        reach = np.array((box[1][0], box[1][1], -box[0][0], -box[0][1]))
        normals, ahead, rows = table.normals, table.ahead[:, steps - 2], table.program
    # Unknowns: z' = (a^k - 1) z, the foothold p (before the last landing y = lam p), and the slack s at landing. The
    # DCM then is a^k xi - z'; with errors of the ZMP the next tick must end in the set about the foothold chosen now.
    moved, offsets = 1.0, ahead[:, 0]
    if k > 0 and sets.error.w_bar > 0.0 and not held:
        a = float(tables.decay[0] / tables.decay[1])
        moved = (growth - growth / a) / (growth - 1.0)
        offsets = (growth / a) * (ahead[:, k - 1] - (a - 1.0) * sets.error.support(normals))
        rows = rows.copy()
        rows[-1 - len(normals) : -1, :2] *= moved
    free = growth * point
    limits = np.concatenate(
        ((growth - 1.0) * usable.v, reach, offsets - normals.dot(free), (margin if margin > _LEAST else _LEAST,))
    )
    (zx, zy), (px, py), pull = calm.tolist(), wanted.tolist(), growth - 1.0
    optimum = _solve((pull * zx, pull * zy, share * px, share * py), rows, limits)
    zmp = usable.nearest(optimum[:2] / (growth - 1.0)) if k else calm
    shift = (growth - 1.0) * zmp
    room = offsets - normals.dot(free - moved * shift)
    chosen = optimum[2:4]
    if steps == 1:
        ample = optimum[4] >= margin - _SAME
        chosen = _last_foothold(normals, room - optimum[4], tables.weights, chosen, box, wanted, ample=ample)
    # Plain numbers: arrays of two would take four times as long.
    (x, y), ((x1, y1), (x2, y2)) = chosen.tolist(), box
    position = np.array((min(max(x, x1), x2), min(max(y, y1), y2)))
    along = normals.dot(position)
    slack = float(np.minimum.reduce(room + along)) if steps > 1 else _best_between(room, along, tables.weights)
    return Foothold(position=position, zmp=zmp, landing_dcm=free - shift, slack=slack)


def _solve(wanted: tuple[float, float, float, float], rows: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Unknowns (5,) with the largest slack, nearest to `wanted` (4,)."""
    cost = np.array([*map(mul, wanted, _PULL), -1.0])
    optimum, _, flag, _ = daqp.solve(_WEIGHTS, cost, rows, limits, primal_tol=_TOLERANCE)
    if flag == _OPTIMAL or (rows @ optimum - limits).max() <= _SAME:
        return np.asarray(optimum)
    # The simplex method does not mind degenerate corners, and with them there is nothing left to prefer.
    return LinearProgram(rows, limits).maximise(np.eye(5)[-1])


def _last_foothold(
    normals: np.ndarray,
    room: np.ndarray,
    weights: tuple[float, float],
    middle: np.ndarray,
    box: Box,
    wanted: np.ndarray,
    *,
    ample: bool,
) -> np.ndarray:
    """The foothold p of the box nearest to `wanted` with -normals lam p <= room for a lam between the weights.

    Args:
        normals, room: (J, 2), (J,) [m].
        weights: of lam.
        middle: (2,) one y = lam p.
        box: of p.
        wanted: (2,).
        ample: whether there are other y, the room not being that of the best.
    """
    if ample and _within(box, wanted) and _suffices(room, normals.dot(wanted), weights):
        return wanted
    if ample and (feet := _cone(normals, room, weights, box)):
        return np.array(nearest(feet, float(wanted[0]), float(wanted[1])))
    # All 1 / lam that bring y into the box, and the best of them. Of y nothing is known below the accuracy of the
    # solver: a side of no width at 0 would otherwise exclude every lam by a y of 1e-20 across it.
    lower, upper = 1.0 / weights[1], 1.0 / weights[0]
    for value, low, high in zip(middle.tolist(), *box, strict=True):
        for most, bound in ((value + _SAME, low), (_SAME - value, -high)):
            # most / lam >= bound
            if most > 0.0:
                lower = max(lower, bound / most)
            elif most < 0.0:
                upper = min(upper, bound / most)
    square = float(middle @ middle)
    factor = float(middle @ wanted) / square if square > 0.0 else lower
    return middle * min(max(factor, lower), upper)


def _within(box: Box, point: np.ndarray) -> bool:
    (x1, y1), (x2, y2) = box
    return bool(x1 <= point[0] <= x2 and y1 <= point[1] <= y2)


def _suffices(room: np.ndarray, along: np.ndarray, weights: tuple[float, float]) -> bool:
    """Whether room + lam along >= 0 for a lam between the weights."""
    low, high = weights
    for b, d in zip(room.tolist(), along.tolist(), strict=True):
        if d > 0.0:
            low = max(low, -b / d)
        elif d < 0.0:
            high = min(high, -b / d)
        elif b < 0.0:
            return False
    return low <= high


def _cone(normals: np.ndarray, room: np.ndarray, weights: tuple[float, float], box: Box) -> Points:
    """All p of a box with -normals lam p <= room for a lam between the weights; empty if rounding leaves none."""
    inner = [((-nx, -ny), offset) for (nx, ny), offset in zip(normals.tolist(), (room + _SAME).tolist(), strict=True)]
    points = clipped([(-_FAR, -_FAR), (_FAR, -_FAR), (_FAR, _FAR), (-_FAR, _FAR)], inner)
    if not points:
        return []
    cone = [((nx, ny), 0.0) for nx, ny in tangents(points)]
    for normal, _ in inner:
        most = max([normal[0] * x + normal[1] * y for x, y in points])
        cone.append((normal, most / weights[0] if most > 0.0 else most / weights[1]))
    return clipped(box_corners(box), cone)


def _best_between(room: np.ndarray, along: np.ndarray, weights: tuple[float, float]) -> float:
    """Largest of min(room + lam along) over lam between the weights."""
    lines = list(zip(room.tolist(), along.tolist(), strict=True))
    low, high = weights
    best = max(min([b + lam * d for b, d in lines]) for lam in weights)
    for b, d in lines:
        for c, e in lines:
            # Where a falling line crosses a rising one.
            if d > 0.0 > e and low < (lam := (c - b) / (d - e)) < high:
                best = max(best, min([f + lam * g for f, g in lines]))
    return best
