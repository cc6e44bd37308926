from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.admissible.delay import DelayedSet, delayed_set
from controllers.admissible.gain_bank import GainBank, gain_bank
from controllers.admissible.limits import (
    LimitError,
    capturability_steps,
    no_step_limit,
    recoverable_delta_v,
)
from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.tracking_sets import tracking_sets
from controllers.gains import dcm
from controllers.geometry.polytope import Polytope
from tests.controllers.stances import GAINS, PENDULUM, STANCES, walk

REACH, STEP = 0.055, 0.1


def capturability(reach: float, step: float, step_time: float, steps: int) -> float:
    """Koolen's d_N [m] in closed form: d_inf + (r - d_inf) e^{-N omega T}."""
    shrink = math.exp(-PENDULUM.omega * step_time)
    last = reach + step * shrink / (1.0 - shrink)
    return last + (reach - last) * shrink**steps


def ratio(region: MoaSet | DelayedSet | GainBank, direction: float) -> float:
    """Share of the limit without a step."""
    limit = no_step_limit(region.pendulum, region.polygon, direction, region.centre)
    return recoverable_delta_v(region, direction) / limit


@pytest.mark.parametrize("step_time", [0.2, 0.3, 0.5])
def test_capturability_by_recursion_and_in_closed_form(step_time: float) -> None:
    steps = capturability_steps(PENDULUM, REACH, STEP, step_time, 200)
    assert steps[0] == REACH
    np.testing.assert_allclose(steps, [capturability(REACH, STEP, step_time, n) for n in range(201)], rtol=1e-13)


def test_figures_of_a_robot_with_its_cog_at_30_cm() -> None:
    """d_1 / d_0 for steps of 0.5, 0.3, 0.2 s, and without end at 0.2 s, to the digits noted."""
    ratios = [capturability_steps(PENDULUM, REACH, STEP, t, 1)[1] / REACH for t in (0.5, 0.3, 0.2)]
    assert ratios == pytest.approx([1.10, 1.33, 1.58], abs=0.006)
    assert capturability_steps(PENDULUM, REACH, STEP, 0.2, 99)[-1] / REACH == pytest.approx(1.85, abs=0.006)
    assert capturability_steps(PENDULUM, REACH, 0.16, 0.2, 99)[-1] / REACH == pytest.approx(2.4, abs=0.05)


@pytest.mark.parametrize("steps", [0, 1, 3])
def test_the_best_stepper_just_recovers_from_within_d_n(steps: int) -> None:
    """A point mass that keeps the ZMP at the foremost edge and steps as far and as soon as it may."""
    step_time, limit = 0.3, capturability(REACH, STEP, 0.3, steps)
    ticks = round(step_time / PENDULUM.dt)
    for factor, recovers in ((1.0 - 1e-9, True), (1.0 + 1e-9, False)):
        x, foot = np.array([0.0, limit * factor * PENDULUM.omega, 0.0, 0.0]), 0.0
        for _ in range(steps):
            for _ in range(ticks):
                x = PENDULUM.step(x, [foot + REACH, 0.0])
            foot += STEP
        # Standing on the last foot: the DCM is over it, or nothing helps any more.
        assert (PENDULUM.dcm(x)[0] - foot <= REACH) == recovers


def test_no_step_limit_is_where_the_dcm_leaves_the_polygon() -> None:
    for polygon in STANCES.values():
        for angle in np.linspace(0.0, 6.0, 9):
            v = no_step_limit(PENDULUM, polygon, angle)
            way = np.array([math.cos(angle), math.sin(angle)])
            assert polygon.slack(polygon.centre + v / PENDULUM.omega * way) == pytest.approx(0.0, abs=1e-15)
            assert no_step_limit(PENDULUM, polygon, 3.0 * way) == pytest.approx(v)
    # Away from the centre the room is that of the nearer edge.
    assert no_step_limit(PENDULUM, STANCES["box"], 0.0, (0.05, 0.0)) == pytest.approx(PENDULUM.omega * 0.01)


def test_recoverable_velocity_is_the_share_that_theory_gives() -> None:
    polygon = STANCES["box"]
    for k in (1.05, 2.0):
        moa = regulator_set(PENDULUM, dcm(PENDULUM, k), polygon)
        assert [ratio(moa, angle) for angle in (0.0, 1.0, 4.0)] == pytest.approx([1.0 / k] * 3)
    moa = regulator_set(PENDULUM, GAINS["lqr"], polygon)
    assert ratio(moa, 0.0) == pytest.approx(0.177, abs=6e-4)
    assert no_step_limit(PENDULUM, polygon, 0.0) == pytest.approx(PENDULUM.omega * 0.05)
    bank = gain_bank(PENDULUM, [GAINS["lqr"], GAINS["dcm"]], polygon)
    assert recoverable_delta_v(bank, 0.3) == recoverable_delta_v(bank.sets[1], 0.3)
    assert ratio(bank, 0.3) == pytest.approx(1.0 / 1.5)
    late = delayed_set(PENDULUM, GAINS["dcm"], polygon, 2)
    assert ratio(late, 0.0) < 1.0 / 1.5


def test_recoverable_velocity_ends_on_the_boundary_of_any_set() -> None:
    reference = walk()
    terminal = regulator_set(PENDULUM, GAINS["lqr complex"], reference.final, reference.xi[-1, 0::2])
    sets = tracking_sets(PENDULUM, GAINS["lqr complex"], reference, terminal)
    moa = regulator_set(PENDULUM, GAINS["lqr complex"], STANCES["yawed"])
    for angle in (0.0, 0.7, 3.0):
        ray = np.array([0.0, math.cos(angle), 0.0, math.sin(angle)])
        v = recoverable_delta_v(sets, angle, phase=60)
        assert sets.slack(60, reference.xi[60] + v * ray) == pytest.approx(0.0, abs=1e-12)
        v = recoverable_delta_v(moa, angle)
        assert moa.slack(moa.x_C + v * ray) == pytest.approx(0.0, abs=1e-12)
        assert recoverable_delta_v(moa.in_world(), angle, moa.x_C) == pytest.approx(v, rel=1e-12)


def test_a_set_without_an_end_in_a_direction_has_no_largest_push() -> None:
    strip = Polytope(S=np.array([[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]]), a=np.ones(2))
    assert recoverable_delta_v(strip, 0.0, np.zeros(4)) == math.inf


def test_questions_without_an_answer_are_refused() -> None:
    moa = regulator_set(PENDULUM, GAINS["lqr"], STANCES["box"])
    bank = gain_bank(PENDULUM, [GAINS["lqr"]], STANCES["box"])
    far = np.array([1.0, 0.0, 0.0, 0.0])
    for region in (moa, bank, moa.in_world()):
        with pytest.raises(LimitError):
            recoverable_delta_v(region, 0.0, far)
    with pytest.raises(LimitError, match="no centre"):
        recoverable_delta_v(moa.in_world(), 0.0)
    for direction in ((0.0, 0.0), (1.0, 0.0, 0.0), math.nan):
        with pytest.raises(LimitError, match="direction"):
            no_step_limit(PENDULUM, STANCES["box"], direction)
    with pytest.raises(LimitError, match="not over"):
        no_step_limit(PENDULUM, STANCES["box"], 0.0, (1.0, 0.0))
    for arguments in ((-0.1, 0.1, 0.3, 1), (0.1, 0.1, 0.0, 1), (0.1, math.nan, 0.3, 1), (0.1, 0.1, 0.3, -1)):
        with pytest.raises(LimitError):
            capturability_steps(PENDULUM, *arguments)
