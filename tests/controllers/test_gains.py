from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.gains import Gain, GainError, UnobservableGainError, UnstableGainError, dcm, lqr, poles
from controllers.pendulum import Pendulum
from models.errors import OkiagariError

P = Pendulum.from_height(0.3, 9.81, 0.005)


def continuous_poles(pendulum: Pendulum, gain: Gain) -> np.ndarray:
    """Of the x axis, slowest first [1/s]."""
    loop = gain.closed_loop(pendulum)[:2, :2]
    return np.sort_complex(np.log(np.linalg.eigvals(loop).astype(complex)) / pendulum.dt)[::-1]


@given(st.floats(0.05, 3.0), st.floats(0.05, 3.0), st.floats(0.001, 0.02))
def test_real_poles_land_where_they_are_asked(first: float, second: float, dt: float) -> None:
    p = Pendulum(5.7, dt)
    wanted = -np.array([first, second]) * p.omega
    if np.abs(wanted + p.omega).min() < 1e-3 * p.omega:
        return
    # Trace and determinant, because a double eigenvalue is only known to the root of the rounding.
    loop = poles(p, wanted.tolist()).closed_loop(p)[:2, :2]
    z = np.exp(wanted * dt)
    assert np.trace(loop) == pytest.approx(z.sum(), abs=1e-11)
    assert np.linalg.det(loop) == pytest.approx(z.prod(), abs=1e-11)


def test_complex_pair_lands_on_both_axes() -> None:
    gain = poles(P, (-4.0 + 3.0j, -4.0 - 3.0j))
    np.testing.assert_allclose(continuous_poles(P, gain), [-4.0 + 3.0j, -4.0 - 3.0j], atol=1e-9)
    loop = gain.closed_loop(P)
    np.testing.assert_array_equal(loop[:2, :2], loop[2:, 2:])
    assert not loop[:2, 2:].any()
    assert not loop[2:, :2].any()


def test_lqr_is_the_cheapest_of_its_neighbours() -> None:
    q, r, x0 = (3.0, 0.5), 2.0, np.array([0.02, -0.05, 0.0, 0.0])

    def cost(F: np.ndarray) -> float:
        x, total = x0, 0.0
        # 20 s: what is left then is below e^-20 of the start.
        for _ in range(4000):
            u = -F @ x
            total += q[0] * x[0] ** 2 + q[1] * x[1] ** 2 + r * u[0] ** 2
            x = P.step(x, u)
        return total

    best = lqr(P, q, r).F
    for change in ([0.05, 0.0], [-0.05, 0.0], [0.0, 0.02], [0.0, -0.02]):
        assert cost(best) < cost(best + np.kron(np.eye(2), change))


def test_lqr_places_the_poles_that_another_program_found() -> None:
    # Poles over omega at h = 0.3 m, dt = 5 ms, noted with two figures: half of the last one is 0.05 at most.
    for q, r, expected in (
        ((1.0, 1.0), 1.0, (-0.24, -5.9)),
        ((100.0, 1.0), 1.0, (-1.8, -5.6)),
        ((1.0, 0.0), 1.0, (-1.1 + 0.46j, -1.1 - 0.46j)),
        ((1.0, 1.0), 100.0, (-0.76, -1.3)),
    ):
        np.testing.assert_allclose(continuous_poles(P, lqr(P, q, r)) / P.omega, expected, atol=0.05)


@given(st.floats(1.01, 8.0), st.floats(0.001, 0.02))
def test_dcm_gain_feeds_back_the_divergent_component_only(k: float, dt: float) -> None:
    p = Pendulum(5.7, dt)
    gain = dcm(p, k)
    x = np.array([0.03, -0.1, -0.02, 0.2])
    np.testing.assert_allclose(-gain.F @ x, k * p.dcm(x), rtol=1e-12)
    after = p.dcm(gain.closed_loop(p) @ x)
    grown = math.exp(p.omega * dt)
    np.testing.assert_allclose(after, (grown - (grown - 1.0) * k) * p.dcm(x), rtol=1e-9)
    assert gain.dcm_ratio(p) == k


def test_dcm_ratio_is_that_of_this_pendulum_and_no_other_gain() -> None:
    assert dcm(P, 1.5).dcm_ratio(Pendulum(P.omega * 1.01, P.dt)) is None
    assert lqr(P, (1.0, 1.0), 1.0).dcm_ratio(P) is None
    other_axis = np.array(dcm(P, 1.5).F)
    other_axis[1] *= 1.1
    assert Gain(F=other_axis, name="two laws").dcm_ratio(P) is None


def test_spectral_radius_is_that_of_the_slowest_pole_and_one_is_unstable() -> None:
    assert poles(P, (-1.0, -3.0)).spectral_radius(P) == pytest.approx(math.exp(-1.0 * P.dt), abs=1e-12)
    with pytest.raises(UnstableGainError, match=r"spectral radius 1\.02"):
        Gain(F=np.zeros((2, 4)), name="none").require_stable(P)


def test_pole_at_minus_omega_names_the_dcm_gain_that_has_it() -> None:
    with pytest.raises(UnobservableGainError, match="use dcm") as caught:
        poles(P, (-P.omega, -3.0))
    k = float(str(caught.value).split("k=")[1].split(")")[0])
    # Six digits of k are printed.
    np.testing.assert_allclose(continuous_poles(P, dcm(P, k)), [-3.0, -P.omega], rtol=1e-5)
    # With nothing but the ZMP weighed, LQR mirrors the pole at +omega.
    with pytest.raises(UnobservableGainError, match="use dcm"):
        lqr(P, (0.0, 0.0), 1.0)


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: dcm(P, 1.0), UnstableGainError, "between 1 and 35.4.*got 1:"),
        (lambda: dcm(P, math.nan), UnstableGainError, "got nan"),
        (lambda: dcm(P, 36.0), UnstableGainError, "got 36"),
        (lambda: poles(P, (1.0, -3.0)), UnstableGainError, "negative real part"),
        (lambda: poles(P, (0.0, -3.0)), UnstableGainError, "negative real part"),
        (lambda: poles(P, (-1.0 + 2.0j, -3.0)), GainError, "conjugate pair"),
        (lambda: poles(P, (-1.0 + 2.0j, -3.0 - 2.0j)), GainError, "conjugate pair"),
        (lambda: poles(P, (-1.0,)), GainError, "two finite numbers"),
        (lambda: poles(P, (-1.0, math.nan)), GainError, "two finite numbers"),
        (lambda: poles(P, (-1.0 + 700.0j, -1.0 - 700.0j)), GainError, "smaller dt"),
        (lambda: lqr(P, (1.0, -1.0), 1.0), GainError, "not negative"),
        (lambda: lqr(P, (1.0, math.inf), 1.0), GainError, "finite weights"),
        (lambda: lqr(P, (1.0, 1.0), 0.0), GainError, "r must be a positive"),
        (lambda: lqr(P, (1.0, 1.0), math.nan), GainError, "r must be a positive"),
        (lambda: Gain(F=np.full((2, 4), math.nan), name="n"), GainError, "gain 'n': F must be a finite"),
        (lambda: Gain(F=np.zeros((4, 2)), name="n"), GainError, "gain 'n': F must be a finite"),
    ],
)
def test_what_cannot_be_a_gain_is_refused_in_words(make, error, says) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(error, match=says) as caught:
        make()
    assert isinstance(caught.value, OkiagariError)
    assert "\n" not in str(caught.value)


def test_F_is_a_read_only_copy() -> None:
    F = np.array(dcm(P, 1.5).F)
    gain = Gain(F=F, name="copy")
    F[0, 0] = 9.0
    assert gain.F[0, 0] == -1.5
    with pytest.raises(ValueError, match="read-only"):
        gain.F[0, 0] = 1.0
