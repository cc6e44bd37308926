"""Who pushes: bodies whose momentum can be written down, and a push in MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.estimation.push_observer import PushObserver
from models.robot import load_robot
from tests.controllers.estimation.recorded import PUSH, estimator, record

DT = 0.002
ROBOT = load_robot("utmu2")
HIGH = ROBOT.cog_height


def pendulum(
    push: np.ndarray, above: float, spun: float, steps: int = 60, *, settling: float = 0.01, dt: float = DT
) -> PushObserver:
    """A body on the ZMP at the origin that is pushed `above` its COG; of that torque the share `spun` spins it up.

    The floor gives the rest, so that the horizontal force of the floor follows from Euler's equation about the COG.
    """
    observer = PushObserver(ROBOT, settling=settling, threshold=1.0)
    m, load = ROBOT.mass, ROBOT.mass * ROBOT.gravity
    cog, velocity, spin = np.array([0.02, -0.01, HIGH]), np.zeros(3), np.zeros(3)
    for _ in range(steps):
        observer.take(cog, velocity, spin, np.zeros(2), load, HIGH + above, dt)
        gained = spun * above * np.array([-push[1], push[0], 0.0])
        floor = np.zeros(3)
        floor[0] = (cog[0] * load - gained[1] + above * push[0]) / HIGH
        floor[1] = (cog[1] * load + gained[0] + above * push[1]) / HIGH
        acceleration = (floor + push) / m
        cog, velocity, spin = cog + dt * velocity, velocity + dt * acceleration, spin + dt * gained
    return observer


@pytest.mark.parametrize("above", [0.0, 0.1, -0.05])
@pytest.mark.parametrize("spun", [0.0, 1.0])
def test_a_steady_push_is_found(above: float, spun: float) -> None:
    push = np.array([12.0, -7.0, 0.0])
    found = pendulum(push, above, spun).force
    # The observer takes the floor's force for constant in a tick, in which it moves on by 1 % of the push.
    np.testing.assert_allclose(found, push, rtol=0.02)


@pytest.mark.parametrize(("settling", "dt"), [(0.01, 0.01), (0.01, 0.03), (5e-4, DT)])
def test_states_further_apart_than_it_settles_leave_it_stable(settling: float, dt: float) -> None:
    found = pendulum(np.array([12.0, -7.0, 0.0]), 0.0, 0.0, settling=settling, dt=dt, steps=6).force
    # What the floor gives changes from tick to tick, by a tenth of the push in 30 ms.
    np.testing.assert_allclose(found, [12.0, -7.0, 0.0], rtol=0.3)


def test_what_weight_and_floor_do_is_no_push() -> None:
    assert not pendulum(np.zeros(3), 0.0, 0.0).force.any()


def test_a_fall_is_no_push() -> None:
    observer = pendulum(np.array([12.0, 0.0, 0.0]), 0.0, 0.0)
    down = np.array([0.2, 0.0, 0.4 * HIGH])
    observer.take(down, np.array([0.0, 0.0, -2.0]), np.zeros(3), np.full(2, np.nan), 0.0, 0.1, DT)
    assert not observer.force.any()


def test_a_push_in_mujoco_is_found_through_the_sensors() -> None:
    kept = record(1.2, 22.5, latency=0.004)
    ekf = estimator(kept.robot, kept.dt)
    ekf.reset(kept.truth[0])
    forces = []
    for arrived, given, truth in zip(kept.readings, [None, *kept.targets], kept.truth, strict=False):
        ekf.estimate(arrived, given, truth.time)
        forces.append(ekf._observer.force[:2])
    time, found = np.array([truth.time for truth in kept.truth]), np.array(forces)
    impulse = np.linalg.norm(kept.push) / 0.1
    before, during = found[time < PUSH], found[(time > PUSH + 0.05) & (time < PUSH + 0.1)]
    assert not before.any()
    # Biases of 3 % of the forces and 0.05 m/s^2 of the accelerometer, and what is left of the settling.
    np.testing.assert_allclose(during.mean(axis=0), kept.push[:2] / 0.1, rtol=0, atol=0.15 * impulse)
