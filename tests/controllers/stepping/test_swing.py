"""A foot's way through the air."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.stepping.swing import LANDING_SPEED, SEARCH_SPEED, SwingFoot

DT, DURATION, HEIGHT = 0.002, 0.25, 0.03


def fly(foothold_at, ticks: int = round(DURATION / DT)) -> list:
    foot = SwingFoot(np.array([0.0, 0.042, 0.0]), 0.1, DURATION, HEIGHT, DT)
    return [foot.advance(foothold_at(k), max(DURATION - k * DT, 0.0)) for k in range(ticks)]


def test_it_lands_on_time_on_the_foothold_at_the_floor() -> None:
    path = fly(lambda k: np.array([0.12, 0.05]))
    assert path[-1].position == pytest.approx([0.12, 0.05, 0.0], abs=1e-4)  # the last 4 ms coast
    assert path[-1].velocity[2] == pytest.approx(LANDING_SPEED, abs=1e-6)
    assert max(reference.position[2] for reference in path) == pytest.approx(HEIGHT, abs=1e-3)
    assert min(reference.position[2] for reference in path) > -1e-9
    assert all(reference.yaw == 0.1 and not reference.stance for reference in path)


def test_it_follows_a_foothold_that_moves_while_it_flies() -> None:
    path = fly(lambda k: np.array([0.06, 0.05]) if k < 60 else np.array([0.12, 0.07]))
    assert path[-1].position[:2] == pytest.approx([0.12, 0.07], abs=1e-4)
    steps = np.diff([reference.position for reference in path], axis=0)
    assert np.abs(steps).max() < 2.0 * DT  # no jump: below 2 m/s throughout


def test_velocity_and_acceleration_are_the_derivatives_of_the_position() -> None:
    path = fly(lambda k: np.array([0.12, 0.05]), ticks=60)
    position = np.array([reference.position for reference in path])
    velocity = np.array([reference.velocity for reference in path])
    acceleration = np.array([reference.acceleration for reference in path])
    middle = slice(5, -5)
    # Central differences of a quintic over 2 ms are off by jerk dt^2 / 6, here below 1 mm/s and 0.2 m/s^2.
    assert np.gradient(position, DT, axis=0)[middle] == pytest.approx(velocity[middle], abs=1e-3)
    assert np.gradient(velocity, DT, axis=0)[middle] == pytest.approx(acceleration[middle], abs=0.2)


def test_a_late_step_looks_for_the_floor() -> None:
    path = fly(lambda k: np.array([0.12, 0.05]), ticks=round(DURATION / DT) + 20)
    assert path[-1].velocity[2] == SEARCH_SPEED
    assert path[-1].position[2] < -0.01
