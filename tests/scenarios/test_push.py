"""A push's samples must hold its impulse whatever the step, or every size in every result is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.push import Push

MASS = 5.5


@given(
    start=st.floats(0, 20),
    duration=st.floats(1e-4, 2) | st.just(1e-4),
    direction=st.floats(-720, 720),
    size=st.floats(1e-3, 1e3),
    shape=st.sampled_from(["rectangular", "half_sine"]),
    dt=st.sampled_from([1e-3, 5e-4, 2e-3, 1 / 300]),
)
def test_samples_hold_the_impulse_whatever_the_step(
    start: float, duration: float, direction: float, size: float, shape: str, dt: float
) -> None:
    push = Push(start=start, duration=duration, direction=direction, impulse=size, shape=shape)
    first, forces = push.samples(dt, MASS)
    # 2000 additions of numbers of the size of the impulse: 2000 * 1.1e-16 at worst.
    np.testing.assert_allclose(forces.sum(axis=0) * dt, push.impulse_vector(MASS), rtol=0, atol=1e-12 * size)
    # No sample lies outside of the push but for the rounding that `snap` forgives.
    assert first * dt <= start + 1e-6
    assert start - dt <= first * dt + 1e-6
    assert push.end <= (first + len(forces)) * dt + 1e-6
    assert (first + len(forces)) * dt <= push.end + dt + 1e-6


def test_rectangular_push_in_whole_steps_is_one_constant_force() -> None:
    first, forces = Push(start=0.3, duration=0.1, direction=0, impulse=2.0).samples(0.001, MASS)
    assert (first, len(forces)) == (300, 100)  # 0.3 / 0.001 is 299.99... in floating point
    # A time of 0.3 s is known to 6e-17 s, 6e-14 of a step.
    np.testing.assert_allclose(forces, [[20.0, 0.0, 0.0]] * 100, rtol=1e-12)


def test_ends_within_a_step_get_their_share() -> None:
    _, forces = Push(start=0.00025, duration=0.001, direction=0, impulse=1.0).samples(0.001, MASS)
    np.testing.assert_allclose(forces[:, 0], [750.0, 250.0], rtol=1e-12)


@pytest.mark.parametrize("start", [3.0, 3.0 - 4e-16, 3599.9999, 2999.9999999])
def test_the_shortest_push_is_not_lost_late_in_an_hour(start: float) -> None:
    push = Push(start=start, duration=1e-4, direction=0, impulse=1.0)
    for dt in (1e-4, 1e-3, 0.01):
        _, forces = push.samples(dt, MASS)
        # One or two samples: their sum is rounded once.
        assert forces[:, 0].sum() * dt == pytest.approx(1.0, rel=1e-15)


def test_half_sine_samples_are_the_means_of_the_sine() -> None:
    push = Push(start=0.0, duration=0.1, direction=90, impulse=1.0, shape="half_sine")
    _, forces = push.samples(0.001, MASS)
    middle = (np.arange(100) + 0.5) * 0.001
    sine = 1.0 * math.pi / (2 * 0.1) * np.sin(math.pi * middle / 0.1)
    # The mean over a step differs from the value in its middle by (pi dt / T)^2 / 24 = 4e-5 of it.
    np.testing.assert_allclose(forces[:, 1], sine, rtol=5e-5)


def test_delta_v_is_the_impulse_over_the_mass() -> None:
    push = Push(start=0, direction=180, delta_v=0.4)
    np.testing.assert_allclose(push.impulse_vector(MASS), [-0.4 * MASS, 0, 0], rtol=1e-15, atol=0)


@pytest.mark.parametrize(
    ("direction", "unit"), [(0, (1, 0)), (90, (0, 1)), (180, (-1, 0)), (270, (0, -1)), (-90, (0, -1)), (360, (1, 0))]
)
def test_a_push_along_an_axis_has_nothing_across_it(direction: float, unit: tuple[int, int]) -> None:
    push = Push(start=0, direction=direction, impulse=1)
    assert tuple(push.unit) == (*unit, 0)


@given(direction=st.floats(-720, 720))
def test_direction_is_counted_from_forward_to_left(direction: float) -> None:
    push = Push(start=0, direction=direction, impulse=1)
    angle = math.radians(direction)
    # cos and sin of up to 720 degrees in radians, rounded once more: a few 1e-16 times 13 rad.
    np.testing.assert_allclose(push.unit, [math.cos(angle), math.sin(angle), 0], rtol=0, atol=1e-14)
    assert math.remainder(push.direction_deg - direction, 360) == pytest.approx(0, abs=1e-9)


def test_length_of_the_vector_does_not_matter() -> None:
    short, long = (Push(start=0, vector=(3e-200 * s, 4e-200 * s, 0.0), impulse=1) for s in (1, 1e300))
    np.testing.assert_allclose(short.unit, [0.6, 0.8, 0], rtol=1e-15)
    np.testing.assert_allclose(long.unit, [0.6, 0.8, 0], rtol=1e-15)
    assert short.direction_deg == pytest.approx(53.13, abs=0.01)
