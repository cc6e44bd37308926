"""The controller that a scenario names, built from its fields."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from controllers import gains
from controllers.baselines.paper import PaperSupervisor
from controllers.baselines.statue import Statue
from controllers.gains import Gain
from controllers.interface import BalanceCommand, Decision, Observation, Phase
from controllers.pendulum import Pendulum
from controllers.stepping.feedback_swing import FeedbackSwing
from controllers.stepping.polygon_policy import PolygonPolicy
from controllers.stepping.recoverability import Recoverability
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import SteppingOptions, StepPolicy, step_limits
from controllers.stepping.swing import SwingFoot
from controllers.supervisor.supervisor import Supervisor
from models.robot import Robot
from scenarios.schema import DcmGain, LqrGain, Scenario

# DCM gains to fall back on before a step; the set of the last one ends at 1 / 1.1 of the limit without a step.
SOFTER = (1.25, 1.1)


class BalanceController(Protocol):
    """A balance controller, as the episode sees it. Your own needs no more than this.

    Attributes:
        decisions: what was decided so far, with its grounds.
        steps: steps begun so far.
    """

    decisions: list[Decision]
    steps: int

    @property
    def phase(self) -> Phase:
        """Whether a step is under way."""

    def reset(self) -> None:
        """Forget the last episode."""

    def command(self, observation: Observation) -> BalanceCommand:
        """One control tick: what the body shall do, given what is seen."""


@runtime_checkable
class Predictor(Protocol):
    """A controller that lives by sets, whose word is recorded."""

    @property
    def slacks(self) -> tuple[float, float]:
        """Signed slack of the last tick's state in the regulator's sets and in those of the steps under way; NaN for
        none."""

    def predict(self) -> tuple[float, float]:
        """The same, with the steps that could be begun where none is under way."""


def make_gain(scenario: Scenario, pendulum: Pendulum) -> Gain:
    """The feedback F of a scenario."""
    gain = scenario.gain
    if isinstance(gain, DcmGain):
        return gains.dcm(pendulum, gain.k)
    if isinstance(gain, LqrGain):
        return gains.lqr(pendulum, gain.q, gain.r)
    return gains.poles(pendulum, gain.values)


def make_controller(scenario: Scenario, robot: Robot) -> BalanceController:
    """The controller of a scenario."""
    pendulum = Pendulum(robot.omega, scenario.timing.control)
    if scenario.controller == "statue":
        return Statue(robot, pendulum)
    gain = make_gain(scenario, pendulum)
    if scenario.controller == "paper":
        return PaperSupervisor(robot, pendulum, gain, scenario.stepping.swing_height)
    options = make_options(scenario, robot)
    if scenario.controller == "regulator":
        return Supervisor(robot, pendulum, (gain,), options, None)
    bank = {gain.name: gain} | {soft.name: soft for k in SOFTER if (soft := gains.dcm(pendulum, k)).name != gain.name}
    sets = SetPolicy(robot, pendulum, options, min(SOFTER))
    rule: StepPolicy = sets if options.rule == "sets" else PolygonPolicy(robot, pendulum, options)
    body = scenario.world == "humanoid"
    recoverability = Recoverability.of_body(robot, pendulum, options, min(SOFTER)) if body else Recoverability(sets)
    # Inverse dynamics tells a leg what acceleration to give; the other layers send it to a place.
    swing = FeedbackSwing if body and scenario.whole_body == "dynamics" else SwingFoot
    return Supervisor(robot, pendulum, tuple(bank.values()), options, rule, recoverability, swing)


def make_options(scenario: Scenario, robot: Robot) -> SteppingOptions:
    """How a scenario's robot steps."""
    stepping = scenario.stepping
    return SteppingOptions(
        rule=stepping.rule,
        step_times=stepping.step_times,
        max_steps=stepping.max_steps,
        zmp_margin=stepping.zmp_margin,
        swing_height=stepping.swing_height,
        replan=stepping.replan,
        early_trigger=stepping.early_trigger,
        angular_momentum=stepping.angular_momentum,
        limits=step_limits(robot, stepping.max_stride),
    )
