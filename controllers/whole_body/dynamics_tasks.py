"""What the inverse dynamics asks of a body, whoever solves it: weights, gains and limits of its weighted QP."""

from __future__ import annotations

from models.robot import Robot

# Weights of the soft tasks, and stiffness [1/s^2] and damping [1/s] of each; those of height, trunk and posture are of
# a robot of scale 1.
COG_WEIGHT, STANCE_WEIGHT, TRUNK_WEIGHT, POSTURE_WEIGHT = 10.0, 50.0, 1.0, 1e-2
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
# The solver's soles are a little smaller than the real ones, so that what it plans does not tip them.
SOLE_MARGIN = 0.005
FRICTION = 0.7


def slowed(gains: tuple[float, float], robot: Robot) -> tuple[float, float]:
    """Stiffness [1/s^2] and damping [1/s] in the pendulum's time of a robot."""
    stiffness, damping = gains
    return stiffness / robot.scale.time**2, damping / robot.scale.time


def sole_size(robot: Robot) -> tuple[float, float]:
    """Length and width of the solver's soles [m]."""
    corners = robot.sole_vertices["left"]
    length, width = (corners.max(axis=0) - corners.min(axis=0) - 2 * SOLE_MARGIN).tolist()
    return length, width
