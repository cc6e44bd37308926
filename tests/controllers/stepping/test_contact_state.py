"""Where the feet stand: taken anew when a foot has moved, and of the foot in the air not at all."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.stepping.contact_state import MOVED, ContactState
from tests.controllers.sight import seen

SOLE = np.array([[0.05, 0.036], [-0.05, 0.036], [-0.05, -0.036], [0.05, -0.036]])
EDGE = 0.003


def standing() -> ContactState:
    contacts = ContactState(SOLE, EDGE)
    assert contacts.see(seen((0.0, 0.05), (0.0, -0.05)))
    return contacts


def test_only_a_foot_that_has_moved_is_taken_anew() -> None:
    contacts = standing()
    feet, support = dict(contacts.feet), contacts.support
    assert not contacts.see(seen((0.9 * MOVED, 0.05), (0.0, -0.05 - 0.9 * MOVED)))
    assert contacts.support is support
    assert contacts.see(seen((1.1 * MOVED, 0.05), (0.0, -0.05)))
    assert contacts.feet["right"] is feet["right"]
    assert contacts.positions["left"] == pytest.approx([1.1 * MOVED, 0.05])
    assert contacts.middle == pytest.approx([0.55 * MOVED, 0.0])
    assert contacts.support is not support


def test_the_support_is_that_of_the_feet_on_the_floor_less_the_edge() -> None:
    contacts = standing()
    # From here rounding only.
    assert np.ptp(contacts.hull.vertices, axis=0) == pytest.approx([0.1, 0.172])
    assert np.ptp(contacts.support.vertices, axis=0) == pytest.approx([0.1 - 2 * EDGE, 0.172 - 2 * EDGE])
    contacts.lift("left")
    assert contacts.hull.centre == pytest.approx([0.0, -0.05])
    assert np.ptp(contacts.support.vertices, axis=0) == pytest.approx([0.1 - 2 * EDGE, 0.072 - 2 * EDGE])
    contacts.land()
    assert np.ptp(contacts.hull.vertices, axis=0) == pytest.approx([0.1, 0.172])


def test_a_foot_in_the_air_is_not_followed_until_it_has_landed() -> None:
    contacts = standing()
    contacts.lift("left")
    there = seen((0.1, 0.06), (0.0, -0.05))
    assert not contacts.see(there)
    assert contacts.positions["left"] == pytest.approx([0.0, 0.05])
    contacts.land()
    assert contacts.see(there)
    assert contacts.positions["left"] == pytest.approx([0.1, 0.06])


def test_what_is_forgotten_is_taken_anew_however_little_it_moved() -> None:
    contacts = standing()
    contacts.forget()
    assert contacts.see(seen((0.1 * MOVED, 0.05), (0.0, -0.05)))
    assert contacts.positions["left"] == pytest.approx([0.1 * MOVED, 0.05])


def test_the_heading_is_that_of_the_first_sight() -> None:
    contacts = ContactState(SOLE, EDGE)
    contacts.see(seen((0.0, 0.05), (0.0, -0.05), yaw=0.2))
    contacts.see(seen((0.1, 0.05), (0.1, -0.05), yaw=0.5))
    assert contacts.feet["left"].yaw == 0.5
    assert contacts.heading.yaw == pytest.approx(0.2)
