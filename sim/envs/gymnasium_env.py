"""The episode as a Gymnasium environment, `Okiagari/PushRecovery-v0`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pydantic import ValidationError

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.interface import BalanceCommand, FootReference, JointTargets, Observation
from models.arena import SIDES
from models.errors import InputError, OkiagariError
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against, load
from scenarios.error_messages import first_error
from scenarios.schema import Scenario
from sim.envs.dm_env import observation_as_dict
from sim.episode.episode import Episode
from sim.episode.plant import Action, HumanoidPlant
from sim.record.outcome import Result

Array = NDArray[np.float64]
Kind = Literal["joints", "torque", "zmp"]

REWARDS: dict[str, float] = {"alive": 1.0, "effort": 0.0, "recovered": 0.0}
"""Weights of the terms of the reward: of each step without a fall; of the mean square of torque / stall torque, which
is taken away; and of an episode that ends recovered."""
FRAME = (480, 640)
"""Height and width of a picture [pixels]."""


class PushRecoveryEnv(gymnasium.Env[Any, Any]):
    """Stay on your feet while the scenario's pushes come.

    An observation holds the same arrays as that of the dm_env environment, without the time; a ZMP that is not there is
    replaced by the middle of the feet. An action is within [-1, 1]:

    - `joints`: (n,) positions from one end of each joint's range to the other;
    - `torque`: (n,) of each joint's stall torque, the servos' own feedback off;
    - `zmp`: (2,) from the middle of the feet to the ends of their support polygon, carried out by the scenario's
      whole-body layer with both feet standing.

    `reset(seed=…)` draws the initial pose with that seed; `reset(options={"pushes": […]})` replaces the pushes, too. At
    the end `info["outcome"]` is the verdict of the record, `info["reason"]` why.

    Attributes:
        robot: whom it happens to.
        scenario: of the present episode.
        episode: the one under way, with its record.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012 (Gymnasium's own name)

    def __init__(
        self,
        scenario: str | Scenario = "quiet",
        action: Kind = "joints",
        frame_skip: int = 10,
        reward: Mapping[str, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Compile the robot.

        Args:
            scenario: a name, a path, or one that has been read; of the world `humanoid`.
            action: what an action is, see above.
            frame_skip: control periods that an action is held for.
            reward: weights that replace some of `REWARDS`.
            render_mode: "rgb_array", or None for no pictures.

        Raises:
            InputError: if the scenario does not fit its robot.
            OkiagariError: if an argument is not allowed.
        """
        self.scenario = scenario if isinstance(scenario, Scenario) else load(scenario)
        if self.scenario.world != "humanoid":
            raise OkiagariError(f"world: {self.scenario.world!r} has no environment; allowed: 'humanoid'")
        if action not in ("joints", "torque", "zmp"):
            raise OkiagariError(f"action: {action!r} is none of 'joints', 'torque', 'zmp'")
        if isinstance(frame_skip, bool) or not isinstance(frame_skip, int) or frame_skip < 1:
            raise OkiagariError(f"frame_skip: {frame_skip!r} must be a whole number of control periods, at least 1")
        if unknown := sorted(set(reward or {}) - set(REWARDS)):
            raise OkiagariError(f"reward: {unknown[0]!r} is no term; there are {', '.join(REWARDS)}")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OkiagariError(f"render_mode: {render_mode!r} is not allowed; it must be 'rgb_array' or None")
        self.robot = robot = load_robot(self.scenario.robot)
        check_against(self.scenario, robot)
        self._plant = HumanoidPlant(self.scenario, robot)
        self._kind, self._skip, self.render_mode = action, frame_skip, render_mode
        self._weights = REWARDS | dict(reward or {})
        self.metadata = self.metadata | {"render_fps": round(1.0 / (frame_skip * self.scenario.timing.control))}
        self.episode = Episode(self.scenario, self._plant)
        shapes = {name: values.shape for name, values in self._observe().items()}
        self.observation_space = spaces.Dict(
            {name: spaces.Box(-np.inf, np.inf, shape, np.float64) for name, shape in shapes.items()}
        )
        count = 2 if action == "zmp" else len(robot.joint_names)
        self.action_space = spaces.Box(-1.0, 1.0, (count,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Begin an episode; see the class.

        Raises:
            OkiagariError: if an option is unknown, or the pushes are not allowed.
        """
        super().reset(seed=seed)
        changes: dict[str, Any] = {} if seed is None else {"seed": int(self.np_random.integers(2**31))}
        if unknown := sorted(set(options or {}) - {"pushes"}):
            raise OkiagariError(f"options: {unknown[0]!r} is not allowed; there is 'pushes'")
        if changes or options:
            try:
                self.scenario = Scenario.model_validate(self.scenario.as_dict() | changes | (options or {}))
            except ValidationError as error:
                raise InputError(f"options: {first_error(error, Scenario)}") from None
            check_against(self.scenario, self.robot)
        self._plant.reset(self.scenario)
        self.episode = Episode(self.scenario, self._plant)
        return self._observe(), {}

    def step(self, action: Array) -> tuple[dict[str, Array], float, bool, bool, dict[str, Any]]:
        """Hold an action for `frame_skip` control periods.

        Raises:
            OkiagariError: if it has another shape than the space, or is not finite.
        """
        action = np.asarray(action, dtype=np.float64)
        if action.shape != self.action_space.shape or not np.isfinite(action).all():
            raise OkiagariError(f"action: must be finite and of the shape {self.action_space.shape}, got {action}")
        share, effort, fell, over = np.clip(action, -1.0, 1.0), 0.0, False, False
        for _ in range(self._skip):
            self.episode.begin(self._action(share))
            self._plant.step()
            self.episode.end()
            torque, _ = self._plant.world.motor_state()
            effort += float(np.mean((torque / self.robot.stall_torque) ** 2)) / self._skip
            fell, over = self.episode.fell, self.episode.ticks >= self.scenario.ticks
            self._seen = self.episode.observe()
            if fell or over:
                break
        weights, info = self._weights, dict[str, Any]()
        reward = (0.0 if fell else weights["alive"]) - weights["effort"] * effort
        if fell or over:
            outcome = self.episode.result().outcome
            info = {"outcome": outcome.result.value, "reason": outcome.reason.value}
            reward += weights["recovered"] if not fell and outcome.result is Result.RECOVERED else 0.0
        return self._named(self._seen), reward, fell, over and not fell, info

    def render(self) -> NDArray[np.uint8] | None:
        """(h, w, 3) picture of the present state; None without a render mode."""
        if self.render_mode is None:
            return None
        height, width = FRAME
        picture: NDArray[np.uint8] = self._plant.world.physics.render(height, width, camera_id="three_quarter")
        return picture

    def _observe(self) -> dict[str, Array]:
        self._seen = self.episode.observe()
        return self._named(self._seen)

    def _named(self, seen: Observation) -> dict[str, Array]:
        named = {name: np.asarray(values, dtype=np.float64) for name, values in observation_as_dict(seen).items()}
        del named["time"]
        if not np.isfinite(named["zmp"]).all():
            named["zmp"] = _middle(seen)
        return named

    def _action(self, share: Array) -> Action:
        robot: Robot = self.robot
        if self._kind == "zmp":
            return self._balance(share)
        still = np.zeros_like(share)
        if self._kind == "torque":
            off = np.zeros_like(share)
            torque = share * robot.stall_torque
            return JointTargets(position=still, velocity=still, torque=torque, stiffness=off, damping=off)
        low, high = robot.joint_range.T
        return JointTargets(position=low + 0.5 * (share + 1.0) * (high - low), velocity=still, torque=still)

    def _balance(self, share: Array) -> BalanceCommand:
        seen, soles = self._seen, self.robot.sole_vertices
        feet = [Foot(position=seen.feet[s].position[:2], yaw=seen.feet[s].yaw, sole=soles[s]) for s in SIDES]
        polygon, middle = support_polygon(feet), _middle(seen)
        reach = np.abs(polygon.vertices - middle).max(axis=0)
        references = {s: FootReference.standing(seen.feet[s], seen.feet[s].yaw) for s in SIDES}
        return BalanceCommand(zmp=polygon.nearest(middle + share * reach), feet=references)


def _middle(seen: Observation) -> Array:
    """(2,) middle of the feet [m]."""
    middle: Array = 0.5 * (seen.feet["left"].position + seen.feet["right"].position)[:2]
    return middle
