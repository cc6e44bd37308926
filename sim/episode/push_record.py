"""What a push was, did and was answered with; and that it did what was asked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.errors import InputError
from models.robot import Robot
from scenarios.push import Push

Array = NDArray[np.float64]

# Share of an impulse that a sum of up to a million forces may lose by rounding.
_ROUNDING = 1e-6
# Times are sums of many periods.
_SAME_TIME = 1e-9


@dataclass(frozen=True, kw_only=True)
class PushRecord:
    """What a push was, did and was answered with.

    Of pushes that overlap each is recorded for itself. What is told of the state at its end holds at its own end, even
    if others still act; how it was answered counts from its start until the next push that begins after its end, so
    those that overlap share an answer.

    Attributes:
        start, duration: [s].
        direction_deg: horizontal direction, 0 forward, 90 left [deg]; None of a torque.
        body: where it acted.
        asked_impulse, delivered_impulse: [N s]; delivered is summed from the forces the physics was given. 0 of a
            torque, as are the next two.
        delta_v: asked impulse / mass [m/s].
        delta_v_over_omega: the same as a distance, for comparison with the distance to the edge of the feet [m].
        cog_velocity_after: (3,) at its end [m/s].
        regulator_slack, tracking_slack: signed slack of the sets at its end: of the regulator of the latest double
            support [m of ZMP], and of the steps under way or, under the regulator, of the best from there [m of DCM;
            of ZMP for the paper's reference].
        in_regulator_set, in_tracking_set: the same as membership. With a foot in the air nothing is in the regulator's
            set; the other is None if it could not be asked, as in a step that closes the feet.
        chosen: how it was answered: "stepping" if a step was decided before the next push that begins after its end,
            else the phase at its start.
        reached: whether the episode lasted until its end.
    """

    start: float
    duration: float
    direction_deg: float | None
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


@dataclass(frozen=True, kw_only=True)
class TorqueRecord(PushRecord):
    """The same of a torque.

    Attributes:
        torque: (3,) its mean over its duration, about the body's COM, world frame [N m].
        asked_angular_impulse, delivered_angular_impulse: [N m s]; delivered is summed from the torques the physics was
            given.
    """

    torque: tuple[float, float, float]
    asked_angular_impulse: float
    delivered_angular_impulse: float


def push_record(
    push: Push, robot: Robot, delivered: Array, *, ended: Mapping[str, Any] | None, chosen: str
) -> PushRecord:
    """The record of a push.

    Args:
        push: as run.
        robot: whom it pushed.
        delivered: (3,) impulse [N s], or of a torque the angular impulse [N m s].
        ended: the state at its end: `velocity`, and slacks if there are sets; None if it was not reached.
        chosen: see `PushRecord`.
    """
    asked, given = float(np.linalg.norm(push.impulse_vector(robot.mass))), float(np.linalg.norm(delivered))
    state = ended or {}
    fields: dict[str, Any] = {
        "start": push.start,
        "duration": push.duration,
        "direction_deg": push.direction_deg if push.torque is None else None,
        "body": push.body,
        "asked_impulse": asked,
        "delivered_impulse": given if push.torque is None else 0.0,
        "delta_v": asked / robot.mass,
        "delta_v_over_omega": asked / robot.mass / robot.omega,
        "cog_velocity_after": state.get("velocity"),
        "regulator_slack": state.get("regulator_slack"),
        "tracking_slack": state.get("tracking_slack"),
        "in_regulator_set": _member(state.get("regulator_slack"), unasked=False),
        "in_tracking_set": _member(state.get("tracking_slack"), unasked=None),
        "chosen": chosen,
        "reached": ended is not None,
    }
    if push.torque is None:
        return PushRecord(**fields)
    spin = float(np.linalg.norm(push.asked(robot.mass)))
    return TorqueRecord(**fields, torque=push.torque, asked_angular_impulse=spin, delivered_angular_impulse=given)


def next_after(pushes: Sequence[Push | PushRecord], index: int) -> int | None:
    """Index of the first push that begins after the end of push `index`; None if there is none."""
    end = pushes[index].start + pushes[index].duration - _SAME_TIME
    return next((i for i in range(index + 1, len(pushes)) if pushes[i].start >= end), None)


def check_delivered(index: int, push: Push, mass: float, delivered: Array) -> None:
    """Check that a push that is over gave what was asked.

    Args:
        index: of the push in its scenario.
        push: as run.
        mass: of the robot [kg].
        delivered: (3,) impulse, summed from the forces that the physics was given [N s]; of a torque the angular
            impulse, likewise [N m s].

    Raises:
        InputError: if they differ by more than rounding; nobody may judge by such a run.
    """
    asked, unit = push.asked(mass), "N s" if push.torque is None else "N m s"
    if not np.linalg.norm(delivered - asked) <= _ROUNDING * np.linalg.norm(asked):
        given = f"asked {asked.tolist()} {unit}, delivered {delivered.tolist()} {unit}"
        raise InputError(f"pushes[{index}]: {given}; a run whose push is not what was asked is not kept")


def _member(slack: float | None, unasked: bool | None) -> bool | None:
    """Membership by a slack; None without a set, and `unasked` of NaN."""
    if slack is None:
        return None
    return unasked if math.isnan(slack) else slack >= 0.0
