"""The stance, the pushes and the limits that the tests of plans and walks share."""

from __future__ import annotations

import math

import numpy as np

from controllers.geometry.support_polygon import Foot
from controllers.nstep.step_limits import StepLimits
from controllers.pendulum import Pendulum
from models.robot import Side

OMEGA = math.sqrt(9.81 / 0.26)
PENDULUM = Pendulum(OMEGA, 0.002)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
LIMITS = StepLimits(max_stride=0.16, min_width=0.075, max_width=0.2, stance_width=0.084, swing_speed=2.0)
# The program's own tolerance is 1e-10; sums over a plan of a hundred variables of the order of one follow it.
SOLVER = 1e-8


def standing(ahead: float = 0.0, turn: float = 0.0) -> dict[Side, Foot]:
    return {
        "left": Foot(position=np.array([ahead, 0.042]), yaw=turn, sole=SOLE),
        "right": Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=SOLE),
    }


def pushed(speed: float, degrees: float = 0.0) -> np.ndarray:
    angle = math.radians(degrees)
    return np.array([0.0, speed * math.cos(angle), 0.0, speed * math.sin(angle)])
