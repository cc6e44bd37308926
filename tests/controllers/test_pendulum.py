from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from controllers.pendulum import Pendulum, PendulumError

OMEGA = math.sqrt(9.81 / 0.26)


@pytest.mark.parametrize("dt", [1e-5, 0.002, 0.005, 0.1])
def test_hold_is_the_matrix_exponential_of_7(dt: float) -> None:
    continuous = np.zeros((6, 6))
    for axis in (0, 1):
        p, v, u = 2 * axis, 2 * axis + 1, 4 + axis
        continuous[p, v] = 1.0
        continuous[v, p] = OMEGA**2
        continuous[v, u] = -(OMEGA**2)
    exact = expm(continuous * dt)
    pendulum = Pendulum(OMEGA, dt)
    # Both sides are rounded to some ulps of entries of the order of one.
    np.testing.assert_allclose(pendulum.A, exact[:4, :4], rtol=0, atol=1e-13)
    np.testing.assert_allclose(pendulum.B, exact[:4, 4:], rtol=0, atol=1e-13)


def test_input_matrix_does_not_cancel_at_a_short_period() -> None:
    pendulum = Pendulum(OMEGA, 1e-7)
    phase = OMEGA * 1e-7
    # 1 - cosh(phase) = -phase^2/2 to a relative phase^2/12 ~ 3e-14; the direct difference is wrong by 1e-4.
    assert pendulum.B[0, 0] == pytest.approx(-(phase**2) / 2, rel=1e-12)


def test_dcm_grows_away_from_the_zmp_by_itself() -> None:
    pendulum = Pendulum(OMEGA, 0.002)
    x, u = np.array([0.01, -0.2, 0.03, 0.4]), np.array([0.02, -0.01])
    grown = u + (pendulum.dcm(x) - u) * math.exp(OMEGA * 0.002)
    np.testing.assert_allclose(pendulum.dcm(pendulum.step(x, u)), grown, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(pendulum.dcm(np.stack([x, x])), np.stack([pendulum.dcm(x)] * 2))


def test_rest_over_the_zmp_stays() -> None:
    pendulum = Pendulum(OMEGA, 0.002)
    x = pendulum.rest((0.1, -0.2))
    np.testing.assert_allclose(pendulum.step(x, (0.1, -0.2)), x, rtol=0, atol=1e-16)


def test_rollout_is_repeated_step() -> None:
    pendulum = Pendulum(OMEGA, 0.002)
    rng = np.random.default_rng(1)
    mu = rng.normal(scale=0.03, size=(300, 2))
    x = np.array([0.01, 0.1, -0.02, 0.05])
    xi = pendulum.rollout(x, mu)
    np.testing.assert_array_equal(xi[0], x)
    for k in range(300):
        # One step from the roll-out's own state: only the rounding of one tick, relative to its size.
        np.testing.assert_allclose(xi[k + 1], pendulum.step(xi[k], mu[k]), rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(pendulum.rollout(x, np.zeros((0, 2))), x[None])


def test_axis_over_several_ticks_is_a_power() -> None:
    pendulum = Pendulum(OMEGA, 0.005)
    a, b = pendulum.axis(7)
    x = np.array([0.02, -0.1])
    walked = x
    for _ in range(7):
        one, held = pendulum.axis(1)
        walked = one @ walked + held * 0.01
    np.testing.assert_allclose(a @ x + b * 0.01, walked, rtol=0, atol=1e-15)


def test_height_gives_omega_of_3() -> None:
    assert Pendulum.from_height(0.26, 9.81, 0.002).omega == OMEGA


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_impossible_pendulums_are_refused(bad: float) -> None:
    for make in (
        lambda: Pendulum(bad, 0.002),
        lambda: Pendulum(6.0, bad),
        lambda: Pendulum.from_height(bad, 9.81, 0.002),
        lambda: Pendulum.from_height(0.26, bad, 0.002),
    ):
        with pytest.raises(PendulumError, match="positive"):
            make()


def test_matrices_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Pendulum(OMEGA, 0.002).A[0, 0] = 2.0
