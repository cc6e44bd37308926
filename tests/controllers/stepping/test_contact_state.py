"""Where the feet stand: taken anew when a foot has moved, and of the foot in the air not at all."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.stepping.contact_state import MOVED, Footing
from tests.controllers.sight import seen

SOLE = np.array([[0.05, 0.036], [-0.05, 0.036], [-0.05, -0.036], [0.05, -0.036]])
EDGE = 0.003


def standing() -> Footing:
    footing = Footing(SOLE, EDGE)
    assert footing.see(seen((0.0, 0.05), (0.0, -0.05)))
    return footing


def test_only_a_foot_that_has_moved_is_taken_anew() -> None:
    footing = standing()
    feet, support = dict(footing.feet), footing.support
    assert not footing.see(seen((0.9 * MOVED, 0.05), (0.0, -0.05 - 0.9 * MOVED)))
    assert footing.support is support
    assert footing.see(seen((1.1 * MOVED, 0.05), (0.0, -0.05)))
    assert footing.feet["right"] is feet["right"]
    assert footing.positions["left"] == pytest.approx([1.1 * MOVED, 0.05])
    assert footing.middle == pytest.approx([0.55 * MOVED, 0.0])
    assert footing.support is not support


def test_the_support_is_that_of_the_feet_on_the_floor_less_the_edge() -> None:
    footing = standing()
    # From here rounding only.
    assert np.ptp(footing.hull.vertices, axis=0) == pytest.approx([0.1, 0.172])
    assert np.ptp(footing.support.vertices, axis=0) == pytest.approx([0.1 - 2 * EDGE, 0.172 - 2 * EDGE])
    footing.lift("left")
    assert footing.hull.centre == pytest.approx([0.0, -0.05])
    assert np.ptp(footing.support.vertices, axis=0) == pytest.approx([0.1 - 2 * EDGE, 0.072 - 2 * EDGE])
    footing.land()
    assert np.ptp(footing.hull.vertices, axis=0) == pytest.approx([0.1, 0.172])


def test_a_foot_in_the_air_is_not_followed_until_it_has_landed() -> None:
    footing = standing()
    footing.lift("left")
    there = seen((0.1, 0.06), (0.0, -0.05))
    assert not footing.see(there)
    assert footing.positions["left"] == pytest.approx([0.0, 0.05])
    footing.land()
    assert footing.see(there)
    assert footing.positions["left"] == pytest.approx([0.1, 0.06])


def test_what_is_forgotten_is_taken_anew_however_little_it_moved() -> None:
    footing = standing()
    footing.forget()
    assert footing.see(seen((0.1 * MOVED, 0.05), (0.0, -0.05)))
    assert footing.positions["left"] == pytest.approx([0.1 * MOVED, 0.05])


def test_the_heading_is_that_of_the_first_sight() -> None:
    footing = Footing(SOLE, EDGE)
    footing.see(seen((0.0, 0.05), (0.0, -0.05), yaw=0.2))
    footing.see(seen((0.1, 0.05), (0.1, -0.05), yaw=0.5))
    assert footing.feet["left"].yaw == 0.5
    assert footing.heading.yaw == pytest.approx(0.2)
