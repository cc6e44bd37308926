"""The filter alone: motions that can be written down, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers.estimation.beliefs import SensorFigures, beliefs
from controllers.estimation.contact import SoleContact
from controllers.estimation.invariant_filter import SIZE, InvariantFilter, Noise
from controllers.estimation.options import EkfOptions
from controllers.geometry.rotation import skew, turn
from controllers.multibody.tree import MOTION
from models.robot import load_robot

G, DT = 9.81, 0.001
WEIGHT = 64.0
NOISE = Noise(gyro=0.006, accelerometer=0.1, gyro_drift=1e-4, accelerometer_drift=1e-3)
UP = np.array([0.0, 0.0, G])
NEVER = 1e9


def fresh(rotation: np.ndarray | None = None, deviation: float = 0.01) -> InvariantFilter:
    found = InvariantFilter(NOISE, G)
    found.reset(np.eye(3) if rotation is None else rotation, np.zeros(3), np.full(SIZE, deviation))
    return found


def test_a_steady_turn_is_integrated_without_error() -> None:
    rate = np.array([0.3, -2.0, 1.1])
    state = fresh()
    for k in range(500):
        # the IMU itself rests, so that it feels gravity only, from the middle of the step
        middle = Rotation.from_rotvec((k + 0.5) * DT * rate).as_matrix()
        state.predict(rate, middle.T @ UP, DT)
    # 500 roundings
    np.testing.assert_allclose(state.rotation, Rotation.from_rotvec(0.5 * rate).as_matrix(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-12)


def test_a_steady_acceleration_gives_its_parabola() -> None:
    push = np.array([1.0, -0.5, 0.2])
    state = fresh()
    for _ in range(400):
        state.predict(np.zeros(3), push + UP, DT)
    np.testing.assert_allclose(state.velocity, 0.4 * push, rtol=1e-12)
    np.testing.assert_allclose(state.position, 0.5 * 0.4**2 * push, rtol=1e-12)


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
def test_gravity_shows_the_tilt_of_a_robot_that_stands(axis: list[float]) -> None:
    true = turn(0.02 * np.array(axis))
    state = fresh()
    H = np.zeros((3, SIZE))
    H[:, 3:6] = np.eye(3)
    for _ in range(2000):
        state.predict(np.zeros(3), true.T @ UP, DT)
        state.correct(H, state.velocity, np.full(3, 0.002**2))
    # The accelerometer's bias is a rival explanation: of 0.2 m/s^2 of tilt, 0.01 as against 0.01 * g are believed.
    assert np.linalg.norm((state.rotation @ true.T)[:2, 2]) < 0.02 * 0.02
    assert np.linalg.norm(state.velocity) < 1e-4


def moved(state: InvariantFilter, error: np.ndarray) -> InvariantFilter:
    """The state with an error, as the filter means it."""
    found = InvariantFilter(NOISE, G)
    out = turn(error[:3])
    found.rotation = out @ state.rotation
    found.velocity, found.position = out @ state.velocity + error[3:6], out @ state.position + error[6:9]
    found.gyro_bias, found.accelerometer_bias = state.gyro_bias + error[9:12], state.accelerometer_bias + error[12:]
    return found


def error_of(found: InvariantFilter, true: InvariantFilter) -> np.ndarray:
    out = found.rotation @ true.rotation.T
    return np.concatenate(
        [
            Rotation.from_matrix(out).as_rotvec(),
            found.velocity - out @ true.velocity,
            found.position - out @ true.position,
            found.gyro_bias - true.gyro_bias,
            found.accelerometer_bias - true.accelerometer_bias,
        ]
    )


def somewhere() -> InvariantFilter:
    state = fresh(turn(np.array([0.3, -0.2, 0.8])))
    state.velocity, state.position = np.array([0.4, -0.3, 0.1]), np.array([0.2, 0.5, 0.25])
    state.gyro_bias, state.accelerometer_bias = np.array([0.01, -0.02, 0.005]), np.array([0.1, 0.05, -0.1])
    return state


def test_the_error_grows_as_the_covariance_is_told() -> None:
    gyro, force, small = np.array([1.0, -2.0, 0.5]), np.array([0.5, 1.0, 9.0]), 1e-5
    quiet = Noise(gyro=0.0, accelerometer=0.0, gyro_drift=0.0, accelerometer_drift=0.0)
    state = somewhere()
    for i in range(SIZE):
        error = np.zeros(SIZE)
        error[i] = small
        true, found = moved(state, np.zeros(SIZE)), moved(state, error)
        found._noise = quiet
        found.covariance = np.outer(error, error)
        true.predict(gyro, force, DT)
        found.predict(gyro, force, DT)
        after = error_of(found, true)
        # Second order in the step and in the error, beside a first order of `small`.
        np.testing.assert_allclose(found.covariance, np.outer(after, after), rtol=0, atol=0.01 * DT * small**2)


def contact(load: float) -> SoleContact:
    options = EkfOptions(contact_load=load / WEIGHT, full_load=10.0 / WEIGHT)
    corners = np.array([[0.05, -0.03], [0.05, 0.03], [-0.05, 0.03], [-0.05, -0.03]])
    believed = beliefs(options, load_robot("utmu2"), SensorFigures())
    return SoleContact(options, believed, WEIGHT, corners, np.array([0.0, 0.0, 0.03]))


def test_rows_of_a_sole_are_the_derivatives_of_what_they_compare() -> None:
    gyro, cop = np.array([1.0, -2.0, 0.5]), np.array([0.01, -0.005])
    state = somewhere()
    # a sole that lies flat in the world
    at, moves, turns = np.array([0.02, 0.04, -0.2]), np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.4, -0.3])
    sole = np.array([(state.rotation.T, at, turns, moves)], MOTION)

    def rows(where: InvariantFilter) -> tuple[np.ndarray, np.ndarray]:
        got: list[tuple[np.ndarray, np.ndarray]] = []
        where.correct = lambda H, excess, variance: got.append((H.copy(), excess.copy()))  # type: ignore[method-assign]
        where.rate[:] = gyro - where.gyro_bias
        contact(5.0).take(where, sole, np.array([30.0]), cop[None])
        return got[0]

    H, excess = rows(moved(state, np.zeros(SIZE)))
    assert H.shape == (6, SIZE)
    for i in range(SIZE):
        error = np.zeros(SIZE)
        error[i] = small = 1e-6
        slope = (rows(moved(state, error))[1] - excess) / small
        if i < 3:
            # By design a row of speed leaves out the turn of the speed that is left, as truly none is.
            slope[:3] -= skew(np.eye(3)[i]) @ excess[:3]
        np.testing.assert_allclose(slope, H[:, i], rtol=0, atol=1e-5)


@pytest.mark.parametrize(("force", "cop"), [(4.9, 0.0), (30.0, np.nan)])
def test_a_sole_without_load_or_centre_says_nothing(force: float, cop: float) -> None:
    state = somewhere()
    before = state.covariance.copy()
    sole = np.array([(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))], MOTION)
    contact(5.0).take(state, sole, np.array([force]), np.full((1, 2), cop))
    np.testing.assert_array_equal(state.covariance, before)


def test_a_slipping_sole_is_believed_less() -> None:
    gains = []
    for speed in (0.001, 3.0):
        state = fresh()
        state.velocity = np.array([speed, 0.0, 0.0])
        flat = np.array([(np.eye(3), np.array([0.0, 0.0, 0.03]), np.zeros(3), np.zeros(3))], MOTION)
        contact(5.0).take(state, flat, np.array([30.0]), np.zeros((1, 2)))
        gains.append(1.0 - state.velocity[0] / speed)
    assert gains[1] < 1e-3 < 0.3 < gains[0]
