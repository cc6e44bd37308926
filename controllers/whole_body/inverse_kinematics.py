"""Whole-body layer by inverse kinematics of accelerations, in closed form, every tick from the measured state.

The same is asked for as by the inverse dynamics. The motion follows by weighted least squares, and the floor's wrench
from the motion. What would pass a limit is held at it and the motion solved for again, up to `ROUNDS` times. Forces and
moments have no price here, so that a sole on its edge spins where the inverse dynamics spares it.
"""

from __future__ import annotations

import numpy as np

from controllers.interface import BalanceCommand, JointTargets, Observation
from controllers.multibody.motion_kernel import feed_forward
from controllers.registry import NoOptions
from controllers.whole_body import dynamics_tasks as tasks
from controllers.whole_body.body_terms import BodyTerms
from controllers.whole_body.placo_model import PlacoModel
from models.errors import InputError
from models.robot import Robot


class IkWholeBody:
    """Inverse kinematics of accelerations, with the torques that they need as feed-forward."""

    follows_acceleration = True

    def __init__(self, robot: Robot, dt: float, options: NoOptions) -> None:
        """Read from the robot what does not change.

        Args:
            robot: the body.
            dt: control period [s].
            options: none.

        Raises:
            InputError: if the legs are not alike, or the trunk is not what floats.
        """
        self._robot = robot
        model = PlacoModel(robot).wrapper.model
        if not BodyTerms.fit(model):
            raise InputError(
                "whole_body: 'ik' needs a floating trunk and two legs of equally many joints; see 'dynamics'"
            )
        self._terms = BodyTerms(robot, model)
        self._cog = tasks.CogTask(robot, model, dt)
        self._weights, self._joints = tasks.weights(robot, model), tasks.joints(robot)
        self._feet = tasks.FeetTask()
        self.reset()

    def reset(self) -> None:
        """Forget the last episode's torque."""
        self._torque = np.zeros(len(self._robot.joint_names))

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """See `WholeBodyLayer.targets`. Without an answer it keeps the last torque and says so."""
        terms, feet = self._terms, self._feet
        terms.read(observation.configuration, observation.velocity)
        feet.aim(command)
        zx, zy = command.zmp.tolist()
        (left, left_place), (right, right_place) = terms.ankles
        found, torque = feed_forward(
            terms.mass,
            terms.jacobian,
            terms.bias,
            terms.q,
            terms.qd,
            left,
            left_place,
            right,
            right_place,
            terms.soles,
            terms.chains,
            self._joints,
            self._cog.acceleration(observation, command),
            (zx, zy),
            feet.rows,
            self._weights,
        )
        if found:
            self._torque = torque
        return JointTargets(
            position=observation.configuration[7:],
            velocity=observation.velocity[6:],
            torque=self._torque,
            solver_failed=not found,
            from_seen=True,
        )
