from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from controllers.geometry.support_polygon import Foot, support_polygon
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference, ReferenceViolation

PENDULUM = Pendulum(math.sqrt(9.81 / 0.26), 0.002)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
LEFT = Foot(position=np.array([0.0, 0.042]), yaw=0.0, sole=SOLE)
RIGHT = Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=SOLE)
BOTH, ONE = support_polygon([LEFT, RIGHT]), support_polygon([LEFT])


def parts(**changes: Any) -> dict[str, Any]:
    """From the left with just the speed that dies out over the ZMP, which is the exact end at rest."""
    mu = np.tile([0.0, 0.01], (1500, 1))
    start = np.array([0.02, -0.02 * PENDULUM.omega, 0.03, -0.02 * PENDULUM.omega])
    xi = PENDULUM.rest((0.0, 0.01)) + np.exp(-PENDULUM.omega * 0.002 * np.arange(1501))[:, None] * (
        start - PENDULUM.rest((0.0, 0.01))
    )
    support_of = np.r_[np.zeros(500, dtype=int), np.ones(1000, dtype=int)]
    good = {
        "pendulum": PENDULUM,
        "xi": xi,
        "mu": mu,
        "supports": (BOTH, ONE),
        "support_of": support_of,
        "final": ONE,
    }
    return good | changes


def test_an_admissible_reference_knows_its_margins() -> None:
    reference = Reference(**parts())
    assert (reference.m, reference.dt, reference.duration) == (1500, 0.002, 3.0)
    # ZMP at (0, 0.01): 0.0495 to the front edge of both; 0.01 - 0.006 to the inner edge of the left sole.
    np.testing.assert_allclose(reference.margins()[:500], 0.0495, atol=1e-15)
    np.testing.assert_allclose(reference.margins()[500:], 0.004, atol=1e-15)
    assert reference.support(499) is BOTH
    assert reference.support(500) is ONE
    assert reference.support(1500) is ONE


def test_zmp_outside_is_refused() -> None:
    outside = parts(mu=None)
    shift = np.array([0.0, 0.0, -0.01, 0.0])
    outside["mu"] = np.tile([0.0, 0.0], (1500, 1))
    outside["xi"] = parts()["xi"] + shift
    outside["final"] = BOTH
    with pytest.raises(ReferenceViolation, match=r"0.006 m outside its support polygon at tick 500"):
        Reference(**outside)


def test_broken_dynamics_is_refused() -> None:
    xi = parts()["xi"].copy()
    xi[700:, 0] += 1e-8
    with pytest.raises(ReferenceViolation, match=r"\(26\) is broken .* at tick"):
        Reference(**parts(xi=xi))


def test_an_end_in_motion_or_beside_the_feet_is_refused() -> None:
    short = {"xi": parts()["xi"][:501], "mu": parts()["mu"][:500], "support_of": np.zeros(500, dtype=int)}
    with pytest.raises(ReferenceViolation, match="still moves"):
        Reference(**parts(**short))
    with pytest.raises(ReferenceViolation, match="outside the final"):
        Reference(**parts(final=support_polygon([RIGHT])))


@pytest.mark.parametrize(
    "changes",
    [
        {"xi": np.zeros((1500, 4))},
        {"mu": np.zeros((1500, 3))},
        {"support_of": np.zeros(1499, dtype=int)},
        {"support_of": np.full(1500, 2)},
        {"support_of": np.full(1500, -1)},
        {"mu": np.full((1500, 2), math.nan)},
    ],
)
def test_parts_that_do_not_fit_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ReferenceViolation):
        Reference(**parts(**changes))


def test_arrays_are_copies_that_cannot_be_changed() -> None:
    given = parts()
    reference = Reference(**given)
    given["mu"][0] = 9.0
    assert reference.mu[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        reference.xi[0, 0] = 1.0
