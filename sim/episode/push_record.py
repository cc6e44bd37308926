"""What a push was, did and was answered with; and that it did what was asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.errors import InputError

Array = NDArray[np.float64]

# Share of an impulse that a sum of up to a million forces may lose by rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True, kw_only=True)
class PushRecord:
    """What a push was, did and was answered with.

    Attributes:
        start, duration: [s].
        direction_deg: horizontal direction, 0 forward, 90 left [deg].
        body: where it acted.
        asked_impulse, delivered_impulse: [N s]; delivered is summed from the forces the physics was given.
        delta_v: asked impulse / mass [m/s].
        delta_v_over_omega: the same as a distance, for comparison with the distance to the edge of the feet [m].
        cog_velocity_after: (3,) at its end [m/s].
        regulator_slack, tracking_slack: signed slack of the sets at its end: of the regulator of the latest double
            support [m of ZMP], and of the steps under way or, under the regulator, of the best from there [m of DCM;
            of ZMP for the paper's reference].
        in_regulator_set, in_tracking_set: the same as membership.
        chosen: how it was answered: "stepping" if a step was decided before the next push, else the phase at its start.
        reached: whether the episode lasted until its end.
    """

    start: float
    duration: float
    direction_deg: float
    body: str
    asked_impulse: float
    delivered_impulse: float
    delta_v: float
    delta_v_over_omega: float
    cog_velocity_after: tuple[float, float, float] | None
    regulator_slack: float | None
    tracking_slack: float | None
    in_regulator_set: bool | None
    in_tracking_set: bool | None
    chosen: str
    reached: bool


def check_delivered(index: int, asked: Array, delivered: Array) -> None:
    """Check that a push that is over gave what was asked.

    Args:
        index: of the push in its scenario.
        asked: (3,) impulse [N s].
        delivered: (3,) impulse, summed from the forces that the physics was given [N s].

    Raises:
        InputError: if they differ by more than rounding; nobody may judge by such a run.
    """
    if not np.linalg.norm(delivered - asked) <= _ROUNDING * np.linalg.norm(asked):
        given = f"asked {asked.tolist()} N s, delivered {delivered.tolist()} N s"
        raise InputError(f"pushes[{index}]: {given}; a run whose push is not what was asked is not kept")
