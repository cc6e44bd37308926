from __future__ import annotations

import itertools

import numpy as np
import pytest

from controllers.admissible.gain_bank import best_dcm_ratio
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.robust import EmptySetError, ZmpError, required_margin, taken_at_last
from controllers.admissible.tracking_sets import TrackingSets, tracking_sets
from controllers.gains import UnstableGainError, dcm, lqr
from controllers.geometry.support_polygon import SupportPolygon
from tests.controllers.stances import GAINS, PENDULUM, STANCES, walk

ERRORS = {"box": ZmpError.box(0.003), "flat box": ZmpError.box(0.004, 0.001)}
SPREAD = np.array([0.05, 0.3, 0.05, 0.3])
# Sums over hundreds of rows of the closed loop, all below 1 m.
ROUNDING = 1e-11


def worst_errors(moa: MoaSet | TrackingSets, error: ZmpError, normal: np.ndarray, samples: int) -> np.ndarray:
    """Errors (samples + 1, 2) that drive the ZMP farthest along `normal` at the last of these samples."""
    loop, response = moa.gain.closed_loop(moa.pendulum), []
    row = -normal @ moa.gain.F
    for _ in range(samples):
        response.append(row @ moa.pendulum.B)
        row = row @ loop
    return np.sign([*response[::-1], normal]) * error.half_widths


def slack_under(moa: MoaSet, x: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Slack (T, N, q) [m] of each edge for states (N, 4) when the ZMP is off by errors (T, 2)."""
    p, slack = moa.pendulum, []
    for w in errors:
        u = moa.centre - (x - moa.x_C) @ moa.gain.F.T + w
        slack.append(moa.polygon.v - u @ moa.polygon.M.T)
        x = x @ p.A.T + u @ p.B.T
    return np.array(slack)


def on_boundary(moa: MoaSet, n: int, seed: int) -> np.ndarray:
    """Rays (N, 4) from the centre that end on the boundary."""
    rays = np.random.default_rng(seed).normal(size=(n, 4)) * SPREAD
    return rays / ((rays @ moa.S.T) / moa.a).max(axis=1, keepdims=True)


@pytest.mark.parametrize(("gain", "stance", "error"), list(itertools.product(GAINS, ["hexagon", "yawed"], ERRORS)))
def test_extremal_errors_never_push_a_member_out_and_always_push_out_what_is_just_outside(
    gain: str, stance: str, error: str
) -> None:
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES[stance], error=ERRORS[error])
    edge = on_boundary(moa, 60, 1)
    inside, outside = moa.x_C + edge * (1.0 - 1e-6), moa.x_C + edge * (1.0 + 1e-6)
    assert (moa.slacks(inside) >= 0.0).all()
    assert (moa.slacks(outside) < 0.0).all()
    caught = np.zeros(len(edge), dtype=bool)
    # Twice as far as the rows look, so that one that is missing would show.
    for j, normal in enumerate(moa.polygon.M):
        worst = worst_errors(moa, ERRORS[error], normal, 2 * moa.t_star + 20)
        for t in np.linspace(0, len(worst) - 1, 9).astype(int):
            late = slack_under(moa, inside, worst[len(worst) - 1 - t :])
            assert late[-1, :, j].min() >= 0.0
    for i, x in enumerate(outside):
        t, j = moa.tight(x)
        worst = worst_errors(moa, ERRORS[error], moa.polygon.M[j], t)
        least = slack_under(moa, x[None], worst)[-1, 0, j]
        # The slack is exactly the distance that the worst error leaves.
        assert least == pytest.approx(moa.slack(x), abs=ROUNDING)
        caught[i] = least < 0.0
    assert caught.all()


@pytest.mark.parametrize("gain", ["lqr", "dcm"])
def test_random_errors_keep_a_member_inside_for_ever(gain: str) -> None:
    moa = regulator_set(PENDULUM, GAINS[gain], STANCES["hexagon"], error=ERRORS["flat box"])
    x, rng = moa.x_C + on_boundary(moa, 300, 2), np.random.default_rng(3)
    for _ in range(600):
        w = rng.choice([-1.0, 1.0], (len(x), 2)) * ERRORS["flat box"].half_widths
        u = moa.centre - (x - moa.x_C) @ moa.gain.F.T + w
        assert moa.polygon.slacks(u).min() >= -ROUNDING
        x = x @ PENDULUM.A.T + u @ PENDULUM.B.T
        assert moa.slacks(x).min() >= -ROUNDING


def test_share_of_the_limit_left_under_an_error_of_5_mm() -> None:
    """Noted figures, to the last digit noted, for a half-width of 55 mm."""
    box = SupportPolygon(np.array([[-0.055, -0.08], [0.055, -0.08], [0.055, 0.08], [-0.055, 0.08]]))
    shares = {(1.0, 1.0): (0.177, 0.161), (1.0, 0.0): (0.462, 0.420)}
    gains = [(lqr(PENDULUM, q, 1.0), share) for q, share in shares.items()]
    gains += [(dcm(PENDULUM, 1.5), (0.667, 0.606)), (dcm(PENDULUM, 1.2), (0.833, 0.758))]
    for gain, expected in gains:
        for error, share in zip((None, ZmpError.box(0.005)), expected, strict=True):
            moa = regulator_set(PENDULUM, gain, box, error=error)
            pushed = moa.S[:, 1] > 0.0
            largest = (moa.a[pushed] / moa.S[pushed, 1]).min() / (PENDULUM.omega * 0.055)
            assert largest == pytest.approx(share, abs=6e-4), gain.name


def amplification(k: float) -> float:
    """Largest deviation of the ZMP that errors up to 1 build up under a DCM gain."""
    return 1.0 + k / (k - 1.0)


@pytest.mark.parametrize("k", [1.01, 1.1, 1.5, 3.0])
def test_amplification_of_a_dcm_gain(k: float) -> None:
    box = STANCES["box"]
    margin = required_margin(PENDULUM, dcm(PENDULUM, k), box, ZmpError.box(1.0))
    assert margin == pytest.approx(np.abs(box.M).sum(axis=1) * amplification(k), rel=1e-9)


@pytest.mark.parametrize("gain", GAINS)
def test_infinite_sum_is_that_of_a_long_finite_one(gain: str) -> None:
    loop, C = GAINS[gain].closed_loop(PENDULUM), -STANCES["yawed"].M @ GAINS[gain].F
    error, rows, total = ERRORS["flat box"], C, ERRORS["flat box"].support(STANCES["yawed"].M)
    for _ in range(6_000):
        total = total + error.support(rows @ PENDULUM.B)
        rows = rows @ loop
    found = taken_at_last(C, loop, PENDULUM.B, STANCES["yawed"].M, error)
    # From above, but by no more than the tail that is bounded.
    assert (found >= total * (1.0 - 1e-12)).all()
    np.testing.assert_allclose(found, total, rtol=1e-9)


@pytest.mark.parametrize("gain", GAINS)
def test_an_empty_set_names_the_largest_error_that_would_do(gain: str) -> None:
    for shape in (ZmpError.box(0.05), ZmpError.box(0.05, 0.01)):
        with pytest.raises(EmptySetError, match="only below") as caught:
            regulator_set(PENDULUM, GAINS[gain], STANCES["hexagon"], error=shape)
        largest = caught.value.largest
        assert 0.0 < caught.value.w_bar < 0.05
        assert largest.half_widths[1] / largest.half_widths[0] == pytest.approx(
            shape.half_widths[1] / shape.half_widths[0]
        )
        moa = regulator_set(PENDULUM, GAINS[gain], STANCES["hexagon"], error=largest.scaled(0.99))
        assert moa.contains(moa.x_C)
        with pytest.raises(EmptySetError):
            regulator_set(PENDULUM, GAINS[gain], STANCES["hexagon"], error=largest.scaled(1.01))


def test_no_dcm_gain_reaches_farther_under_an_error_than_k_star() -> None:
    c, w = 0.05, 0.004
    box = SupportPolygon(np.array([[-c, -c], [c, -c], [c, c], [-c, c]]))

    def reach(k: float) -> float:
        moa = regulator_set(PENDULUM, dcm(PENDULUM, k), box, error=ZmpError.box(w))
        return float(moa.a[0] / k)

    best = best_dcm_ratio(c, w)
    assert reach(best) == pytest.approx(c - 2.0 * w, rel=1e-12)
    assert all(reach(k) < reach(best) for k in np.linspace(best * 1.001, 3.0, 20))
    with pytest.raises(EmptySetError):
        reach(best * 0.999)


WALK = walk()


@pytest.mark.parametrize("gain", ["lqr", "lqr complex", "dcm"])
@pytest.mark.parametrize("error", ["box", "flat box"])
def test_tracking_sets_are_tight_under_extremal_errors(gain: str, error: str) -> None:
    law, W = GAINS[gain], ERRORS[error]
    terminal = regulator_set(PENDULUM, law, WALK.final, WALK.xi[-1, 0::2], error=W)
    sets = tracking_sets(PENDULUM, law, WALK, terminal)
    assert sets.error == W
    rng = np.random.default_rng(4)
    for k in (0, 70, 390):
        part = sets.polytope(k)
        finite = np.isfinite(part.a)
        rays = rng.normal(size=(40, 4)) * SPREAD
        room = part.a[finite] - part.S[finite] @ WALK.xi[k]
        rays /= ((rays @ part.S[finite].T) / room).max(axis=1, keepdims=True)
        for ray in rays:
            for factor in (1.0 - 1e-6, 1.0 + 1e-6):
                x = WALK.xi[k] + ray * factor
                sample, edge = sets.tight(k, x)
                polygon = WALK.support(sample)
                worst = worst_errors(sets, W, polygon.M[edge], sample - k)
                least = np.inf
                for i, w in enumerate(worst, start=k):
                    mu, xi = (WALK.mu[i], WALK.xi[i]) if i < WALK.m else (terminal.centre, terminal.x_C)
                    u = mu + law.F @ (xi - x) + w
                    least = min(least, WALK.support(i).slack(u))
                    x = PENDULUM.step(x, u)
                # Along the way nothing else is violated inside; outside, the tight row is, by just its slack.
                assert (least >= -1e-12) == (factor < 1.0)
                if factor > 1.0:
                    assert least <= sets.slack(k, WALK.xi[k] + ray * factor) + ROUNDING


def test_dcm_plane_gives_the_robust_sets_of_the_general_recursion() -> None:
    law, W = dcm(PENDULUM, 1.5), ZmpError.box(0.003)
    plain = regulator_set(PENDULUM, law, WALK.final, WALK.xi[-1, 0::2], error=W)
    wide = regulator_set(PENDULUM, law, WALK.final, WALK.xi[-1, 0::2], (50.0, 50.0 * PENDULUM.omega), W)
    plane, general = (tracking_sets(PENDULUM, law, WALK, last) for last in (plain, wide))
    rng = np.random.default_rng(5)
    for k in (0, 80, 250, 400):
        part = general.polytope(k)
        rays = rng.normal(size=(300, 4)) * SPREAD
        rays /= ((rays @ part.S.T) / (part.a - part.S @ WALK.xi[k])).max(axis=1, keepdims=True)
        for factor in (1.0 - 1e-6, 1.0 + 1e-6):
            x = WALK.xi[k] + rays * factor
            for sets in (plane, general):
                assert ((sets.slacks(k, x) >= 0.0) == (factor < 1.0)).all()


def test_a_reference_must_keep_the_amplified_error_as_its_margin() -> None:
    law = GAINS["dcm"]
    margin = required_margin(PENDULUM, law, WALK.supports[0], ZmpError.box(0.003))
    np.testing.assert_allclose(margin, 0.003 * amplification(1.5) * np.abs(WALK.supports[0].M).sum(axis=1), rtol=1e-9)
    # Of each edge, the room that the reference keeps over what an error of 1 m builds up along its normal.
    shares = [
        (polygon.v - polygon.M @ mu) / (amplification(1.5) * np.abs(polygon.M).sum(axis=1))
        for mu, polygon in ((WALK.mu[k], WALK.support(k)) for k in range(WALK.m))
    ]
    fits = 0.999 * float(np.concatenate(shares).min())
    for w, empty in ((fits, False), (fits * 1.002, True)):
        terminal = regulator_set(PENDULUM, law, WALK.final, WALK.xi[-1, 0::2], error=ZmpError.box(w))
        if empty:
            with pytest.raises(EmptySetError, match="reference") as caught:
                tracking_sets(PENDULUM, law, WALK, terminal)
            assert caught.value.w_bar == pytest.approx(fits / 0.999, rel=1e-9)
        else:
            sets = tracking_sets(PENDULUM, law, WALK, terminal)
            assert min(sets.slack(k, WALK.xi[k]) for k in range(WALK.m)) >= 0.0


def test_explain_says_could_and_how_large_the_error_is() -> None:
    moa = regulator_set(PENDULUM, GAINS["lqr"], STANCES["box"], error=ZmpError.box(0.002))
    inside = moa.explain(moa.x_C)
    assert inside.startswith("the ZMP stays inside with the ZMP off by up to 2 mm, tightest at")
    outside = moa.x_C + on_boundary(moa, 1, 6)[0] * 1.02
    assert "could leave through" in moa.explain(outside)
    found = moa.violation(outside)
    assert found is not None
    # With the worst errors it leaves no later than where the set is tightest.
    assert found[0] <= moa.tight(outside)[0]
    terminal = regulator_set(PENDULUM, GAINS["dcm"], WALK.final, WALK.xi[-1, 0::2], error=ZmpError.box(0.002))
    sets = tracking_sets(PENDULUM, GAINS["dcm"], WALK, terminal)
    assert "could leave through the left edge" in sets.explain(60, WALK.xi[60] + [0.0, 0.0, 0.04, 0.0])
    assert "stays inside with the ZMP off by up to 2 mm" in sets.explain(60, WALK.xi[60])
    assert "could leave through the front edge" in sets.explain(WALK.m, WALK.xi[-1] + [0.2, 0.0, 0.0, 0.0])


def test_errors_that_cannot_be_are_refused() -> None:
    for half_widths in ((-0.001, 0.0), (np.nan, 0.0)):
        with pytest.raises(MoaError, match="ZMP error"):
            ZmpError(half_widths=half_widths)
    none = type(GAINS["dcm"])(F=np.zeros((2, 4)), name="none")
    with pytest.raises(UnstableGainError):
        required_margin(PENDULUM, none, STANCES["box"], ZmpError.box(1.0))
