"""The walk of Section IV-C."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.pendulum import Pendulum
from controllers.reference.reference_program import PlanningError
from controllers.reference.walking_reference import walk_plan
from tests.controllers.gait_stance import OMEGA, PENDULUM, standing


@pytest.mark.parametrize("dt", [0.002, 0.005])
def test_walk_of_section_iv_c(dt: float) -> None:
    pendulum = Pendulum(OMEGA, dt)
    walk = walk_plan(pendulum, standing()).reference
    assert walk.duration == pytest.approx(2.0, abs=1e-12)  # four steps of 0.5 s
    assert walk.margins().min() >= 0.005 - 1e-6
    np.testing.assert_array_equal(walk.xi[0], np.zeros(4))
    # The last step closes the feet: three strides of 0.1 m.
    np.testing.assert_allclose(walk.xi[-1], [0.3, 0.0, 0.0, 0.0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(walk.final.centre, [0.3, 0.0], rtol=0, atol=1e-12)
    areas = [np.prod(np.ptp(walk.support(round(t / dt)).vertices, axis=0)) for t in (0.0, 0.25, 0.5, 0.75, 2.0)]
    # Box around both feet: aligned, one sole, a stride apart, one sole, aligned again.
    expected = [0.099 * 0.156, 0.099 * 0.072, 0.199 * 0.156, 0.099 * 0.072, 0.099 * 0.156]
    np.testing.assert_allclose(areas, expected, rtol=1e-12)
    assert walk.support(round(0.25 / dt)).contains((0.0, 0.042))  # the right foot steps first


def test_a_walk_that_cannot_be_is_a_planning_error() -> None:
    # A tick of double support cannot bring the ZMP to one foot before the other is lifted.
    with pytest.raises(PlanningError, match="leaves its supports"):
        walk_plan(PENDULUM, standing(), double_support=0.002)
    with pytest.raises(PlanningError, match="single and double"):
        walk_plan(PENDULUM, standing(), double_support=0.25)
