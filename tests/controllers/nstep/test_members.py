"""What the N-step sets promise: their members recover in closed loop, whatever is beyond them does not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_sets import step_sets
from models.robot import other
from tests.controllers.nstep.stepping_plane import (
    LIMITS,
    PENDULUM,
    best_by_program,
    best_of_sequences,
    draw,
    recovers,
    rim,
    stands,
)
from tests.controllers.nstep.stepping_sets import LIFTING, NOMINAL, ROBUST, SETS, SOLVER, WITHSTANDING


@pytest.mark.parametrize("name", SETS)
def test_from_every_member_re_planning_each_tick_recovers(name: str) -> None:
    rng, sets = np.random.default_rng(5), SETS[name]
    for margin in (0.0, 0.01, 0.05) * 5:
        steps, stance, ticks, swing, time = draw(sets, rng)
        inside = float(rng.choice([1e-6, 1e-3]))
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, inside)
        assert sets.slacks(dcm, stance, ticks * PENDULUM.dt, swing, time)[steps - 1] >= inside - 1e-12
        assert recovers(sets, steps, stance, ticks, swing, dcm, time, margin) >= -SOLVER


def test_from_outside_no_sequence_of_footholds_and_zmps_recovers() -> None:
    rng = np.random.default_rng(6)
    near = 0
    for _ in range(25):
        question = draw(NOMINAL, rng)
        steps, stance, ticks, swing, time = question
        outside = float(rng.choice([1e-6, 1e-3]))
        polygon = NOMINAL.polygon(steps, stance, ticks * PENDULUM.dt, swing, step_time=time)
        dcm = rim(NOMINAL, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, -outside)
        normal = polygon.S[np.argmin(polygon.a - polygon.S @ dcm)]
        best = best_of_sequences(NOMINAL, question, dcm, rng, 240, normal)
        grown = outside * math.exp(PENDULUM.omega * PENDULUM.dt * (ticks + (steps - 1) * round(time / PENDULUM.dt)))
        # The distance to the line only grows; of the regulator's set no row is more than twice as far as the line.
        assert best < -0.4 * grown
        near += best > -1.001 * grown
    # The extremes are nearly enough for many of them: the sets are not larger than they need be, nor smaller.
    assert near >= 5


@pytest.mark.parametrize("name", SETS)
def test_one_program_over_all_zmps_and_footholds_agrees(name: str) -> None:
    rng, sets = np.random.default_rng(7), SETS[name]
    for inside in (1e-6, 1e-3, -1e-6, -1e-3) * 6:
        steps, stance, ticks, swing, time = draw(sets, rng)
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, inside)
        assert (best_by_program(sets, (steps, stance, ticks, swing, time), dcm) > 0.0) == (inside > 0.0)


def test_steps_decided_at_their_lift_off_recover_from_every_member_for_feet_with_inertia() -> None:
    rng, sets = np.random.default_rng(10), LIFTING
    most, far = sets.limits.swing_acceleration, 0
    for _ in range(20):
        steps, stance, _, swing, time = draw(sets, rng)
        _, more = sets.boxes(stance, 0, None, time)
        swing, ticks, place, worst = np.clip(swing, *more), round(time / PENDULUM.dt), np.zeros(2), math.inf
        x = np.zeros(4)
        x[1::2] = PENDULUM.omega * rim(sets, (steps, stance, time, swing, time), rng, 1e-6)
        for left in range(steps, 0, -1):
            step = choose_foothold(
                sets, PENDULUM.dcm(x) - place, stance, time, swing, time, left, toward=swing, margin=0.0
            )
            # A quarter of a T^2: half of the time it speeds up, half of it brakes.
            way = np.abs(step.position - swing).max() / (0.25 * most * time**2)
            assert way <= 1.0 + SOLVER
            far += way > 0.99
            for _ in range(ticks):
                worst = min(worst, sets.sole.slack(step.zmp))
                x = PENDULUM.step(x, place + step.zmp)
            place, swing, stance = place + step.position, -step.position, other(stance)
        assert min(worst, stands(sets, x, place, swing)) >= -SOLVER
    assert far >= 5


def test_one_program_agrees_for_feet_with_inertia() -> None:
    """On the sets of this reach; that the reach is right is for the test above."""
    rng = np.random.default_rng(11)
    for inside in (1e-6, 1e-3, -1e-6, -1e-3) * 6:
        steps, stance, _, swing, time = draw(LIFTING, rng)
        dcm = rim(LIFTING, (steps, stance, time, swing, time), rng, inside)
        ticks = round(time / PENDULUM.dt)
        assert (best_by_program(LIFTING, (steps, stance, ticks, swing, time), dcm) > 0.0) == (inside > 0.0)


@pytest.mark.parametrize("name", WITHSTANDING)
def test_members_withstand_the_error_of_the_zmp(name: str) -> None:
    rng, sets = np.random.default_rng(8), WITHSTANDING[name]
    w_bar = sets.error.w_bar
    for trial in range(15):
        steps, stance, ticks, swing, time = draw(sets, rng)
        dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
        lasting = w_bar * rng.choice([-1.0, 1.0], 2)

        def errors(lasting: np.ndarray = lasting, trial: int = trial) -> np.ndarray:
            return lasting if trial % 2 else w_bar * rng.choice([-1.0, 1.0], 2)

        assert recovers(sets, steps, stance, ticks, swing, dcm, time, errors=errors) >= -SOLVER


def test_members_on_the_rim_do_not_withstand_twice_the_error() -> None:
    rng, lost = np.random.default_rng(9), 0
    for _ in range(20):
        steps, stance, ticks, swing, time = draw(ROBUST, rng)
        dcm = rim(ROBUST, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
        away = 2.0 * ROBUST.error.w_bar * -np.sign(dcm - 0.5 * swing)
        lost += recovers(ROBUST, steps, stance, ticks, swing, dcm, time, errors=lambda away=away: away) < -1e-4
    assert lost >= 5


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    gain_k=st.floats(1.05, 4.0),
    half=st.tuples(st.floats(0.02, 0.1), st.floats(0.015, 0.06)),
    stride=st.floats(0.0, 0.4),
    widths=st.tuples(st.floats(0.04, 0.1), st.floats(0.0, 0.2)),
    speed=st.floats(0.3, 6.0),
    share=st.floats(0.0, 0.9),
    seed=st.integers(0, 2**32 - 1),
)
# Feet that only go sideways: the last foothold has a box of no width.
@example(gain_k=2.0, half=(0.0625, 0.0234375), stride=0.0, widths=(0.0625, 0.125), speed=1.0, share=0.0, seed=54)
def test_any_stepper_recovers_from_its_members(
    gain_k: float,
    half: tuple[float, float],
    stride: float,
    widths: tuple[float, float],
    speed: float,
    share: float,
    seed: int,
) -> None:
    narrow = max(widths[0], 2.0 * half[1])
    limits = replace(
        LIMITS,
        max_stride=stride,
        min_width=narrow,
        stance_width=narrow,
        max_width=narrow + widths[1],
        swing_speed=speed,
    )
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) * half
    error = share * min(half) / (1.0 + gain_k / (gain_k - 1.0))
    sets = step_sets(PENDULUM, gain_k, corners, limits, (0.15,), 3, zmp_error=error)
    rng = np.random.default_rng(seed)
    steps, stance, ticks, swing, time = draw(sets, rng)
    # A foot that is not too far out to get back to where any next step can follow.
    _, more = sets.boxes(stance, ticks, None, time)
    swing = np.clip(swing, *more)
    dcm = rim(sets, (steps, stance, ticks * PENDULUM.dt, swing, time), rng, 1e-6)
    worst = recovers(sets, steps, stance, ticks, swing, dcm, time, errors=lambda: error * rng.choice([-1.0, 1.0], 2))
    assert worst >= -SOLVER
