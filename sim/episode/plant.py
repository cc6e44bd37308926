"""What is controlled: the pendulum, or the humanoid with its whole-body layer. Both take the same commands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from dm_control.rl.control import PhysicsError
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, JointTargets, Observation, WholeBodyLayer
from controllers.registry import LAYERS
from controllers.senses import Estimator
from models.errors import InputError, OkiagariError, one_line
from models.robot import Robot
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.build import layer_of, make_estimator, make_layer
from sim.episode.guard import Guard
from sim.episode.humanoid_world import HumanoidWorld
from sim.episode.pendulum_world import PendulumWorld
from sim.episode.push_schedule import ImpulseLog
from sim.sensing.drive import Drives

Array = NDArray[np.float64]
Action = BalanceCommand | JointTargets
"""What the robot can be given: a command for its whole-body layer, or its servos' targets."""


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
    """A world that takes actions: `give` one, `step` the physics, `end` the tick."""

    robot: Robot

    @property
    def scenario(self) -> Scenario:
        """Of the episode, with the pushes that were added to it."""

    def add_push(self, push: Push) -> Push:
        """Push while the episode runs; see `HumanoidWorld.add_push`."""

    def reset(self, scenario: Scenario) -> None:
        """Start an episode of a scenario alike in whole-body layer, estimator and what is compiled."""

    @property
    def impulse_log(self) -> ImpulseLog:
        """Account of the pushes."""

    def observe(self) -> Observation:
        """What the controllers see at the start of this tick."""

    def condition(self) -> Condition:
        """What an outcome is judged by, now."""

    @property
    def body_errors(self) -> dict[str, Any]:
        """How the true body was drawn, see `TrueBody`; empty if it is as its file says."""

    def push_point(self, index: int) -> Array:
        """(3,) where a push acts now, of a torque the body's COM [m]."""

    def give(self, tick: int, seen: Observation, action: Action) -> None:
        """Take the action of a tick, which follows from what is seen."""

    def step(self) -> None:
        """Run the physics of one control tick."""

    def end(self) -> Effort:
        """Count the tick, and say how it went for the body."""


class PendulumPlant:
    """The pendulum takes the command as it is."""

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        self.robot = robot
        self._world = PendulumWorld(scenario, robot)
        self._command: BalanceCommand | None = None

    @property
    def scenario(self) -> Scenario:
        """See `Plant`."""
        return self._world.scenario

    def add_push(self, push: Push) -> Push:
        """See `Plant`."""
        return self._world.add_push(push)

    def reset(self, scenario: Scenario) -> None:
        """See `Plant`."""
        self._world = PendulumWorld(scenario, self.robot)

    @property
    def impulse_log(self) -> ImpulseLog:
        """See `Plant`."""
        return self._world.impulse_log

    def observe(self) -> Observation:
        """See `Plant`."""
        return self._world.observe()

    @property
    def body_errors(self) -> dict[str, Any]:
        """See `Plant`; a pendulum has none."""
        return {}

    def condition(self) -> Condition:
        """A pendulum has no trunk: it leans as the line from the middle of its feet to its COG does."""
        observation = self._world.observe()
        middle = 0.5 * (observation.feet["left"].position + observation.feet["right"].position)
        lean = math.hypot(*(observation.cog - middle)[:2])
        return Condition(trunk_tilt=math.atan2(lean, float(observation.cog[2])), other_contact=False)

    def push_point(self, index: int) -> Array:
        """Every push acts on the COG."""
        return self._world.observe().cog

    def give(self, tick: int, seen: Observation, action: Action) -> None:
        """See `Plant`; a pendulum has no joints."""
        if not isinstance(action, BalanceCommand):
            raise OkiagariError("world: 'pendulum' has no joints to give targets to; allowed: 'humanoid'")
        self._command = action

    def step(self) -> None:
        """See `Plant`."""
        assert self._command is not None
        self._world.apply(self._command)

    def end(self) -> Effort:
        """See `Plant`."""
        return Effort()


class HumanoidPlant:
    """The humanoid: whole-body layer, servos and physics.

    Attributes:
        robot: its facts.
        world: the physics.
        estimator: who makes a state of what the sensors say; None if there is nobody.
        targets: what the servos were asked for last, in the controllers' words; None in the first tick.
    """

    def __init__(
        self,
        scenario: Scenario,
        robot: Robot,
        layer: WholeBodyLayer | None = None,
        estimator: Estimator | None = None,
        world: HumanoidWorld | None = None,
    ) -> None:
        self.robot = robot
        if world is None:
            self.world = HumanoidWorld(scenario, robot)
        else:
            self.world = world
            world.reset(scenario)
        self._layer = make_layer(scenario, robot) if layer is None else layer
        self.estimator = make_estimator(scenario, robot) if estimator is None else estimator
        self.targets: JointTargets | None = None
        self._begin()
        name = scenario.whole_body if (choice := layer_of(scenario)) is None else choice
        self._guard = Guard(f"whole_body {name.short!r}", foreign=name.name not in LAYERS.shipped)

    @property
    def scenario(self) -> Scenario:
        """See `Plant`."""
        return self.world.scenario

    def add_push(self, push: Push) -> Push:
        """See `Plant`."""
        return self.world.add_push(push)

    def reset(self, scenario: Scenario) -> None:
        """See `Plant`."""
        self.world.reset(scenario)
        self._begin()

    def arrange(self) -> None:
        """The same within a `reset_context` of the physics, which dm_control's environments open themselves."""
        self.world.arrange()
        self._begin()

    def _begin(self) -> None:
        """Make all but the physics ready for an episode."""
        self.targets = None
        self._drives = Drives(self.world.scenario, self.robot)
        if self._layer is not None:
            self._layer.reset()

    @property
    def impulse_log(self) -> ImpulseLog:
        """See `Plant`."""
        return self.world.physics.impulse_log

    def observe(self) -> Observation:
        """See `Plant`."""
        return self.world.observe()

    @property
    def body_errors(self) -> dict[str, Any]:
        """See `Plant`."""
        return self.world.body.errors

    def condition(self) -> Condition:
        """See `Plant`."""
        return Condition(trunk_tilt=self.world.trunk_tilt(), other_contact=self.world.other_contact())

    def push_point(self, index: int) -> Array:
        """See `Plant`."""
        return self.world.physics.push_point(index)

    def give(self, tick: int, seen: Observation, action: Action) -> None:
        """See `Plant`."""
        if isinstance(action, BalanceCommand):
            assert self._layer is not None, "a controller at joint level gives no balance command"
            targets = self._guard.ask(self._layer.targets, tick, seen, action)
            action = self._guard.check_targets(targets, tick, len(self.robot.joint_names), seen)
        self.targets = action
        self.world.set_targets(self._drives.reference(action, seen, *self.world.joints()))

    def step(self) -> None:
        """See `Plant`."""
        try:
            self.world.physics.step(self.world.substeps)
        except PhysicsError as error:
            at = f"at {self.world.time:g} s the simulation diverged"
            raise InputError(f"timing.physics: {at}: {one_line(error)}") from error

    def end(self) -> Effort:
        """See `Plant`."""
        assert self.targets is not None
        self.world.tick_done()
        torque, speed = self.world.motor_state()
        return Effort(solver_failed=self.targets.solver_failed, torque=torque, speed=speed)


def make_plant(
    scenario: Scenario,
    robot: Robot,
    layer: WholeBodyLayer | None = None,
    estimator: Estimator | None = None,
    world: HumanoidWorld | None = None,
) -> Plant:
    """The plant of the world that a scenario names.

    Args:
        scenario: what happens.
        robot: the one that it names.
        layer: its whole-body layer, if there is one of a former episode, which nobody else uses.
        estimator: its estimator, likewise.
        world: its compiled world, likewise; see `compiled_in`.
    """
    if scenario.world == "pendulum":
        return PendulumPlant(scenario, robot)
    return HumanoidPlant(scenario, robot, layer, estimator, world)
