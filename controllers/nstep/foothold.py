"""Which foothold and which ZMP: one small program a tick, so that the DCM lands where the remaining steps suffice."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import mul

import daqp
import numpy as np

from controllers.geometry.linear_program import LinearProgram
from controllers.nstep.box import flat
from controllers.nstep.foothold_kernel import SAME, landed, last_reach, program_limits
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
    calm = usable.nearest_to(*point.tolist())
    if steps == 1:
        box, share = last, 0.5
        normals, ahead, rows = tables.normals, tables.last, tables.program.copy()
        reach = last_reach(flat(box), *tables.weights, rows, len(usable.v))
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
    # Plain numbers where there are two: arrays would take four times as long.
    (x, y), (px, py), pull = point.tolist(), wanted.tolist(), growth - 1.0
    free_x, free_y, offsets = growth * x, growth * y, np.ascontiguousarray(offsets)
    asked = margin if margin > _LEAST else _LEAST
    limits = program_limits(growth, usable.v, reach, offsets, normals, free_x, free_y, asked)
    zx, zy = calm
    optimum = _solve((pull * zx, pull * zy, share * px, share * py), rows, limits)
    moved_x, moved_y, px, py, most = optimum.tolist()
    if k:
        zx, zy = usable.nearest_to(moved_x / pull, moved_y / pull)
    shift_x, shift_y = pull * zx, pull * zy
    landing = free_x - moved * shift_x, free_y - moved * shift_y
    ample = most >= margin - SAME
    low, high = tables.weights
    px, py, slack = landed(normals, offsets, *landing, steps > 1, low, high, px, py, most, ample, flat(box), wanted)
    return Foothold(
        position=np.array((px, py)),
        zmp=np.array((zx, zy)),
        landing_dcm=np.array((free_x - shift_x, free_y - shift_y)),
        slack=slack,
    )


def _solve(wanted: tuple[float, float, float, float], rows: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Unknowns (5,) with the largest slack, nearest to `wanted` (4,)."""
    cost = np.array([*map(mul, wanted, _PULL), -1.0])
    optimum, _, flag, _ = daqp.solve(_WEIGHTS, cost, rows, limits, primal_tol=_TOLERANCE)
    if flag == _OPTIMAL or (rows @ optimum - limits).max() <= SAME:
        return np.asarray(optimum)
    # The simplex method does not mind degenerate corners, and with them there is nothing left to prefer.
    return LinearProgram(rows, limits).maximise(np.eye(5)[-1])
