"""From the state then, when the readings were taken, to the state now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import cross, from_quaternion, to_quaternion, turn
from controllers.interface import JointTargets
from models.robot import Side

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyState:
    """A state of the whole body, and what acts on it.

    Attributes:
        configuration: (7 + n,), as in `Observation`.
        velocity: (6 + n,), as in `Observation`.
        acceleration: (3,) of the trunk's origin in the world [m/s^2].
        load: (2,) on the left and the right sole [N].
        loaded: the soles that the floor carries.
        push: (3,) force on the trunk's COM in the world [N].
    """

    configuration: Array
    velocity: Array
    acceleration: Array
    load: Array
    loaded: frozenset[Side]
    push: Array


@dataclass(frozen=True, slots=True)
class Held:
    """Targets that the servos held for a while [s]."""

    targets: JointTargets
    duration: float


class NominalBody(Protocol):
    """The body of the robot's file on a flat floor, simulated beside the world; controllers know no simulator."""

    def forward(self, state: BodyState, held: Sequence[Held]) -> tuple[Array, Array, Array]:
        """The state after the servos held these targets, one after another.

        Returns:
            Configuration (7 + n,), velocity (6 + n,) and load (2,), as in `BodyState`.
        """


def extrapolated(state: BodyState, ahead: float) -> tuple[Array, Array]:
    """Configuration and velocity `ahead` [s] later if the trunk accelerates as it does and the joints do not."""
    configuration, velocity = state.configuration.copy(), state.velocity.copy()
    configuration[:3] += ahead * velocity[:3] + (0.5 * ahead * ahead) * state.acceleration
    configuration[3:7] = to_quaternion(from_quaternion(configuration[3:7]) @ turn(ahead * velocity[3:6]))
    configuration[7:] += ahead * velocity[6:]
    velocity[:3] += ahead * state.acceleration
    return configuration, velocity


@compiled
def acceleration_of(rotation: Array, rate: Array, arm: Array, acceleration: Array) -> Array:
    """(3,) acceleration of what is `arm` away from a point that has one, but for the turn's own acceleration."""
    return acceleration + rotation @ cross(rate, cross(rate, arm))
