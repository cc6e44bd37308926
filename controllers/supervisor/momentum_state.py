"""The pendulum's state with the spin of the body counted in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Observation
from models.robot import Robot

Array = NDArray[np.float64]


def momentum_state(observation: Observation, robot: Robot) -> Array:
    """State (4,) whose velocity is the momentum about the feet / (m h): m h v plus the momentum about the COG.

    A push above the COG makes the body spin, and stopping the spin pushes the COG on.
    """
    x, vx, y, vy = observation.balance_state().tolist()
    about_x, about_y, _ = observation.angular_momentum.tolist()
    lever = robot.mass * robot.cog_height
    return np.array([x, vx + about_y / lever, y, vy - about_x / lever])
