"""A foot's way through the air, steered from where it is seen."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.stepping.feedback_swing import MOST_ACCELERATION, SHORTEST, FeedbackSwing
from controllers.stepping.swing import LANDING_SPEED, SEARCH_SPEED

DT, DURATION, HEIGHT = 0.001, 0.3, 0.03
START, GOAL = np.array([0.0, 0.042, 0.0]), np.array([0.12, 0.05])


def fly(share: float = 1.0, ticks: int = round(DURATION / DT), duration: float = DURATION) -> list:
    """References of a foot whose legs give a share of the acceleration that is asked for."""
    foot, position, velocity, path = FeedbackSwing(START, 0.1, duration, HEIGHT, DT), START.copy(), np.zeros(3), []
    for k in range(ticks):
        if k:
            foot.see(position)
        path.append(foot.advance(GOAL, max(duration - k * DT, 0.0)))
        acceleration = share * path[-1].acceleration
        position = position + (velocity + 0.5 * DT * acceleration) * DT
        velocity = velocity + acceleration * DT
    return path


def test_with_legs_that_follow_it_is_the_cubic_of_least_acceleration() -> None:
    path = np.array([reference.position for reference in fly()])
    # Steered anew at every tick and held over it, the way lags by half a tick: 0.5 ms at up to 1.5 GOAL / DURATION.
    phase = (np.arange(1, len(path) + 1) * DT / DURATION)[: -round(SHORTEST / DT)]
    cubic = START[:2] + np.outer(3 * phase**2 - 2 * phase**3, GOAL - START[:2])
    assert path[: len(phase), :2] == pytest.approx(cubic, abs=1e-3)


def test_it_lands_near_the_foothold_on_the_floor_and_in_time() -> None:
    path = fly()
    # The last 30 ms are steered as if they were always left: 3 mm are not made up for.
    assert path[-1].position[:2] == pytest.approx(GOAL, abs=3e-3)
    assert path[-1].position[2] == pytest.approx(0.0, abs=3e-3)
    assert LANDING_SPEED * 1.5 < path[-1].velocity[2] < 0.0
    assert max(reference.position[2] for reference in path) == pytest.approx(HEIGHT, abs=2e-3)
    assert all(reference.feedback and not reference.stance and reference.yaw == 0.1 for reference in path)


def test_a_foot_that_is_held_is_asked_for_what_the_rest_of_its_way_takes() -> None:
    for k, reference in enumerate(fly(share=0.0)):
        needed = 6.0 * (GOAL - START[:2]) / max(DURATION - k * DT, SHORTEST) ** 2
        assert reference.acceleration[:2] == pytest.approx(needed.clip(-MOST_ACCELERATION, MOST_ACCELERATION), rel=1e-9)


def test_legs_of_half_the_strength_bring_it_most_of_the_way() -> None:
    assert fly(share=0.5)[-1].position[0] > 0.8 * GOAL[0]


def test_no_way_asks_for_more_than_the_most() -> None:
    short = fly(duration=0.06, ticks=60)
    asked = np.array([reference.acceleration for reference in short])
    assert np.abs(asked).max() == MOST_ACCELERATION
    assert MOST_ACCELERATION < 6.0 * 0.12 / 0.06**2  # which is what it would take


def test_a_late_step_looks_for_the_floor() -> None:
    path = fly(ticks=round(DURATION / DT) + 200)
    assert path[-1].velocity[2] == pytest.approx(SEARCH_SPEED, abs=1e-3)  # e^(-200 / 30) of the difference is left
    assert path[-1].position[2] < -0.01
    assert path[-1].position[:2] == pytest.approx(GOAL, abs=1e-4)
