"""Steps are begun for a state that a set holds, if there is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controllers.stepping.contact_state import EDGE, ContactState
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_executor import JUST_LANDED, Stepper
from tests.controllers.sight import seen
from tests.controllers.stepping.test_step_policy import GAIN_K, OPTIONS, PENDULUM, ROBOT

HALF = 0.5 * ROBOT.stance_width
SIGHT = seen((0.0, HALF), (0.0, -HALF))


@pytest.fixture(scope="module")
def rule() -> SetPolicy:
    return SetPolicy(ROBOT, PENDULUM, OPTIONS, GAIN_K)


def standing() -> ContactState:
    contacts = ContactState(ROBOT.sole_vertices["left"], EDGE)
    contacts.see(SIGHT)
    return contacts


def test_a_step_is_chosen_for_the_state_ahead(rule: SetPolicy) -> None:
    here, ahead = np.zeros(2), np.array([0.0, 0.1])
    lift = Stepper(ROBOT, PENDULUM, OPTIONS, rule).lift_off(SIGHT, here, ahead, standing())
    assert lift == rule.lift(ahead, standing().positions, standing().heading, ("left", "right"))
    assert lift.slack >= 0.0


def test_a_state_ahead_that_nothing_holds_is_not_stepped_for(rule: SetPolicy) -> None:
    here, lost = np.array([0.0, 0.08]), np.array([0.0, 1.0])
    feet, heading = standing().positions, standing().heading
    assert rule.lift(lost, feet, heading, ("left", "right")).slack < 0.0
    lift = Stepper(ROBOT, PENDULUM, OPTIONS, rule).lift_off(SIGHT, here, lost, standing())
    assert lift == rule.lift(here, feet, heading, ("left", "right"))
    assert lift.slack >= 0.0


def test_the_foot_that_has_just_landed_stays(rule: SetPolicy) -> None:
    stepper, contacts, ahead = Stepper(ROBOT, PENDULUM, OPTIONS, rule), standing(), np.array([0.1, 0.0])
    side = stepper.lift_off(SIGHT, ahead, ahead, contacts).side
    assert stepper.swing_step is not None
    stepper.swing_step.left = 0
    assert stepper.land(SIGHT)
    other = {"left": "right", "right": "left"}[side]
    assert list(stepper.sides(0.99 * JUST_LANDED)) == [other]
    assert set(stepper.sides(1.01 * JUST_LANDED)) == {"left", "right"}
    later = replace(SIGHT, time=0.5 * JUST_LANDED)
    assert stepper.lift_off(later, ahead, ahead, contacts).side == other


def test_a_flight_remembers_where_it_was_when_the_tick_began(rule: SetPolicy) -> None:
    """What is predicted of a state is asked with the foot and the time left of its own tick."""
    stepper, ahead = Stepper(ROBOT, PENDULUM, OPTIONS, rule), np.array([0.1, 0.0])
    stepper.lift_off(SIGHT, ahead, ahead, standing())
    swing_step = stepper.swing_step
    assert swing_step is not None
    for _ in range(20):
        at, left = swing_step.foot.position[:2], swing_step.left
        swing_step.advance(PENDULUM.dt)
        assert swing_step.before[0] == pytest.approx(at, abs=0.0)
        assert swing_step.before[1] == left == swing_step.left + 1
    assert np.linalg.norm(swing_step.foot.position[:2] - swing_step.before[0]) > 1e-4
