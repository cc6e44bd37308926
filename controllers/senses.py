"""What a robot's sensors say, and who makes a state of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from controllers.interface import Array, JointTargets, Observation

if TYPE_CHECKING:
    from models.robot import Side


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What a robot's sensors say at the start of a control tick, late by the latency.

    A sensor that is slower than the others is read again as it was; `taken` is when the fastest measured.

    Attributes:
        time: of the control tick it is given at [s].
        taken: when it was measured [s].
        joint_position: (n,) encoders [rad].
        gyro: (3,) angular velocity in the trunk's frame [rad/s].
        accelerometer: (3,) specific force in the trunk's frame, at `Robot.imu` [m/s^2]; at rest it points up.
        force: normal force on each sole [N].
        cop: (2,) centre of pressure in the frame of each sole's site [m]; NaN while too little force is on it.
    """

    time: float
    taken: float
    joint_position: Array
    gyro: Array
    accelerometer: Array
    force: dict[Side, float]
    cop: dict[Side, Array]


class Estimator(Protocol):
    """Makes a state of what the sensors say: `Class(robot, dt, options)`, with the control period dt [s].

    It knows the robot's file, which need not be the true body. It may have a class `Options`, a
    `controllers.fields.Strict`, and an attribute `nominal_body`, which is then set to a
    `controllers.estimation.look_ahead.NominalBody` before the first episode. A scenario with more latency than its
    attribute `most_latency` [s] is refused. With an attribute `takes_figures = True`
    it is given a fourth argument, the `controllers.estimation.beliefs.SensorFigures` of the scenario.
    """

    def reset(self, observation: Observation) -> None:
        """Begin an episode at rest, with pose and place given."""

    def estimate(self, readings: Sequence[Reading], targets: JointTargets | None, time: float) -> Observation:
        """The state now; asked once a control tick.

        Args:
            readings: those that arrived since the last tick, oldest first: several if sensors are faster than the
                ticks, none if they are slower, or late at the start.
            targets: what the servos were given in the last tick; None in the first.
            time: now [s].
        """


class Truth:
    """No estimator at all: the world gives the controllers the state as it is. It is asked nothing."""
