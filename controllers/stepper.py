"""Which step: plans from the measured state, and the one whose tracking set holds the state."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.footholds import StepLimits
from controllers.gait import StepPlan, plan_steps
from controllers.gait_program import PlanningError
from controllers.pendulum import Pendulum
from controllers.signals import Candidate
from controllers.support import Foot
from models.arena import SIDES
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# Two slacks closer than this [m] count as equal; then the shorter way of the feet decides.
SAME_SLACK = 1e-4


@dataclass(frozen=True, kw_only=True)
class SteppingOptions:
    """What steps may be planned.

    Attributes:
        step_times: durations of a step [s], tried in this order.
        max_steps: most steps in one plan.
        zmp_margin: distance that a plan keeps between the ZMP and the edge of the support [m].
        swing_height: apex of the swing foot [m].
        limits: where a foot may land.
    """

    step_times: tuple[float, ...]
    max_steps: int
    zmp_margin: float
    swing_height: float
    limits: StepLimits


def step_limits(robot: Robot, max_stride: float) -> StepLimits:
    """Reach of the robot's feet for a given stride [m], the rest from its build."""
    return StepLimits(
        max_stride=max_stride,
        min_width=robot.sole_width + 0.004,  # [m] clearance of the soles as they pass
        max_width=robot.stance_width + robot.hip_reach,
        stance_width=robot.stance_width,
        # A leg that swings about the hip at half the no-load speed of its slowest motor.
        swing_speed=0.5 * float(robot.no_load_speed.min()) * robot.leg_length * 2.0,
    )


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The plan that was taken, and all that were considered."""

    plan: StepPlan
    name: str
    candidates: tuple[Candidate, ...]


class Stepper:
    """Plans candidates and chooses among them: the fewest steps that suffice, then the largest slack."""

    def __init__(self, pendulum: Pendulum, options: SteppingOptions) -> None:
        self._pendulum = pendulum
        self._options = options

    def from_stance(self, x: Array, feet: dict[Side, Foot], *, settle: bool, avoid: Side | None) -> Choice | None:
        """Choose from double support.

        Args:
            x: (4,) measured state.
            feet: where the feet stand.
            settle: whether coming to rest without a step is a candidate.
            avoid: a foot that has only just landed and shall not step at once; None for either.
        """
        first = [side for side in SIDES if side != avoid]
        groups: list[list[tuple[tuple[Side, ...], float, float | None]]] = []
        if settle:
            groups.append([((), self._options.step_times[0], None)])
        for steps in range(1, self._options.max_steps + 1):
            for time in self._options.step_times:
                groups.append([(_alternate(side, steps), time, None) for side in first])
        return self._best(x, feet, groups, None)

    def from_swing(
        self, x: Array, feet: dict[Side, Foot], swing: Side, time_left: float, position: Array
    ) -> Choice | None:
        """Choose while a foot is in the air.

        Args:
            x: (4,) measured state.
            feet: the stance foot where it stands; of the other only its sole and yaw count.
            swing: the foot in the air.
            time_left: until it should land [s].
            position: (2,) where it is [m].
        """
        groups: list[list[tuple[tuple[Side, ...], float, float | None]]] = [
            [(_alternate(swing, steps), self._options.step_times[0], time_left)]
            for steps in range(1, self._options.max_steps + 1)
        ]
        return self._best(x, feet, groups, position)

    def _best(
        self,
        x: Array,
        feet: dict[Side, Foot],
        groups: Sequence[Sequence[tuple[tuple[Side, ...], float, float | None]]],
        position: Array | None,
    ) -> Choice | None:
        seen: list[Candidate] = []
        best: tuple[StepPlan, str] | None = None
        for group in groups:
            for plan, name in self._plans(x, feet, group, position):
                seen.append(Candidate(name=name, slack=plan.slack))
                if best is None or _better(plan, best[0], feet):
                    best = plan, name
            if best is not None and best[0].slack >= 0.0:
                break
        return None if best is None else Choice(plan=best[0], name=best[1], candidates=tuple(seen))

    def _plans(
        self,
        x: Array,
        feet: dict[Side, Foot],
        group: Sequence[tuple[tuple[Side, ...], float, float | None]],
        position: Array | None,
    ) -> Iterator[tuple[StepPlan, str]]:
        for swing, time, time_left in group:
            try:
                plan = plan_steps(
                    self._pendulum,
                    x,
                    feet,
                    swing,
                    time,
                    self._options.limits,
                    swing_time_left=time_left,
                    swing_position=position,
                    zmp_margin=self._options.zmp_margin,
                )
            except PlanningError:
                continue  # no foothold of this candidate is within reach: it is no candidate
            yield plan, _name(swing, time)


def _alternate(first: Side, steps: int) -> tuple[Side, ...]:
    return tuple(first if i % 2 == 0 else other(first) for i in range(steps))


def _name(swing: tuple[Side, ...], time: float) -> str:
    if not swing:
        return "settle"
    return f"{'-'.join(swing)} {time:g} s"


def _better(plan: StepPlan, best: StepPlan, feet: dict[Side, Foot]) -> bool:
    if abs(plan.slack - best.slack) > SAME_SLACK:
        return plan.slack > best.slack
    return _travel(plan, feet) < _travel(best, feet) - SAME_SLACK


def _travel(plan: StepPlan, feet: dict[Side, Foot]) -> float:
    """Longest way of a foot in the plan [m]."""
    at = {side: foot.position for side, foot in feet.items()}
    longest = 0.0
    for side, foothold in zip(plan.swing, plan.footholds, strict=True):
        longest = max(longest, float(np.hypot(*(foothold.position - at[side]))))
        at[side] = foothold.position
    return longest
