"""From a balance command to joint targets: what every whole-body layer offers, and the choice of one by name."""

from __future__ import annotations

from typing import Literal, Protocol

from controllers.interface import BalanceCommand, JointTargets, Observation
from models.robot import Robot


class WholeBody(Protocol):
    """A whole-body layer: turns what the balance controllers want into what the servos get."""

    def reset(self) -> None:
        """Forget the last episode."""

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """Joint targets that realise a ZMP command and foot references from the measured state."""


def make_whole_body(name: Literal["dynamics", "ik"], robot: Robot, dt: float) -> WholeBody:
    """Build a whole-body layer.

    Args:
        name: `dynamics` (placo's DynamicsSolver) or `ik` (its KinematicsSolver with feed-forward torques).
        robot: the body.
        dt: control period [s].
    """
    # placo is loaded only where a whole body is wanted: the pendulum and the command line's help do without.
    if name == "ik":
        from controllers.whole_body.inverse_kinematics import IkWholeBody

        return IkWholeBody(robot, dt)
    from controllers.whole_body.inverse_dynamics import DynamicsWholeBody

    return DynamicsWholeBody(robot, dt)
