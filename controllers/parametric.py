"""Build the parametric set of a swing sequence and a step time: the polytope behind `parametric_set.ParametricSet`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from controllers.footholds import StepLimits
from controllers.gains import Gain
from controllers.gait_phases import StepPhases, step_phases
from controllers.linear_program import InfeasibleProgramError, LinearProgram
from controllers.moa import regulator_set
from controllers.parametric_rows import Rows, parametric_rows, zmp_law
from controllers.parametric_set import ParametricError, ParametricSet
from controllers.pendulum import Pendulum
from controllers.polytope import Polytope
from controllers.support import Foot, SupportPolygon, support_polygon
from models.arena import Side

# The ZMP's offset from the middles is constant up to this share of the settling time, and constant after: of
# 0.2, 0.4 and 0.6 the one with the largest sets, for DCM gains (where it hardly matters) and for LQR ones.
_TURN = 0.6


class EmptyParametricError(ParametricError):
    """No reference keeps the margin that was asked for."""


def parametric_set(
    pendulum: Pendulum,
    gain: Gain,
    feet: Mapping[Side, Foot],
    swing: Sequence[Side],
    step_time: float,
    limits: StepLimits,
    *,
    regulator: Gain | None = None,
    margin: float = 0.0,
    settle_time: float = 0.6,
) -> ParametricSet:
    """Build the set of a swing sequence and step time from feet on the floor.

    Args:
        pendulum: model and period.
        gain: feedback of the tracking controller.
        feet, swing, step_time, limits, settle_time: as for `gait.plan_steps`.
        regulator: feedback of the regulator that takes over at the end; that of the tracker if None.
        margin: what every reference keeps to the edges of its supports [m].

    Raises:
        PlanningError: the times or the swing sequence do not fit.
        ParametricError: the margin is negative or not finite.
        EmptyParametricError: no reference keeps the margin.
        UnstableGainError, MoaError: the gains have no set.
    """
    if not (math.isfinite(margin) and margin >= 0.0):
        raise ParametricError(f"margin must be a finite non-negative number of metres, got {margin!r}")
    swing = tuple(swing)
    gain.require_stable(pendulum)
    shape = step_phases(pendulum, feet, swing, step_time, limits, settle_time=settle_time)
    terminal = regulator_set(pendulum, gain if regulator is None else regulator, _last_support(shape), np.zeros(2))
    law = zmp_law(pendulum, shape, _profile(shape))
    rows = parametric_rows(pendulum, gain, terminal, shape, law)
    _require_margin(rows, margin)
    # With other gains the ZMP bends at every tick, and nearly every row counts.
    if gain.dcm_ratio(pendulum) is not None:
        rows = rows.pruned(pendulum.omega, margin)
    return ParametricSet(
        pendulum=pendulum, gain=gain, terminal=terminal, feet=dict(feet), swing=swing, step_time=step_time,
        margin=margin, shape=shape, law=law, rows=rows,
    )  # fmt: skip


def _profile(shape: StepPhases) -> np.ndarray:
    middles = np.cumsum(shape.knots) - 0.5 * np.array(shape.knots)
    early = middles < sum(shape.ticks) + _TURN * shape.settle
    if early.all() or not early.any():
        raise ParametricError("the settling time is too short to bring the COG to rest: give it at least 0.2 s")
    return np.column_stack((early, ~early)).astype(float)


def _last_support(shape: StepPhases) -> SupportPolygon:
    """Support of the last knot about the point of rest, which is the base of that knot."""
    phase = shape.phases[-1]
    k = len(phase.ticks)
    base, h = np.broadcast_to(phase.base, (k, 2))[-1], np.broadcast_to(phase.h, (k, len(phase.M)))[-1]
    corners = Polytope(S=phase.M, a=h - phase.M @ (shape.end_base - base)).vertices()
    return support_polygon([Foot(position=np.zeros(2), yaw=0.0, sole=corners)])


def _require_margin(rows: Rows, margin: float) -> None:
    """Raise EmptyParametricError unless the rows of the reference alone have a member."""
    own = rows.of_slack == 0.0
    matrix = np.column_stack((rows.of_start[own], rows.of_feet[own], rows.of_margin[own]))
    direction = np.zeros(matrix.shape[1])
    direction[-1] = 1.0
    try:
        most = float(LinearProgram(matrix, rows.a[own]).maximise(direction)[-1])
    except InfeasibleProgramError:
        raise EmptyParametricError("no footholds are within reach: allow longer steps or more time") from None
    if margin > most:
        raise EmptyParametricError(
            f"no reference keeps {margin:g} m to the edges of its supports; at most {most:.4g} m are possible"
        )
