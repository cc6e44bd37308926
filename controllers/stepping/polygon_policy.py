"""Steps without sets: is the capture point inside the feet's hull? What the sets are to be compared with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.interface import Candidate
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.step_policy import Aim, Heading, Lift, natural_foothold, step_limits
from models.robot import Robot, Side, other

Array = NDArray[np.float64]

# A capture point this far inside the hull after a step counts as caught [m].
INSIDE = 0.012
# Steps that are looked ahead, with the ZMP at the point of the stance sole nearest to the DCM.
LOOK_AHEAD = 3


class PolygonPolicy:
    """Steps to where the DCM will be, as far as the leg reaches; the first foot by looking three steps ahead."""

    def __init__(self, robot: Robot, pendulum: Pendulum, options: Stepping) -> None:
        self._pendulum = pendulum
        self._limits = step_limits(robot, options.max_stride)
        self._time = options.times(robot, pendulum.dt)[0]
        self._look_ahead = min(LOOK_AHEAD, options.max_steps)
        self._sole = robot.sole_vertices["left"]
        self._inner = SupportPolygon(self._sole).shrunk(options.zmp_margin)

    def lift(self, dcm: Array, feet: Mapping[Side, Array], heading: Heading, sides: Sequence[Side]) -> Lift:
        """See `StepPolicy.lift`."""
        outside = {}
        for side in sides:
            stance = feet[other(side)]
            outside[side] = self._outside(heading.local(dcm, stance), side, self._look_ahead)
        best = min(sides, key=lambda side: outside[side])
        candidates = tuple(Candidate(name=f"{side} {self._time:g} s", slack=-outside[side]) for side in sides)
        return Lift(side=best, step_time=self._time, steps=1, slack=math.nan, candidates=candidates)

    def aim(
        self, dcm: Array, stance: Array, swing: Array, heading: Heading, lift: Lift, ticks_left: int, steps: int
    ) -> Aim:
        """See `StepPolicy.aim`."""
        zmp, foothold, _ = self._step(heading.local(dcm, stance), lift.side, ticks_left * self._pendulum.dt)
        return Aim(foothold=heading.world(foothold, stance), zmp=heading.world(zmp, stance), steps=1, slack=math.nan)

    def _step(self, dcm: Array, side: Side, time: float) -> tuple[Array, Array, Array]:
        """ZMP, foothold and DCM at landing, seen from the stance foot."""
        zmp, growth = self._inner.nearest(dcm), math.exp(self._pendulum.omega * time)
        wanted = natural_foothold(dcm, zmp, growth, side)
        limits, outward = self._limits, 1.0 if side == "left" else -1.0
        ahead = min(max(float(wanted[0]), -limits.max_stride), limits.max_stride)
        aside = min(max(outward * float(wanted[1]), limits.min_width), limits.max_width)
        return zmp, np.array([ahead, outward * aside]), zmp + (dcm - zmp) * growth

    def _outside(self, dcm: Array, side: Side, left: int) -> float:
        """How far the DCM is outside the feet after at most `left` steps [m], each of which counts as 2 cm."""
        _, foothold, landed = self._step(dcm, side, self._time)
        feet = [Foot(position=p, yaw=0.0, sole=self._sole) for p in (np.zeros(2), foothold)]
        slack = support_polygon(feet).slack(landed) - INSIDE
        if slack >= 0.0:
            return -0.02 * left
        return -slack if left == 1 else self._outside(landed - foothold, other(side), left - 1)
