"""Back to the natural stance: only when it is quiet, only over a sole, and only as far as the legs reach."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from controllers.stepping.contact_state import EDGE, ContactState
from controllers.stepping.stance_recovery import (
    ASTRAY,
    ATTEMPTS,
    GIVE_UP,
    LEAD_SPEED,
    QUIET,
    QUIET_FOR,
    SAFE_TO_LIFT,
    StanceRecovery,
    closing_step,
)
from controllers.stepping.step_policy import Heading
from models.arena import SIDES
from models.robot import Robot, load_robot, other
from tests.controllers.recorded_layer import recorded
from tests.controllers.sight import seen

DT = 0.002


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def staggered(robot: Robot, ahead: float) -> ContactState:
    """The left foot ahead of where it stands by nature."""
    contacts = ContactState(robot.sole_vertices["left"], EDGE)
    half = 0.5 * robot.stance_width
    contacts.see(seen((ahead, half), (0.0, -half)))
    return contacts


def until_word(
    stance_recovery: StanceRecovery, contacts: ContactState, dcm: np.ndarray, start: float, seconds: float
) -> tuple[float, str]:
    """When the stance recovery first has something to say, and what."""
    for time in start + DT * np.arange(round(seconds / DT)):
        if why := stance_recovery.watch(float(time), dcm, contacts, "left"):
            return float(time) - start, why
    return seconds, ""


def test_the_other_foot_closes_up_beside_the_one_that_stays(robot: Robot) -> None:
    for yaw in (0.0, 0.7):
        heading, origin = Heading(yaw), np.array([0.3, -0.1])
        feet = {"right": origin, "left": heading.world(np.array([0.06, robot.stance_width]), origin)}
        plan = closing_step(feet, "left", heading, robot, 1.0, DT)
        assert plan is not None
        assert plan.side == "right"
        assert heading.local(plan.foothold, feet["left"]) == pytest.approx([0.0, -robot.stance_width])
        assert plan.over == pytest.approx(feet["left"])
        # The COG is led from the middle at a steady speed, and waits over the foot.
        assert np.hypot(*(plan.centre(1.2) - plan.start)) == pytest.approx(0.2 * LEAD_SPEED)
        assert plan.centre(9.0) == pytest.approx(plan.over)


@pytest.mark.parametrize("ahead", [0.9 * ASTRAY, 1.0])
def test_feet_that_stand_well_or_out_of_reach_stay(ahead: float, robot: Robot) -> None:
    contacts = staggered(robot, ahead)
    assert closing_step(contacts.positions, "left", contacts.heading, robot, 0.0, DT) is None


def test_soles_too_narrow_to_stand_on_one_stay(robot: Robot) -> None:
    contacts = staggered(robot, 0.06)
    assert closing_step(contacts.positions, "left", contacts.heading, robot, 0.0, DT) is not None
    outline = {side: corners * [1.0, 0.6] for side, corners in robot.sole_vertices.items()}
    narrow = dataclasses.replace(robot, sole_vertices=outline)
    assert closing_step(contacts.positions, "left", contacts.heading, narrow, 0.0, DT) is None


def test_it_is_led_up_to_once_it_was_quiet_for_long_enough(robot: Robot) -> None:
    stance_recovery, contacts = StanceRecovery(robot, DT), staggered(robot, 0.06)
    loud = contacts.middle + np.array([1.01 * QUIET, 0.0])
    assert until_word(stance_recovery, contacts, loud, 0.0, 2.0) == (2.0, "")
    waited, why = until_word(stance_recovery, contacts, contacts.middle, 2.0, 1.0)
    assert QUIET_FOR - DT < waited < QUIET_FOR + 2 * DT
    assert why == "it is quiet: the COG goes over the left foot"
    assert stance_recovery.plan is not None
    inside = 0.5 * robot.sole_width - SAFE_TO_LIFT
    assert stance_recovery.ready(stance_recovery.plan.over - [0.0, 0.99 * inside], contacts.heading)
    assert not stance_recovery.ready(stance_recovery.plan.over - [0.0, 1.01 * inside], contacts.heading)
    stance_recovery.interrupt()
    assert not stance_recovery.ready(contacts.feet["left"].position, contacts.heading)


def test_it_is_given_up_until_the_next_push(robot: Robot) -> None:
    stance_recovery, contacts = StanceRecovery(robot, DT), staggered(robot, 0.06)
    until_word(stance_recovery, contacts, contacts.middle, 0.0, 1.0)
    waited, why = until_word(stance_recovery, contacts, contacts.middle, QUIET_FOR, 3.0)
    assert waited == pytest.approx(GIVE_UP, abs=2 * DT)
    assert why == "the legs do not reach so far: the stance stays"
    assert stance_recovery.plan is None
    assert until_word(stance_recovery, contacts, contacts.middle, 5.0, 1.0) == (1.0, "")
    stance_recovery.renew()
    assert until_word(stance_recovery, contacts, contacts.middle, 6.0, 1.0)[1]


def test_so_many_closing_steps_are_tried(robot: Robot) -> None:
    stance_recovery, contacts = StanceRecovery(robot, DT), staggered(robot, 0.06)
    words = []
    for attempt in range(ATTEMPTS + 1):
        words.append(until_word(stance_recovery, contacts, contacts.middle, float(attempt), 0.9)[1])
        stance_recovery.interrupt()
    assert all(words[:ATTEMPTS])
    assert words[ATTEMPTS] == ""


def test_the_foot_that_stays_keeps_its_yaw_while_the_other_closes_up() -> None:
    push = {"start": 1.0, "direction": 118.5, "delta_v": 0.752355}
    result, ticks = recorded({"seed": 1865007702, "duration": 6.0, "pushes": [push]})
    turned = {
        tick.seen.time: abs(tick.command.feet[side].yaw - tick.seen.feet[side].yaw)
        for tick in ticks
        for side in SIDES
        if tick.command.feet[side].stance and not tick.command.feet[other(side)].stance
    }
    # Turned back to the heading, it made the arms swing by a radian and more, and the robot fell 2 s after the push.
    assert result.outcome.result.value == "recovered"
    closes = [d["time"] for d in result.decisions if "closes up" in d["reason"]]
    assert closes
    quick = [angle for time, angle in turned.items() if time < closes[0]]
    assert max(quick) > 0.1
    slow = [angle for time, angle in turned.items() if closes[0] <= time]
    assert len(slow) > 50
    assert max(slow) == 0.0
