"""What is asked of a body by accelerations, whoever solves for them: weights, gains and limits."""

from __future__ import annotations

import math

import numpy as np
import pinocchio
from numpy.typing import NDArray

from controllers.interface import BalanceCommand, Observation
from controllers.multibody.torque_kernel import FOOT, Weights
from controllers.whole_body.servo_drag import ServoDrag
from models.arena import SIDES
from models.robot import Robot

Array = NDArray[np.float64]

# Weights of the soft tasks, and stiffness [1/s^2] and damping [1/s] of each; those of height, trunk and posture are of
# a robot of scale 1.
COG_WEIGHT, STANCE_WEIGHT, TRUNK_WEIGHT, POSTURE_WEIGHT = 10.0, 50.0, 1.0, 1e-2
# So much of the posture's weight do the joints have that swing the arms forward and back: they swing against the legs
# and take their turn about the vertical. With arms as free to the sides, pushes to the side fell the robot.
LIMB_SWING = 0.03
# A quick step asks for more than the motors have. The way of the swing foot gives way before the COG and the trunk do.
SWING_WEIGHT = 10.0
HEIGHT_STIFFNESS, HEIGHT_DAMPING = 200.0, 28.0
SWING_POSITION, SWING_ORIENTATION = (900.0, 60.0), (400.0, 40.0)
STANCE_POSITION, STANCE_ORIENTATION = (0.0, 20.0), (400.0, 40.0)
TRUNK_GAINS, POSTURE_GAINS = (100.0, 20.0), (100.0, 20.0)
# Weights of what is kept small: a sole's force, on top of it its parts that placo calls tangential (y and z of the
# sole's frame), its moments; the joints' torques.
FORCE_WEIGHT, TANGENTIAL_WEIGHT, MOMENT_WEIGHT = 1e-4, 1e-4, 1e-2
TORQUE_WEIGHT = 1e-4
# A sole that stands alone, on its edge, holds hardly any moment about the vertical: asked for one by a quick swing, it
# spins by a radian, and the leg with it. The moment is dear, then, by a robot of scale 1 [1/(N m)^2]; ten times as dear
# it slows the swing, and steps backwards come too short. The limit of friction itself in the QP did so as well.
YAW_MOMENT_WEIGHT = 140.0
# The solver's soles are a little smaller than the real ones, so that what it plans does not tip them.
SOLE_MARGIN = 0.005
FRICTION = 0.7
# A COG off the middle of the feet, or over feet far apart, is lowered so that the legs bend as in the stand, but by no
# more than this, by a robot of scale 1 [m].
MOST_LOWERED = 0.05


def slowed(gains: tuple[float, float], robot: Robot) -> tuple[float, float]:
    """Stiffness [1/s^2] and damping [1/s] in the pendulum's time of a robot."""
    stiffness, damping = gains
    return stiffness / robot.scale.time**2, damping / robot.scale.time


def sole_size(robot: Robot) -> tuple[float, float]:
    """Length and width of the solver's soles [m]."""
    corners = robot.sole_vertices["left"]
    length, width = (corners.max(axis=0) - corners.min(axis=0) - 2 * SOLE_MARGIN).tolist()
    return length, width


def posture_share(robot: Robot, joint: str) -> float:
    """How much of the posture's weight a joint has, from 0 to 1."""
    if joint in robot.leg_joints:
        return 0.0
    return LIMB_SWING if joint in robot.limb_swings else 1.0


def joints(robot: Robot) -> Array:
    """(n, JOINT) figures of the joints: see `controllers.multibody.torque_kernel.JOINT`."""
    posture = np.array([posture_share(robot, name) for name in robot.joint_names])
    return np.column_stack([robot.stand[7:], posture, robot.stall_torque, robot.joint_damping, robot.joint_friction])


def weights(robot: Robot, model: pinocchio.Model) -> Array:
    """`Weights` of the tasks of a robot, and of its model as placo read it."""
    length, width = sole_size(robot)
    trunk, pose = slowed(TRUNK_GAINS, robot), slowed(POSTURE_GAINS, robot)
    given = Weights(
        mass=float(pinocchio.computeTotalMass(model)),
        gravity=-float(model.gravity.linear[2]),
        cog=COG_WEIGHT,
        orientation=STANCE_WEIGHT,
        trunk=TRUNK_WEIGHT,
        trunk_stiffness=trunk[0],
        trunk_damping=trunk[1],
        posture=POSTURE_WEIGHT,
        posture_stiffness=pose[0],
        posture_damping=pose[1],
        torque=TORQUE_WEIGHT,
        force=FORCE_WEIGHT,
        tangential=TANGENTIAL_WEIGHT,
        moment=MOMENT_WEIGHT,
        yaw_moment=YAW_MOMENT_WEIGHT / (robot.scale.force * robot.scale.length) ** 2,
        half_length=0.5 * length,
        half_width=0.5 * width,
        friction=FRICTION,
    )
    return np.array(given)


class FeetTask:
    """What the feet are to do.

    Attributes:
        rows: (2, FOOT) numbers, renewed by `aim`: see `controllers.multibody.torque_kernel.FOOT`.
    """

    def __init__(self) -> None:
        self.rows = np.zeros((2, FOOT))
        self._aimed: list[tuple[bool, bool] | None] = [None, None]

    def aim(self, command: BalanceCommand) -> None:
        """Take over a command; what its feet have in common with the last one's is left."""
        for i, side in enumerate(SIDES):
            foot, row = command.feet[side], self.rows[i]
            kind = (foot.stance, foot.feedback)
            if self._aimed[i] != kind:
                self._aimed[i] = kind
                if foot.stance:
                    row[:7] = 1.0, 0.0, STANCE_WEIGHT, *STANCE_POSITION, *STANCE_ORIENTATION
                    # Where the foot stands is where it shall stay: no pull towards a point it has slipped away from.
                    row[7:] = 0.0
                else:
                    gains = (0.0, 0.0) if foot.feedback else SWING_POSITION
                    row[:7] = 0.0, 0.0, SWING_WEIGHT, *gains, *SWING_ORIENTATION
            row[1] = foot.yaw
            if not foot.stance:
                row[7:10], row[10:13], row[13:] = foot.position, foot.velocity, foot.acceleration


class CogTask:
    """The acceleration that the COG is asked for."""

    def __init__(self, robot: Robot, model: pinocchio.Model, dt: float) -> None:
        """Work out what does not change.

        Args:
            robot: the body.
            model: of it, as placo read it.
            dt: control period [s].
        """
        self._drag = ServoDrag(robot, model, dt)
        self._omega_squared, self._height = robot.omega**2, robot.cog_height
        self._height_gains = slowed((HEIGHT_STIFFNESS, HEIGHT_DAMPING), robot)
        # A leg that is straight neither lengthens nor pushes: the feet lose hold, spin and slide apart. None becomes
        # longer than in the stand.
        self._hip_height = math.sqrt(robot.leg_length**2 - robot.hip_reach**2)
        self._hip_offset = 0.5 * robot.stance_width
        self._most_lowered = MOST_LOWERED * robot.scale.length

    def acceleration(self, observation: Observation, command: BalanceCommand) -> tuple[float, float, float]:
        """By the pendulum (1) with the ZMP of the command; up or down to where the legs reach [m/s^2]."""
        cx, cy, cz = observation.cog.tolist()
        zx, zy = command.zmp.tolist()
        vz = float(observation.cog_velocity[2])
        w2, feet = self._omega_squared, command.feet
        stiffness, damping = self._height_gains
        x, y, height = w2 * (cx - zx), w2 * (cy - zy), self._height
        if feet["left"].stance and feet["right"].stance:
            more_x, more_y = self._drag.made_up(observation.cog_velocity)
            x, y, height = x + more_x, y + more_y, height - self.lowered(observation)
        return x, y, stiffness * (height - cz) - damping * vz

    def lowered(self, observation: Observation) -> float:
        """By how much the COG is to be lower than in the stand, so that neither leg is longer [m].

        The hips are taken to be beside the COG, on the line of the feet, as far apart as the soles are in the stand.
        """
        cx, cy, _ = observation.cog.tolist()
        lx, ly, _ = observation.feet["left"].position.tolist()
        rx, ry, _ = observation.feet["right"].position.tolist()
        dx, dy = lx - rx, ly - ry
        apart = math.hypot(dx, dy)
        share = self._hip_offset / apart if apart > 0.0 else 0.0
        hx, hy = share * dx, share * dy
        farther = max(math.hypot(lx - hx - cx, ly - hy - cy), math.hypot(rx + hx - cx, ry + hy - cy))
        reached = math.sqrt(max(self._hip_height**2 - farther**2, 0.0))
        return min(self._hip_height - reached, self._most_lowered)
