"""What servos take from the motion of the COG because their references are held for a whole control period.

The layer sends each joint's measured angle as its reference. Until the next one the joint moves on by q' t, and the
servo's stiffness K pulls it back: a false damping of about K T / 2 over a period T. On the body this brakes the COG,
so that the realised ZMP leads the command, on `utmu2` by some 40 ms at 1 Hz if nothing makes up for it.
"""

from __future__ import annotations

import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.whole_body.placo_model import in_placo_order
from models.arena import SIDES
from models.robot import TRUNK, Robot

Array = NDArray[np.float64]

# Of that damping so much is found on the body: the servos are simulated in steps of their own within the period, at
# whose beginnings the angle is less far off.
FOUND = 0.6
# It is made up for as if the COG were never faster than this [m/s] at scale 1. A push is beyond: there the drag brakes
# what is to be braked, and without it fewer pushes were recovered from.
SWAY = 0.05


class ServoDrag:
    """Makes up for it while the robot sways on both feet."""

    def __init__(self, robot: Robot, model: pinocchio.Model, dt: float) -> None:
        """Work out the drag in the stand.

        Args:
            robot: whose servos.
            model: of it, as placo read it.
            dt: control period [s].
        """
        self._drag = FOUND * _drag(robot, model, dt)
        self._most = SWAY * robot.scale.speed

    def made_up(self, velocity: Array) -> tuple[float, float]:
        """Horizontal acceleration that the drag takes [m/s^2], at a velocity (3,) of the COG [m/s]."""
        vx, vy, _ = velocity.tolist()
        most, (along_x, along_y) = self._most, self._drag.tolist()
        return along_x * max(-most, min(most, vx)), along_y * max(-most, min(most, vy))


def _drag(robot: Robot, model: pinocchio.Model, dt: float) -> Array:
    """(2,) acceleration by velocity of the COG along x and y [1/s], feet flat and trunk upright."""
    data, q, qd = model.createData(), pinocchio.neutral(model), np.zeros(model.nv)
    in_placo_order(robot.stand.copy(), np.zeros(model.nv), q, qd)
    pinocchio.forwardKinematics(model, data, q, qd)

    def moved(frame: str) -> Array:
        found: Array = pinocchio.computeFrameJacobian(
            model, data, q, model.getFrameId(frame), pinocchio.LOCAL_WORLD_ALIGNED
        )
        return found

    legs = [i for i, name in enumerate(robot.joint_names) if name in robot.leg_joints]
    free = [*range(6), *(6 + i for i in legs)]
    cog = pinocchio.jacobianCenterOfMass(model, data, q)
    held = np.vstack([*(moved(f"{side}_sole") for side in SIDES), moved(TRUNK)[3:], cog])[:, free]
    unit = np.zeros((len(held), 2))
    unit[-3:-1] = np.eye(2)
    speeds = np.linalg.lstsq(held, unit, rcond=None)[0][6:]
    drag: Array = 0.5 * dt * robot.servo_stiffness[legs] @ speeds**2 / robot.mass
    return drag
