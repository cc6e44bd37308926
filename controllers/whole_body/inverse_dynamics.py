"""Whole-body layer by inverse dynamics on the measured state: a weighted QP, every tick.

Accelerations of the COG, the feet and the trunk are asked for; the solver finds joint torques and contact wrenches
inside the soles and friction cones that give them. The torques go to the servos as feed-forward.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from controllers.fields import Strict
from controllers.interface import BalanceCommand, JointTargets, Observation
from controllers.whole_body.body_terms import BodyTerms
from controllers.whole_body.dynamics_tasks import CogTask
from controllers.whole_body.placo_dynamics import PlacoDynamics
from controllers.whole_body.placo_model import PlacoModel, friction_torque
from controllers.whole_body.torque_program import TorqueProgram
from models.robot import Robot


class DynamicsOptions(Strict):
    """What `DynamicsWholeBody` can be told.

    Attributes:
        solver: who solves the QP: ourselves, and placo where we find no answer or the legs are not alike ("own"), or
            placo alone ("placo"), which has no price on the moment about the vertical of a sole that stands alone.
    """

    solver: Literal["own", "placo"] = "own"


class DynamicsWholeBody:
    """Inverse dynamics by a weighted QP, every tick from the measured state."""

    Options = DynamicsOptions
    follows_acceleration = True

    def __init__(self, robot: Robot, dt: float, options: DynamicsOptions) -> None:
        """Build the solvers once; they are reused over episodes.

        Args:
            robot: the body.
            dt: control period [s].
            options: who solves.
        """
        self._robot = robot
        model = PlacoModel(robot)
        self._cog = CogTask(robot, model.wrapper.model, dt)
        self._placo = PlacoDynamics(robot, model, dt)
        own = options.solver == "own" and BodyTerms.fit(model.wrapper.model)
        self._own = TorqueProgram(robot, model.wrapper.model) if own else None
        self.reset()

    def reset(self) -> None:
        """Forget the last episode's torque."""
        self._torque = np.zeros(len(self._robot.joint_names))

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """See `WholeBodyLayer.targets`. A QP without answer keeps the last torque and says so."""
        acceleration = np.array(self._cog.acceleration(observation, command))
        torque = None if self._own is None else self._own.torque(observation, command, acceleration)
        if torque is None:
            torque = self._placo.torque(observation, command, acceleration)
        if torque is not None:
            self._torque = torque
        return JointTargets(
            position=observation.configuration[7:],
            velocity=observation.velocity[6:],
            torque=self._torque + friction_torque(self._robot, observation.velocity[6:]),
            solver_failed=torque is None,
            from_seen=True,
        )
