from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.footholds import StepLimits
from controllers.gains import Gain, dcm, lqr
from controllers.gait_program import PlanningError
from controllers.linear_program import LinearProgram, chebyshev_centre
from controllers.moa import regulator_set
from controllers.parametric import EmptyParametricError, parametric_set
from controllers.parametric_rows import parametric_rows
from controllers.parametric_set import ParametricError, ParametricSet
from controllers.pendulum import Pendulum
from controllers.support import Foot
from controllers.tracking_sets import tracking_sets
from models.arena import Side

OMEGA = math.sqrt(9.81 / 0.26)
PENDULUM = Pendulum(OMEGA, 0.005)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
LIMITS = StepLimits(max_stride=0.16, min_width=0.075, max_width=0.2, stance_width=0.084, swing_speed=2.0)
GAINS = {"dcm": dcm(PENDULUM, 1.5), "lqr": lqr(PENDULUM, (1.0, 0.0), 1.0)}
SEQUENCES: list[tuple[Side, ...]] = [(), ("left",), ("right", "left")]
MARGIN = 0.002
# The solver keeps the rows to 1e-9; multipliers of the order of ten carry that into the slack.
SOLVER = 1e-7


def standing(ahead: float = 0.0, turn: float = 0.0) -> dict[Side, Foot]:
    return {
        "left": Foot(position=np.array([ahead, 0.042]), yaw=turn, sole=SOLE),
        "right": Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=SOLE),
    }


def built(gain: Gain, swing: tuple[Side, ...], feet: dict[Side, Foot]) -> ParametricSet:
    return parametric_set(PENDULUM, gain, feet, swing, 0.25, LIMITS, margin=MARGIN)


def draw(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.normal(size=(count, 4)) * [0.02, 0.25, 0.02, 0.15]


def member_by_simulation(gain: Gain, sets: ParametricSet, x: np.ndarray, xi: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Whether one left step of level feet, from (n, 4), (n, 4), (n, 2), keeps every promise; told without rows."""
    n, half = len(x), np.array([0.0495, 0.036])
    right, left = np.array([0.0, -0.042]), np.array([0.0, 0.042])
    start = np.stack((xi[:, 0::2] + xi[:, 1::2] / OMEGA, xi[:, 0::2] - xi[:, 1::2] / OMEGA), axis=1)
    knots = sets.law.constant + sets.law.by_state @ start + sets.law.by_foothold @ p[:, None, :]
    ok = (np.abs(p[:, 0]) <= 0.16) & (p[:, 1] + 0.042 >= 0.075) & (p[:, 1] + 0.042 <= 0.2)
    for angle in np.arange(8) * math.pi / 4:  # the circle of the swing speed, by its octagon
        ok &= (p - left) @ [math.cos(angle), math.sin(angle)] <= 2.0 * 0.25 * math.cos(math.pi / 8)
    end = 0.5 * (right + p)
    elapsed, begin = 0, 50
    for j, ticks in enumerate(sets.shape.knots):
        into = (elapsed - begin + 0.5 * ticks) / 120  # settling takes 0.6 s of 5 ms
        alpha = 0.0 if elapsed < begin else float(np.interp(into, (0.4, 0.7), (1.0, 0.5)))
        base = (1.0 - alpha) * right + alpha * p
        ok &= (half - np.abs(knots[:, j] - base) >= MARGIN).all(axis=1)
        for _ in range(ticks):
            u = knots[:, j] - (x - xi) @ gain.F.T
            ok &= (np.abs(u - base) <= half).all(axis=1)
            x, xi = x @ PENDULUM.A.T + u @ PENDULUM.B.T, xi @ PENDULUM.A.T + knots[:, j] @ PENDULUM.B.T
        elapsed += ticks
    rest = np.zeros((n, 4))
    rest[:, 0::2] = end
    # (26) run open loop for 0.85 s amplifies rounding 200-fold; rays reach xi_0 of tens of metres.
    np.testing.assert_allclose(xi, rest, rtol=0, atol=1e-8)
    for _ in range(600):
        u = end - (x - rest) @ gain.F.T
        ok &= (np.abs(u - end) <= half).all(axis=1)
        x = x @ PENDULUM.A.T + u @ PENDULUM.B.T
    return ok


@pytest.mark.parametrize("name", GAINS)
def test_membership_is_what_the_closed_loop_does_up_to_a_millionth_of_the_boundary(name: str) -> None:
    gain, rng = GAINS[name], np.random.default_rng(7)
    sets = built(gain, ("left",), standing())
    rows = sets.rows
    S = np.column_stack((rows.of_error, rows.of_start - rows.of_error, rows.of_feet))
    a = rows.a - rows.of_margin * MARGIN
    middle, radius = chebyshev_centre(S, a)
    assert radius > 1e-3
    # Directions in which the error is as large as the rest, so that each kind of row is met.
    directions = rng.normal(size=(5500, 10)) * [0.02, 0.1, 0.02, 0.1, 0.02, 0.1, 0.02, 0.1, 0.05, 0.05]
    directions[::2, :4] = directions[::2, 4:8] + 0.5 * directions[::2, :4]
    usage = directions @ S.T / (a - S @ middle)
    reach = 1.0 / usage.max(axis=1)
    for factor, expected in ((1.0 - 1e-6, True), (1.0 + 1e-6, False)):
        z = middle + factor * reach[:, None] * directions
        found = member_by_simulation(gain, sets, z[:, :4], z[:, 4:8], z[:, 8:])
        assert (found == expected).all(), np.flatnonzero(found != expected)
    kinds = np.unique(np.column_stack((rows.of_slack, rows.of_margin))[usage.argmax(axis=1)], axis=0)
    assert len(kinds) == 3, "tracked ZMP, referential ZMP and reach must each limit some rays"


@pytest.mark.parametrize("name", GAINS)
@pytest.mark.parametrize("swing", SEQUENCES)
@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_best_reference_has_the_state_in_its_tracking_set(name: str, swing: tuple[Side, ...], turn: float) -> None:
    gain, feet = GAINS[name], standing(0.3 * turn, turn)
    sets = built(gain, swing, feet)
    every = parametric_rows(PENDULUM, gain, sets.terminal, sets.shape, sets.law)
    unit = np.array([1.0, OMEGA, 1.0, OMEGA])
    matrix = np.column_stack((every.of_slack, (every.of_start - every.of_error) * unit, every.of_feet))
    caught = 0
    for x in draw(np.random.default_rng(3), 12 if name == "dcm" else 6):
        best = sets.best(x)
        assert best.slack == pytest.approx(sets.slack(x), abs=SOLVER)  # warm start
        bound = every.a - every.of_margin * MARGIN - every.of_error @ x
        largest = LinearProgram(matrix, bound).maximise(np.eye(matrix.shape[1])[0])[0]
        # DAQP's nearness term may cost this much of the largest slack, a hundredth of a millimetre.
        assert largest - 1e-5 <= best.slack <= largest + SOLVER
        if best.slack < 0.0:
            continue
        caught += 1
        plan = sets.plan(best)
        assert plan.slack >= MARGIN - SOLVER
        final = plan.reference.final
        terminal = regulator_set(PENDULUM, gain, final, plan.reference.xi[-1, 0::2])
        tracking = tracking_sets(PENDULUM, gain, plan.reference, terminal)
        # The true final support is wider than the combination of the feet, so never less slack.
        assert tracking.slack(0, x) >= best.slack - SOLVER
    assert caught > 0


@pytest.mark.parametrize("swing", SEQUENCES)
@pytest.mark.parametrize("turn", [0.0, 0.2])
def test_plain_rows_say_what_the_program_says(swing: tuple[Side, ...], turn: float) -> None:
    sets = built(GAINS["dcm"], swing, standing(0.3 * turn, turn))
    x = draw(np.random.default_rng(5), 1500)
    slack = np.array([sets.slack(state) for state in x])
    plain = sets.explicit.slack(x)
    clear = np.abs(slack) > 1e-5  # the nearness term of the program, as above
    np.testing.assert_array_equal((plain >= 0.0)[clear], (slack >= 0.0)[clear])
    np.testing.assert_allclose(plain[slack >= 0.0], slack[slack >= 0.0], rtol=0, atol=1e-5)
    assert 100 < (slack >= 0.0).sum() < 1400


@pytest.mark.parametrize("name", GAINS)
def test_slice_is_where_the_slack_is(name: str) -> None:
    sets, at, box = built(GAINS[name], ("left",), standing()), np.array([0.0, 0.0, 0.005, 0.05]), (0.1, 2.0)
    vertices = sets.slice_polygon((0, 1), at, box, accuracy=1e-7)
    seen, outside = vertices.mean(axis=0), 0
    for border in (*vertices, *(0.5 * (vertices + np.roll(vertices, -1, axis=0)))):
        inner, outer = at.copy(), at.copy()
        inner[:2], outer[:2] = seen + (1.0 - 1e-3) * (border - seen), seen + (1.0 + 1e-3) * (border - seen)
        assert sets.slack(inner) >= 0.0
        if (np.abs(outer[:2]) <= box).all():
            outside += 1
            assert sets.slack(outer) < 0.0
    assert outside >= 2
    assert sets.slice_polygon((0, 1), np.array([0.0, 0.0, 0.0, 5.0]), box).shape == (0, 2)


def test_one_step_approaches_the_limit_of_koolen() -> None:
    # d_1 = r + (l + d_0 - r) e^{-wT} with d_0 = r, from rest over the middle of the feet.
    for step_time in (0.2, 0.3):
        koolen = OMEGA * (0.0495 + 0.16 * math.exp(-OMEGA * step_time))
        sets = parametric_set(PENDULUM, GAINS["dcm"], standing(), ("left",), step_time, LIMITS)
        assert sets.contains(np.array([0.0, 0.95 * koolen, 0.0, 0.0]))
        assert not sets.contains(np.array([0.0, koolen, 0.0, 0.0]))


def test_bad_input_is_refused_with_advice() -> None:
    sets = built(GAINS["dcm"], ("left",), standing())
    assert math.isnan(sets.slack(np.full(4, math.nan)))
    assert not sets.contains(np.full(4, math.nan))
    with pytest.raises(ParametricError, match="finite state"):
        sets.best(np.array([0.0, math.inf, 0.0, 0.0]))
    for axes, at, box in (((0, 0), np.zeros(4), (0.1, 1.0)), ((0, 1), np.zeros(3), (0.1, 1.0))):
        with pytest.raises(ParametricError, match="slice needs"):
            sets.slice_polygon(axes, at, box)
    with pytest.raises(ParametricError, match="positive box"):
        sets.slice_polygon((0, 1), np.zeros(4), (0.1, -1.0))
    with pytest.raises(ParametricError, match="only with DCM gains"):
        _ = built(GAINS["lqr"], ("left",), standing()).explicit
    with pytest.raises(EmptyParametricError, match=r"at most 0\.036 m"):
        parametric_set(PENDULUM, GAINS["dcm"], standing(), ("left",), 0.25, LIMITS, margin=0.05)
    with pytest.raises(ParametricError, match="margin must be"):
        parametric_set(PENDULUM, GAINS["dcm"], standing(), ("left",), 0.25, LIMITS, margin=math.nan)
    with pytest.raises(ParametricError, match="settling time"):
        parametric_set(PENDULUM, GAINS["dcm"], standing(), ("left",), 0.25, LIMITS, settle_time=0.02)
    with pytest.raises(PlanningError, match="alternate"):
        parametric_set(PENDULUM, GAINS["dcm"], standing(), ("left", "left"), 0.25, LIMITS)
