"""The pendulum as the world: the paper's own simulation, with feet that go exactly where they are told."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.interface import BalanceCommand, FootState, Observation
from controllers.pendulum import Pendulum
from models.arena import SIDES
from models.robot import Robot, Side
from scenarios.catalogue import with_push
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.push_schedule import ImpulseLog, schedule, start_of_step

Array = NDArray[np.float64]

# A foot on the floor carries at least this share of the weight, wherever the ZMP is; that is how a landing is felt.
LEAST_SHARE = 0.1
# [m] A swing reference that ends at the floor ends there to within the rounding of a quintic.
ON_THE_FLOOR = 1e-6


class PendulumWorld:
    """COG-ZMP pendulum (1)-(8) over massless feet; the ZMP is held inside the feet's hull.

    Attributes:
        robot: whose mass, height and soles it has.
        impulse_log: account of the pushes.
        ticks: control ticks done.
        scenario: of the episode, with the pushes that were added to it.
    """

    def __init__(self, scenario: Scenario, robot: Robot) -> None:
        """Set up.

        Args:
            scenario: gives the periods, the pushes and the seeded variation.
            robot: facts of the robot that the scenario names.
        """
        self.robot = robot
        self.scenario = scenario
        self._substeps = scenario.timing.substeps
        self._dt = scenario.timing.control
        self._step = Pendulum(robot.omega, scenario.timing.physics)
        self.reset()

    def reset(self) -> None:
        """Stand over the middle of the feet, leaning a little as the scenario's seed says."""
        robot, physics = self.robot, self.scenario.timing.physics
        self.impulse_log = ImpulseLog(schedule(self.scenario.pushes, physics, robot.mass), physics)
        self._feet = {side: np.array([*robot.sole_stance[side][:2], 0.0]) for side in SIDES}
        self._yaw = {side: robot.sole_stance[side][2] for side in SIDES}
        middle = 0.5 * (self._feet["left"] + self._feet["right"])[:2]
        lean = np.random.default_rng(self.scenario.seed).normal(0.0, self.scenario.variation.pose, 2)
        self._x = self._step.rest(middle + robot.cog_height * np.tan(lean))
        self._zmp = self._x[0::2].copy()
        self._polygon = self._support()
        self.ticks = 0

    @property
    def time(self) -> float:
        """Time at the start of the present control tick [s]."""
        return self.ticks * self._dt

    def observe(self) -> Observation:
        """What the controllers see now."""
        shares = self._shares()
        weight = self.robot.mass * self.robot.gravity
        x = self._x
        return Observation(
            time=self.time,
            cog=np.array([x[0], x[2], self.robot.cog_height]),
            cog_velocity=np.array([x[1], x[3], 0.0]),
            angular_momentum=np.zeros(3),
            zmp=self._zmp.copy(),
            feet={
                side: FootState(
                    position=self._feet[side].copy(), yaw=self._yaw[side], force=weight * shares.get(side, 0.0)
                )
                for side in SIDES
            },
            configuration=np.empty(0),
            velocity=np.empty(0),
        )

    def apply(self, command: BalanceCommand) -> None:
        """Hold the commanded ZMP, as far as the support polygon allows, for one control period."""
        lifted = {side for side in SIDES if not command.feet[side].stance}
        self._polygon = self._support(lifted)
        self._zmp = self._polygon.nearest(command.zmp)
        first = self.ticks * self._substeps
        acting = self.impulse_log.active(first, first + self._substeps)
        for step in range(first, first + self._substeps):
            self._x = self._step.step(self._x, self._zmp)
            forces = {i: force for i in acting if (force := self.impulse_log.sample(i, step)) is not None}
            if forces:
                self._x += self._pushed(np.sum(list(forces.values()), axis=0))
            for index, force in forces.items():
                self.impulse_log.book(index, force)
        for side in lifted:
            self._feet[side] = command.feet[side].position.copy()
            self._feet[side][2] = max(self._feet[side][2], 0.0)
            self._yaw[side] = command.feet[side].yaw
        self.ticks += 1

    def add_push(self, push: Push) -> Push:
        """Push while the episode runs; see `HumanoidWorld.add_push`."""
        dt = self.scenario.timing.physics
        push = push.model_copy(update={"start": start_of_step(self.ticks * self._substeps, dt)})
        self.scenario, index = with_push(self.scenario, push, self.robot)
        self.impulse_log.insert(index, *schedule([push], dt, self.robot.mass))
        return push

    def _pushed(self, force: Array) -> Array:
        """What a force (3,) held over one physics step adds to the state (4,), exactly."""
        phase = self._step.omega * self._step.dt
        acceleration = force[:2] / (self.robot.mass * self.scenario.disturbance.mass_scale)
        position = 2.0 * math.sinh(0.5 * phase) ** 2 / self._step.omega**2
        velocity = math.sinh(phase) / self._step.omega
        return np.ravel(np.column_stack([position * acceleration, velocity * acceleration]))

    def _on_floor(self, side: Side) -> bool:
        return bool(self._feet[side][2] <= ON_THE_FLOOR)

    def _foot(self, side: Side) -> Foot:
        return Foot(position=self._feet[side][:2], yaw=self._yaw[side], sole=self.robot.sole_vertices[side])

    def _support(self, lifted: set[Side] | None = None) -> SupportPolygon:
        """Hull of the feet that carry weight: on the floor and not about to leave it."""
        standing = [side for side in SIDES if self._on_floor(side) and side not in (lifted or set())]
        return support_polygon([self._foot(side) for side in standing or SIDES])

    def _shares(self) -> dict[Side, float]:
        standing = [side for side in SIDES if self._on_floor(side)]
        if len(standing) < 2:
            return dict.fromkeys(standing, 1.0)
        left, right = self._feet["left"][:2], self._feet["right"][:2]
        apart = left - right
        share = float(np.clip((self._zmp - right) @ apart / (apart @ apart), LEAST_SHARE, 1.0 - LEAST_SHARE))
        return {"left": share, "right": 1.0 - share}
