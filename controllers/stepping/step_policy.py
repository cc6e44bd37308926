"""What a rule for stepping has to say: which foot goes first, and where it lands, tick by tick."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.interface import Candidate
from controllers.nstep.step_limits import StepLimits
from controllers.stepping.feedback_swing import MOST_ACCELERATION
from models.conventions import CLEARANCE
from models.robot import Robot, Side

Array = NDArray[np.float64]

# The hips travel with the COG while the leg swings, and the foot lands that much farther than from hips at rest, as a
# share of the leg's own reach. At 1 the hips are halfway between the feet. With 1.2 more of the pushes of 2.1 to 2.5
# omega d to the side are recovered from, but a stance so wide is not kept: weaker pushes and the next ones fell it.
HIP_TRAVEL = 0.5
# A landed foot likes to be this far outside of the DCM, so that the DCM comes to rest between the feet [m].
OUTWARDS = 0.04


def step_limits(robot: Robot, max_stride: float) -> StepLimits:
    """Reach of the robot's feet for a given stride [m], the rest from its build."""
    return StepLimits(
        max_stride=max_stride,
        min_width=robot.sole_width + CLEARANCE,
        max_width=min(robot.stance_width + (1.0 + HIP_TRAVEL) * robot.hip_reach, robot.widest),
        stance_width=robot.stance_width,
        swing_speed=robot.swing_speed,
        swing_acceleration=MOST_ACCELERATION,
    )


class Heading:
    """The frame of a foot: its middle and the direction that the robot faces."""

    def __init__(self, yaw: float) -> None:
        """Face `yaw` [rad]."""
        self.yaw = yaw
        self._cos, self._sin = math.cos(yaw), math.sin(yaw)

    def local(self, point: Array, origin: Array) -> Array:
        """(2,) of the world seen from a foot at `origin` (2,) [m]."""
        (px, py), (ox, oy) = point.tolist(), origin.tolist()
        x, y = px - ox, py - oy
        return np.array([self._cos * x + self._sin * y, self._cos * y - self._sin * x])

    def world(self, point: Array, origin: Array) -> Array:
        """The inverse of `local`."""
        (x, y), (ox, oy) = point.tolist(), origin.tolist()
        return np.array([ox + self._cos * x - self._sin * y, oy + self._sin * x + self._cos * y])


@dataclass(frozen=True, slots=True, kw_only=True)
class Lift:
    """The step to begin.

    Attributes:
        side: the foot that goes.
        step_time: for how long [s].
        steps: steps that it is to be the first of.
        slack: of the state in their set of feet at rest [m of DCM]; negative if none holds it. NaN of a rule without
            sets.
        candidates: all that were considered.
    """

    side: Side
    step_time: float
    steps: int
    slack: float
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """Where the foot in the air should land, and where the ZMP stays until then.

    Attributes:
        foothold, zmp: (2,) in the world [m].
        steps: steps that are still to do, this one included.
        slack: of the state in the set of the foot under way, else as of `Lift`.
    """

    foothold: Array
    zmp: Array
    steps: int
    slack: float


class StepPolicy(Protocol):
    """Decides steps from the DCM. Points are (2,) in the world [m]."""

    def lift(self, dcm: Array, feet: Mapping[Side, Array], heading: Heading, sides: Sequence[Side]) -> Lift:
        """Which of `sides` should step, from both feet on the floor."""

    def aim(
        self, dcm: Array, stance: Array, swing: Array, heading: Heading, lift: Lift, ticks_left: int, steps: int
    ) -> Aim:
        """Where to land, `ticks_left` control ticks before it.

        Args:
            dcm: (2,).
            stance, swing: (2,) of the foot on the floor, and of the one in the air now.
            heading: of the robot.
            lift: the step under way.
            ticks_left: until landing.
            steps: how many were to do at the last tick, to be kept if they suffice.
        """


def natural_foothold(dcm: Array, zmp: Array, growth: float, side: Side) -> Array:
    """Where a foot likes to land: beside the DCM at landing (all from the stance foot) [m].

    Args:
        dcm: (2,) now.
        zmp: (2,) held until landing.
        growth: exp(omega t) over the time until then.
        side: the foot in the air.
    """
    outwards = OUTWARDS if side == "left" else -OUTWARDS
    (x, y), (zx, zy) = dcm.tolist(), zmp.tolist()
    return np.array([zx + (x - zx) * growth, zy + (y - zy) * growth + outwards])
