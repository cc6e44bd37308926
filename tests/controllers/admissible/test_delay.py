from __future__ import annotations

import itertools

import numpy as np
import pytest

from controllers.admissible.constraint_programs import determined
from controllers.admissible.delay import DelayedSet, delayed_loop, delayed_set
from controllers.admissible.gilbert_tan import MoaError, NotDeterminedError
from controllers.admissible.moa import CentreOutsideError, regulator_set
from controllers.admissible.robust import EmptySetError, ZmpError
from controllers.gains import Gain, UnstableGainError, dcm, lqr, poles
from controllers.geometry.support_polygon import SupportPolygon
from tests.controllers.stances import GAINS, PENDULUM, STANCES

SPREAD = np.array([0.05, 0.3, 0.05, 0.3])
BOX = SupportPolygon(np.array([[-0.055, -0.08], [0.055, -0.08], [0.055, 0.08], [-0.055, 0.08]]))
COUPLED = Gain(F=dcm(PENDULUM, 1.6).F + np.array([[-0.3, 0.0, 0.02, 0.0], [0.0, 0.0, -0.2, 0.02]]), name="coupled")
LAWS = {**{name: GAINS[name] for name in ("lqr complex", "double pole", "dcm")}, "coupled": COUPLED}


def least_slack(at: DelayedSet, x: np.ndarray, pending: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Least ZMP slack (N,) of states (N, 4) with commands (N, n, 2) under way and errors (T, 2), T samples long."""
    under_way, least = list(pending.transpose(1, 0, 2)), np.full(len(x), np.inf)
    for w in errors:
        under_way.append(at.centre - (x - at.x_C) @ at.gain.F.T)
        u = under_way.pop(0) + w
        least = np.minimum(least, at.polygon.slacks(u))
        x = x @ at.pendulum.A.T + u @ at.pendulum.B.T
    return least


@pytest.mark.parametrize(("gain", "delay"), list(itertools.product(LAWS, [1, 4])))
@pytest.mark.parametrize("stance", ["hexagon", "yawed"])
def test_member_if_and_only_if_the_late_loop_keeps_the_zmp_inside(gain: str, delay: int, stance: str) -> None:
    at = delayed_set(PENDULUM, LAWS[gain], STANCES[stance], delay)
    rng = np.random.default_rng(delay)
    n = 250
    pending = rng.normal(size=(n, delay, 2)) * 0.01
    pending[: n // 2] = 0.0
    z = np.concatenate((rng.normal(size=(n, 4)) * SPREAD, pending.reshape(n, -1)), axis=1)
    z /= ((z @ at.polytope.S.T) / at.polytope.a).max(axis=1, keepdims=True)
    for low, high in ((0.5, 1.5), (1.0 - 1e-6, 1.0 - 1e-6), (1.0 + 1e-6, 1.0 + 1e-6)):
        scaled = z * rng.uniform(low, high, (n, 1))
        x, late = at.x_C + scaled[:, :4], at.centre + scaled[:, 4:].reshape(n, delay, 2)
        slack = np.array([at.slack(*pair) for pair in zip(x, late, strict=True)])
        kept = least_slack(at, x, late, np.zeros((at.t_star + 600, 2))) >= 0.0
        np.testing.assert_array_equal(slack >= 0.0, kept)
        assert 0 < kept.sum() < n or low == high
    assert not kept.any()


@pytest.mark.parametrize("gain", LAWS)
def test_extremal_errors_are_withstood_to_the_last(gain: str) -> None:
    delay, W = 2, ZmpError.box(0.003)
    at = delayed_set(PENDULUM, LAWS[gain], STANCES["hexagon"], delay, error=W)
    loop, drive = delayed_loop(PENDULUM, LAWS[gain], delay)
    z = np.random.default_rng(1).normal(size=(40, 4 + 2 * delay)) * np.concatenate((SPREAD, [0.003] * 2 * delay))
    edges = ((z @ at.polytope.S.T) / at.polytope.a).max(axis=1)
    for ray in z / edges[:, None]:
        for factor in (1.0 - 1e-6, 1.0 + 1e-6):
            scaled = ray * factor
            row = int((at.polytope.a - at.polytope.S @ scaled).argmin())
            normal = at.polygon.M[at.edge[row]]
            seen, response = np.concatenate((np.zeros(4), normal, np.zeros(2 * delay - 2))), []
            for _ in range(at.sample[row]):
                response.append(seen @ drive)
                seen = seen @ loop
            worst = np.sign([*response[::-1], normal]) * W.half_widths
            late = (at.centre + scaled[4:].reshape(delay, 2))[None]
            kept = least_slack(at, (at.x_C + scaled[:4])[None], late, worst)[0] >= 0.0
            assert kept == (factor < 1.0)


def test_share_of_the_limit_under_delay() -> None:
    """Noted figures for 5 ms a sample: the digits as they were noted."""
    cases = {(1.0, 0.0): {1: 0.448, 8: 0.361}, "dcm": {1: 0.926, 8: 0.743}}
    for law, shares in cases.items():
        gain = dcm(PENDULUM, 1.05) if law == "dcm" else lqr(PENDULUM, law, 1.0)
        for delay, share in shares.items():
            rest = delayed_set(PENDULUM, gain, BOX, delay).after_rest()
            pushed = rest.S[:, 1] > 0.0
            largest = (rest.a[pushed] / rest.S[pushed, 1]).min() / (PENDULUM.omega * 0.055)
            assert largest == pytest.approx(share, abs=6e-4)


def test_slice_after_rest_is_the_set_with_the_commands_of_rest() -> None:
    at = delayed_set(PENDULUM, GAINS["lqr complex"], STANCES["yawed"], 3)
    x = at.x_C + np.random.default_rng(2).normal(size=(300, 4)) * SPREAD
    slack = at.after_rest().slack(x)
    for state, expected in zip(x, slack, strict=True):
        assert at.slack(state) == pytest.approx(expected, abs=1e-12)
        assert at.contains(state) == (expected >= 0.0)
        assert at.slack(state, np.tile(at.centre, (3, 1))) == pytest.approx(expected, abs=1e-12)


def test_programs_find_the_samples_that_the_hull_finds() -> None:
    # Without delay both ways of the recursion apply.
    moa = regulator_set(PENDULUM, GAINS["lqr complex"], STANCES["hexagon"])
    C, d = -moa.polygon.M @ moa.gain.F, moa.polygon.v - moa.polygon.M @ moa.centre
    count, stack = determined(C, d, moa.gain.closed_loop(PENDULUM), "lqr", 1_000)
    assert count == moa.t_star + 1
    np.testing.assert_allclose(stack[moa.sample, moa.edge], moa.S, atol=1e-12)


def test_what_cannot_be_is_refused_in_words() -> None:
    gain, box = GAINS["lqr complex"], STANCES["box"]
    with pytest.raises(UnstableGainError, match="delay of 40 samples"):
        delayed_set(PENDULUM, GAINS["lqr"], box, 40)
    for delay in (0, -1, 1.5):
        with pytest.raises(MoaError, match="whole number"):
            delayed_set(PENDULUM, gain, box, delay)  # type: ignore[arg-type]
    with pytest.raises(CentreOutsideError, match="front edge"):
        delayed_set(PENDULUM, gain, box, 2, centre=(0.07, 0.0))
    with pytest.raises(NotDeterminedError, match="within 5 samples"):
        delayed_set(PENDULUM, gain, box, 2, max_samples=5)
    with pytest.raises(EmptySetError) as caught:
        delayed_set(PENDULUM, gain, box, 2, error=ZmpError.box(0.05))
    assert delayed_set(PENDULUM, gain, box, 2, error=ZmpError.box(0.99 * caught.value.w_bar)).slack([0.01, 0, 0, 0])
    with pytest.raises(MoaError, match=r"\(2, 2\)"):
        delayed_set(PENDULUM, gain, box, 2).slack(np.zeros(4), np.zeros((1, 2)))
    assert poles(PENDULUM, (-3.0, -9.0)).axis is not None
