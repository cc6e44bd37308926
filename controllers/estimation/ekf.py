"""The shipped estimator: an invariant Kalman filter on IMU, encoders and soles, and a look ahead by the latency."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.estimation.beliefs import SensorFigures, beliefs
from controllers.estimation.contact import SoleContact
from controllers.estimation.invariant_filter import InvariantFilter, Noise
from controllers.estimation.joint_filter import JointFilter
from controllers.estimation.look_ahead import BodyState, Held, NominalBody, acceleration_of, extrapolated
from controllers.estimation.options import LOOK_AHEAD, EkfOptions
from controllers.estimation.push_observer import PushObserver
from controllers.geometry.rotation import cross, from_quaternion, to_quaternion
from controllers.interface import FootState, JointTargets, Observation
from controllers.multibody.tree import Records
from controllers.senses import Reading
from controllers.whole_body.measured_body import MeasuredBody
from models.arena import SIDES
from models.errors import InputError, OkiagariError
from models.robot import Robot

Array = NDArray[np.float64]

# Two times are one if they differ by less [s].
_SAME_TIME = 1e-9
# Standard deviation of yaw [rad], place [m] and speed [m/s] at the start, which are given.
_GIVEN = 1e-3
_FLAWLESS = SensorFigures()


class InvariantEkf:
    """The trunk's attitude, velocity and place by an invariant Kalman filter; the rest by kinematics of a nominal body.

    Yaw and place drift, for nothing that is measured shows them. Under latency the COG, its velocity, the angular
    momentum, the load and the soles that carry it are told as they are now; joints, a foot in the air and the ZMP as
    they were measured, if `EkfOptions.predicted` says so.

    Attributes:
        most_latency: that it can make up for [s].
        nominal_body: simulates the nominal body; whoever drives the estimator gives it, and the predictor "simulate"
            needs it.
    """

    Options = EkfOptions
    takes_figures = True

    def __init__(self, robot: Robot, dt: float, options: EkfOptions, sensors: SensorFigures = _FLAWLESS) -> None:
        """Build the filter once; it is reused over episodes.

        Args:
            robot: the nominal body.
            dt: control period [s].
            options: what is believed.
            sensors: what is known of them, for what the options leave out.
        """
        believed = beliefs(options, robot, sensors)
        self.nominal_body: NominalBody | None = None
        bounded = options.predictor != "none" and options.latency is None
        self.most_latency = LOOK_AHEAD if bounded else math.inf
        self._options, self._believed, self._dt, self._imu = options, believed, dt, robot.imu
        self._at_drive = sensors.at_drive
        weight = robot.mass * robot.gravity
        self._load = options.contact_load * weight
        self._body = MeasuredBody(robot)
        self._joints = JointFilter(believed.encoder, options.joint_acceleration)
        noise = Noise(
            gyro=believed.gyro,
            accelerometer=believed.accelerometer,
            gyro_drift=options.gyro_drift,
            accelerometer_drift=options.accelerometer_drift,
        )
        self._filter = InvariantFilter(noise, robot.gravity)
        self._contact = SoleContact(options, believed, weight, robot.sole_vertices["left"], robot.imu)
        self._observer = PushObserver(robot, options.push_settling, believed.push_threshold)
        self._sent: deque[tuple[float, JointTargets]] = deque()

    def reset(self, observation: Observation) -> None:
        """See `Estimator.reset`.

        Raises:
            OkiagariError: the predictor "simulate" has no body to simulate.
        """
        if self._options.predictor == "simulate" and self.nominal_body is None:
            raise OkiagariError("predictor 'simulate' needs a nominal body: set `nominal_body`")
        believed = self._believed
        rotation = from_quaternion(observation.configuration[3:7])
        deviation = np.repeat(
            [self._options.first_tilt, _GIVEN, _GIVEN, believed.gyro_bias, believed.accelerometer_bias], 3
        )
        deviation[2] = _GIVEN
        self._filter.reset(rotation, observation.configuration[:3] + rotation @ self._imu, deviation)
        self._joints.reset(observation.configuration[7:])
        self._angles: Array | None = None
        self._observer.reset()
        self._sent.clear()
        self._taken, self._seen = observation.time, False
        self._forces = np.array([observation.feet[side].force for side in SIDES])
        self._centres = np.full((2, 2), math.nan)
        self._first = observation

    def estimate(self, readings: Sequence[Reading], targets: JointTargets | None, time: float) -> Observation:
        """See `Estimator.estimate`. Until the first reading arrives, the state is that at the start.

        Raises:
            InputError: the readings are older than can be made up for.
        """
        if targets is not None:
            self._sent.append((time - self._dt, targets))
            # those that held at any time since; the first of them may have begun long before
            while len(self._sent) > 1 and self._sent[1][0] <= time - LOOK_AHEAD + _SAME_TIME:
                self._sent.popleft()
        before = self._taken
        for reading in readings:
            self._take(reading)
        if not self._seen:
            return replace(self._first, time=time)
        then = self._state()
        age = time - self._taken if self._options.latency is None else self._options.latency
        measured = self._observation(then.configuration, then.velocity, then.load, time)
        if self._options.predictor == "none" or age < _SAME_TIME:
            return measured
        if age > self.most_latency + _SAME_TIME:
            raise InputError(
                f"sensing: the readings of 'ekf' are {age:g} s old, and it makes up for {LOOK_AHEAD} s at most; "
                'give it predictor = "none", less latency, or faster sensors'
            )
        if self._options.predictor == "extrapolate":
            now = self._observation(*extrapolated(then, age), then.load, time)
        else:
            self._look_for_push(self._taken - before)
            ahead = self._simulated(replace(then, push=self._observer.force), time - age, time)
            now = self._observation(*ahead, time)
        return now if self._tells_whole(targets) else self._balance(now, measured)

    def _balance(self, now: Observation, measured: Observation) -> Observation:
        """What is of now, but for joints, ZMP and feet that do not stand."""
        feet = {}
        for side in SIDES:
            here, then = now.feet[side], measured.feet[side]
            stands = max(here.force, then.force) >= self._load
            feet[side] = here if stands else replace(then, force=here.force)
        return replace(
            now, zmp=measured.zmp, feet=feet, configuration=measured.configuration, velocity=measured.velocity
        )

    def _tells_whole(self, targets: JointTargets | None) -> bool:
        """Whether the whole body is told as it is now."""
        if self._options.predicted is not None:
            return self._options.predicted == "body"
        return not (self._at_drive and targets is not None and targets.from_seen)

    def _take(self, reading: Reading) -> None:
        dt = reading.taken - self._taken
        if dt > _SAME_TIME:
            self._joints.predict(dt)
            # encoders that are slower than the rest are read again as they were
            if reading.joint_position is not self._angles:
                self._joints.correct(reading.joint_position)
                self._angles = reading.joint_position
            self._filter.predict(reading.gyro, reading.accelerometer, dt)
            self._taken = reading.taken
        self._seen = True
        for index, side in enumerate(SIDES):
            self._forces[index], self._centres[index] = reading.force[side], reading.cop[side]
        soles = self._body.by_joints(self._joints.position, self._joints.velocity)
        self._contact.take(self._filter, soles, self._forces, self._centres)

    def _state(self) -> BodyState:
        """The state when the last reading was taken."""
        state, joints = self._filter, self._joints
        state.straighten()
        configuration, velocity = np.empty(7 + len(joints.position)), np.empty(6 + len(joints.position))
        acceleration = np.empty(3)
        _of_trunk(
            state.rotation,
            state.velocity,
            state.position,
            state.rate,
            state.acceleration,
            self._imu,
            configuration,
            velocity,
            acceleration,
        )
        configuration[7:], velocity[6:] = joints.position, joints.velocity
        forces = self._forces.tolist()
        loaded = frozenset(side for side, force in zip(SIDES, forces, strict=True) if force >= self._load)
        return BodyState(
            configuration=configuration,
            velocity=velocity,
            acceleration=acceleration,
            load=self._forces.copy(),
            loaded=loaded,
            push=np.zeros(3),
        )

    def _look_for_push(self, dt: float) -> None:
        """Show the push observer the state that the body is placed in, `dt` [s] after the last one."""
        if dt > _SAME_TIME:
            body, (zmp, load) = self._body, self._zmp()
            high = float(body.trunk_com[2])
            self._observer.take(body.cog, body.cog_velocity, body.angular_momentum, zmp, load, high, dt)

    def _simulated(self, then: BodyState, begin: float, end: float) -> tuple[Array, Array, Array]:
        """The nominal body's configuration, velocity and load at `end` [s], from the state at `begin`."""
        assert self.nominal_body is not None
        held, stop = [], end
        for start, targets in reversed(self._sent):
            # times are sums of decimal fractions: without their rounding the steps are the physics' own
            duration = round(stop - max(start, begin), 9)
            if duration > _SAME_TIME:
                held.append(Held(targets, duration))
            if start <= begin:
                break
            stop = start
        held.reverse()
        return self.nominal_body.forward(then, held)

    def _observation(self, configuration: Array, velocity: Array, load: Array, time: float) -> Observation:
        body = self._body
        body.place(configuration, velocity)
        zmp, _ = self._zmp()
        feet = {
            side: FootState(position=body.sole_places[i].copy(), yaw=body.yaw(i), force=float(load[i]))
            for i, side in enumerate(SIDES)
        }
        return Observation(
            time=time,
            cog=body.cog.copy(),
            cog_velocity=body.cog_velocity.copy(),
            angular_momentum=body.angular_momentum.copy(),
            zmp=zmp,
            feet=feet,
            configuration=configuration,
            velocity=velocity,
        )

    def _zmp(self) -> tuple[Array, float]:
        """ZMP (2,) of the last forces on the body as it is placed, NaN without load, and the load [N]."""
        zmp = np.empty(2)
        return zmp, _centre_of_load(self._body.soles, self._forces, self._centres, zmp)


@compiled
def _of_trunk(
    R: Array, v: Array, p: Array, rate: Array, gained: Array, imu: Array, configuration: Array, velocity: Array,
    acceleration: Array,
) -> None:  # fmt: skip
    """Write the trunk's part of a configuration and velocity, and its origin's acceleration, by those of the IMU."""
    back = -imu
    configuration[:3] = p + R @ back
    configuration[3:7] = to_quaternion(R)
    velocity[:3] = v + R @ cross(rate, back)
    velocity[3:6] = rate
    acceleration[:] = acceleration_of(R, rate, back, gained)


@compiled
def _centre_of_load(soles: Records, forces: Array, centres: Array, zmp: Array) -> float:
    """Load on both soles [N]; the ZMP (2,) is written."""
    load = 0.0
    zmp[:] = 0.0
    for i in range(len(soles)):
        x, y, force = centres[i, 0], centres[i, 1], forces[i]
        if force > 0.0 and not math.isnan(x):
            load += force
            for k in range(2):
                zmp[k] += force * (soles[i].p[k] + soles[i].R[k, 0] * x + soles[i].R[k, 1] * y)
    for k in range(2):
        zmp[k] = zmp[k] / load if load > 0.0 else math.nan
    return load
