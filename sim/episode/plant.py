"""What is controlled: the pendulum, or the humanoid with its whole-body layer. Both take the same commands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.baselines.statue import HeldPose
from controllers.interface import BalanceCommand, JointTargets, Observation
from controllers.whole_body.layer import WholeBody, make_whole_body
from models.robot import Robot
from scenarios.schema import Scenario
from sim.episode.humanoid_world import HumanoidWorld
from sim.episode.pendulum_world import PendulumWorld
from sim.episode.push_schedule import ImpulseLog

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How a control tick went for the body.

    Attributes:
        solver_failed: the whole-body solver found no answer.
        torque: (n,) of the motors at its end [N m]; None for the pendulum.
        speed: (n,) of the motors at its end [rad/s]; None for the pendulum.
    """

    solver_failed: bool = False
    torque: Array | None = None
    speed: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """What an outcome is judged by, beside the observation.

    Attributes:
        trunk_tilt: [rad].
        other_contact: something but a sole touches the floor.
    """

    trunk_tilt: float
    other_contact: bool


class Plant(Protocol):
    """A world that takes balance commands."""

    robot: Robot

    @property
    def impulse_log(self) -> ImpulseLog:
        """Account of the pushes."""

    def observe(self) -> Observation:
        """What the controllers see at the start of this tick."""

    def condition(self) -> Condition:
        """What an outcome is judged by, now."""

    def push_point(self, index: int) -> Array:
        """(3,) where a push acts now [m]."""

    def advance(self, observation: Observation, command: BalanceCommand) -> Effort:
        """Run one control tick."""


class PendulumPlant:
    """The pendulum takes the command as it is."""

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        self.robot = robot
        self._world = PendulumWorld(scenario, robot)

    @property
    def impulse_log(self) -> ImpulseLog:
        """See `Plant`."""
        return self._world.impulse_log

    def observe(self) -> Observation:
        """See `Plant`."""
        return self._world.observe()

    def condition(self) -> Condition:
        """A pendulum has no trunk: it leans as the line from the middle of its feet to its COG does."""
        observation = self._world.observe()
        middle = 0.5 * (observation.feet["left"].position + observation.feet["right"].position)
        lean = math.hypot(*(observation.cog - middle)[:2])
        return Condition(trunk_tilt=math.atan2(lean, float(observation.cog[2])), other_contact=False)

    def push_point(self, index: int) -> Array:
        """Every push acts on the COG."""
        return self._world.observe().cog

    def advance(self, observation: Observation, command: BalanceCommand) -> Effort:
        """See `Plant`."""
        self._world.apply(command)
        return Effort()


class HumanoidPlant:
    """The humanoid: whole-body layer, servos and physics."""

    def __init__(self, scenario: Scenario, robot: Robot, layer: WholeBody | None = None) -> None:
        self.robot = robot
        self.world = HumanoidWorld(scenario, robot)
        self._whole_body = whole_body_layer(scenario, robot) if layer is None else layer
        self._whole_body.reset()

    @property
    def impulse_log(self) -> ImpulseLog:
        """See `Plant`."""
        return self.world.physics.impulse_log

    def observe(self) -> Observation:
        """See `Plant`."""
        return self.world.observe()

    def condition(self) -> Condition:
        """See `Plant`."""
        return Condition(trunk_tilt=self.world.trunk_tilt(), other_contact=self.world.other_contact())

    def push_point(self, index: int) -> Array:
        """See `Plant`."""
        return self.world.physics.push_point(index)

    def advance(self, observation: Observation, command: BalanceCommand) -> Effort:
        """See `Plant`."""
        targets = self._whole_body.targets(observation, command)
        self.world.apply(targets)
        return effort(self.world, targets)


def effort(world: HumanoidWorld, targets: JointTargets) -> Effort:
    """How the last tick went for the humanoid's motors."""
    torque, speed = world.motor_state()
    return Effort(solver_failed=targets.solver_failed, torque=torque, speed=speed)


def whole_body_layer(scenario: Scenario, robot: Robot) -> WholeBody:
    """The whole-body layer that a scenario names; a statue has its own."""
    if scenario.controller == "statue":
        return HeldPose()
    return make_whole_body(scenario.whole_body, robot, scenario.timing.control)


def make_plant(scenario: Scenario, robot: Robot, layer: WholeBody | None = None) -> Plant:
    """The plant of the world that a scenario names.

    Args:
        scenario: what happens.
        robot: the one that it names.
        layer: its whole-body layer, if there is one of a former episode, which nobody else uses.
    """
    return PendulumPlant(scenario, robot) if scenario.world == "pendulum" else HumanoidPlant(scenario, robot, layer)
