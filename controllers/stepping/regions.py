"""Sets of states that steps hold, as polytopes of the pendulum's state in the world."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.polytope import Polytope
from controllers.geometry.support_polygon import Foot
from controllers.nstep.step_sets import StepSets
from controllers.pendulum import Pendulum
from controllers.stepping.step_policy import Heading, Lift
from models.robot import Side, other

Array = NDArray[np.float64]


def dcm_polytope(pendulum: Pendulum, polygon: Polytope, heading: Heading, origin: Array) -> Polytope:
    """States (4,) whose DCM is in a polygon that is seen from a foot at `origin` (2,) [m]."""
    c, s = math.cos(heading.yaw), math.sin(heading.yaw)
    normals = polygon.S @ np.array([[c, s], [-s, c]])
    return Polytope(
        S=normals @ np.kron(np.eye(2), [1.0, 1.0 / pendulum.omega]), a=polygon.a + normals @ np.asarray(origin)
    )


def lift_polytope(sets: StepSets, lift: Lift, feet: Mapping[Side, Foot], heading: Heading) -> Polytope:
    """States (4,) in the set of a step that begins now: of its number of steps, its foot and its duration."""
    stance = other(lift.side)
    origin = feet[stance].position
    swing = heading.local(feet[lift.side].position, origin)
    polygon = sets.polygon(lift.steps, stance, lift.step_time, swing, step_time=lift.step_time)
    return dcm_polytope(sets.pendulum, polygon, heading, origin)
