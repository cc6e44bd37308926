"""The controller that a scenario names, built from its fields."""

from __future__ import annotations

from typing import Protocol

from controllers import gains
from controllers.gains import Gain
from controllers.pendulum import Pendulum
from controllers.signals import BalanceCommand, Controller, Decision, Observation
from controllers.statue import Statue
from controllers.stepper import SteppingOptions, step_limits
from controllers.supervisor import Supervisor
from models.robot import Robot
from scenarios.schema import DcmGain, LqrGain, Scenario


class Brain(Protocol):
    """A balance controller, as the episode sees it. Your own needs no more than this.

    Attributes:
        decisions: what was decided so far, with its grounds.
        steps: steps begun so far.
    """

    decisions: list[Decision]
    steps: int

    @property
    def controller(self) -> Controller:
        """Who is in charge."""

    def reset(self) -> None:
        """Forget the last episode."""

    def command(self, observation: Observation) -> BalanceCommand:
        """One control tick: what the body shall do, given what is seen."""


def make_gain(scenario: Scenario, pendulum: Pendulum) -> Gain:
    """The feedback F of a scenario."""
    gain = scenario.gain
    if isinstance(gain, DcmGain):
        return gains.dcm(pendulum, gain.k)
    if isinstance(gain, LqrGain):
        return gains.lqr(pendulum, gain.q, gain.r)
    return gains.poles(pendulum, gain.values)


def make_brain(scenario: Scenario, robot: Robot) -> Brain:
    """The controller of a scenario."""
    pendulum = Pendulum(robot.omega, scenario.timing.control)
    if scenario.controller == "statue":
        return Statue(robot, pendulum)
    stepping = scenario.stepping
    options = SteppingOptions(
        step_times=stepping.step_times,
        max_steps=stepping.max_steps,
        zmp_margin=stepping.zmp_margin,
        swing_height=stepping.swing_height,
        limits=step_limits(robot, stepping.max_stride),
    )
    return Supervisor(
        robot, pendulum, make_gain(scenario, pendulum), options, may_step=scenario.controller == "supervisor"
    )
