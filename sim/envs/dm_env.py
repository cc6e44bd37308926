"""The same episode as a `dm_env` environment, built with dm_control's `rl.control`."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from dm_control.rl import control
from dm_env import specs
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, FootReference, FootState, JointTargets, Observation
from models.arena import SIDES
from models.errors import OkiagariError, one_line
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against
from scenarios.schema import Scenario
from sim.episode.episode import Episode
from sim.episode.humanoid_world import PushedPhysics
from sim.episode.plant import HumanoidPlant

Array = NDArray[np.float64]
ActionKind = Literal["balance", "joints"]

# zmp (2), then for the left and the right foot: stance, position (3), velocity (3), acceleration (3), yaw, feedback
_FOOT = 12
BALANCE_SIZE = 2 + 2 * _FOOT


class ActionError(OkiagariError):
    """An action does not fit the environment's action spec."""


class PushRecovery(control.Task):
    """Stay on your feet: 1 point for every control period without a fall; a fall ends the episode.

    Attributes:
        plant: the humanoid.
        kind: what an action is: `balance` (ZMP command and foot references, turned into joint targets by the
            scenario's whole-body layer) or `joints` (position, velocity and torque target of each joint).
        episode: the one under way, with its record; `episode.result()` judges it.
    """

    def __init__(self, scenario: Scenario, robot: Robot, kind: ActionKind) -> None:
        self.plant = HumanoidPlant(scenario, robot)
        self.kind = kind
        self.episode = Episode(scenario, self.plant)
        self._scenario = scenario
        self._spec = _action_spec(kind, robot)

    def initialize_episode(self, physics: PushedPhysics) -> None:
        """Put the robot into its stand, and begin a new record."""
        self.plant.arrange()
        self.episode = Episode(self._scenario, self.plant)

    def before_step(self, action: Array, physics: PushedPhysics) -> None:
        """Turn an action into joint targets for the servos.

        Raises:
            ActionError: if the action has another shape, type or range than its spec, or is not finite.
        """
        try:
            self._spec.validate(action)
        except ValueError as error:
            raise ActionError(f"action ({self.kind}): {one_line(error)}") from None
        if not np.isfinite(action).all():
            raise ActionError(f"action ({self.kind}): entry {int(np.argmin(np.isfinite(action)))} is not finite")
        if self.kind == "balance":
            self.episode.begin(balance_command(action))
        else:
            position, velocity, torque = action.reshape(3, -1)
            self.episode.begin(JointTargets(position=position, velocity=velocity, torque=torque))

    def after_step(self, physics: PushedPhysics) -> None:
        """Count the control period and record how it went."""
        self.episode.end()

    def action_spec(self, physics: PushedPhysics) -> specs.BoundedArray:
        """Shape, type and range of an action."""
        return self._spec

    def get_observation(self, physics: PushedPhysics) -> OrderedDict[str, Array]:
        """What the controllers see, late and noisy if the scenario says so; dm_control asks once a time step."""
        return observation_as_dict(self.episode.observe())

    def get_reward(self, physics: PushedPhysics) -> float:
        """1 unless it fell."""
        return 0.0 if self._fell() else 1.0

    def get_termination(self, physics: PushedPhysics) -> float | None:
        """A fall ends the episode with discount 0."""
        return 0.0 if self._fell() else None

    def _fell(self) -> bool:
        return self.episode.fell


def make_environment(scenario: Scenario, kind: ActionKind = "balance") -> control.Environment:
    """The scenario as a `dm_env` environment.

    Args:
        scenario: of the world `humanoid`.
        kind: what an action is, see `PushRecovery`.

    Raises:
        InputError: if the scenario does not fit its robot.
        OkiagariError: if the scenario's world is not the humanoid.
    """
    if scenario.world != "humanoid":
        raise OkiagariError(f"world: {scenario.world!r} has no dm_env environment; allowed: 'humanoid'")
    robot = load_robot(scenario.robot)
    check_against(scenario, robot)
    task = PushRecovery(scenario, robot, kind)
    return control.Environment(
        task.plant.world.physics, task, time_limit=scenario.duration, n_sub_steps=scenario.timing.substeps
    )


def balance_action(command: BalanceCommand) -> Array:
    """A balance command as an action (26,)."""
    action = np.empty(BALANCE_SIZE)
    action[:2] = command.zmp
    for i, side in enumerate(SIDES):
        foot, at = command.feet[side], 2 + i * _FOOT
        action[at] = foot.stance
        action[at + 1 : at + 4] = foot.position
        action[at + 4 : at + 7] = foot.velocity
        action[at + 7 : at + 10] = foot.acceleration
        action[at + 10] = foot.yaw
        action[at + 11] = foot.feedback
    return action


def balance_command(action: Array) -> BalanceCommand:
    """The inverse of `balance_action`."""
    feet = {}
    for i, side in enumerate(SIDES):
        at = 2 + i * _FOOT
        feet[side] = FootReference(
            stance=bool(action[at] >= 0.5),
            position=action[at + 1 : at + 4].copy(),
            velocity=action[at + 4 : at + 7].copy(),
            acceleration=action[at + 7 : at + 10].copy(),
            yaw=float(action[at + 10]),
            feedback=bool(action[at + 11] >= 0.5),
        )
    return BalanceCommand(zmp=action[:2].copy(), feet=feet)


def observation_as_dict(observation: Observation) -> OrderedDict[str, Array]:
    """An observation as named arrays; a foot is position (3), yaw, normal force."""
    named = OrderedDict(
        time=np.array([observation.time]),
        cog=observation.cog,
        cog_velocity=observation.cog_velocity,
        angular_momentum=observation.angular_momentum,
        zmp=observation.zmp,
        configuration=observation.configuration,
        velocity=observation.velocity,
    )
    for side in SIDES:
        foot = observation.feet[side]
        named[f"{side}_foot"] = np.array([*foot.position, foot.yaw, foot.force])
    return named


def observation_from_dict(named: Mapping[str, Any]) -> Observation:
    """The inverse of `observation_as_dict`."""
    feet = {}
    for side in SIDES:
        x, y, z, yaw, force = named[f"{side}_foot"].tolist()
        feet[side] = FootState(position=np.array([x, y, z]), yaw=yaw, force=force)
    return Observation(
        time=float(named["time"][0]),
        cog=named["cog"],
        cog_velocity=named["cog_velocity"],
        angular_momentum=named["angular_momentum"],
        zmp=named["zmp"],
        feet=feet,
        configuration=named["configuration"],
        velocity=named["velocity"],
    )


def _action_spec(kind: ActionKind, robot: Robot) -> specs.BoundedArray:
    if kind == "balance":
        low, high = np.full(BALANCE_SIZE, -np.inf), np.full(BALANCE_SIZE, np.inf)
        for at in (2, 2 + _FOOT):
            for switch in (at, at + 11):
                low[switch], high[switch] = 0.0, 1.0
        return specs.BoundedArray((BALANCE_SIZE,), np.float64, low, high, name="zmp_and_feet")
    size = 3 * len(robot.joint_names)
    return specs.BoundedArray((size,), np.float64, np.full(size, -np.inf), np.full(size, np.inf), name="joint_targets")
