"""Back to the natural stance: once it is quiet, one slow step brings the feet beside each other again.

First the COG is led over the foot that stays; when the DCM is well inside its sole, the other foot may be lifted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.geometry.support_polygon import SupportPolygon
from controllers.stepping.contact_state import ContactState
from controllers.stepping.step_policy import Heading
from models.robot import Robot, Side, other
from models.scale import Scale

Array = NDArray[np.float64]

# All of a robot of scale 1. Feet this far from their natural distance are worth a step [m].
ASTRAY = 0.02
# The DCM counts as quiet within this distance of the middle of the feet [m], after so long [s].
QUIET, QUIET_FOR = 0.012, 0.3
# The foot is lifted when the DCM is this far inside the other sole [m].
SAFE_TO_LIFT = 0.012
# Soles narrower than so many times that are too narrow to stand on one.
NARROW = 4.0
# The COG is led over the stance foot at this speed [m/s]; the step takes so long [s], or longer at this mean speed.
LEAD_SPEED = 0.15
SHORTEST, FOOT_SPEED = 0.3, 0.6
# A COG that is not there after so long [s] cannot get there.
GIVE_UP = 2.0
# So many closing steps are tried before the stance is left as it is, until the next push makes the robot step.
ATTEMPTS = 3


@dataclass(frozen=True, kw_only=True)
class Restoration:
    """A closing step to be made.

    Attributes:
        side: the foot that goes.
        foothold: (2,) where to, in the world [m].
        over: (2,) middle of the stance foot, over which the COG is led first [m].
        start: (2,) where the COG is held before [m].
        since: when it began [s].
        step_time: duration of the step [s].
        scale: of the robot.
    """

    side: Side
    foothold: Array
    over: Array
    start: Array
    since: float
    step_time: float
    scale: Scale

    def centre(self, time: float) -> Array:
        """(2,) where the regulator shall hold the COG at a time [m]."""
        way = self.over - self.start
        length = math.hypot(*way)
        share = min(LEAD_SPEED * self.scale.speed * (time - self.since) / length, 1.0) if length > 0.0 else 1.0
        return np.asarray(self.start + share * way)

    def may_lift(self, dcm: Array, sole: SupportPolygon, heading: Heading) -> bool:
        """Whether the DCM is well inside the sole of the stance foot."""
        return sole.slack(heading.local(dcm, self.over)) >= SAFE_TO_LIFT * self.scale.length


def closing_step(
    feet: Mapping[Side, Array], stays: Side, heading: Heading, robot: Robot, time: float, dt: float
) -> Restoration | None:
    """The step that brings the feet to their natural distance.

    None if they are near it, so far apart that a leg would not reach while the COG is over the foot that stays, or if
    the soles are too narrow for a DCM that sways to stay well inside of one.

    Args:
        feet: (2,) where they stand [m].
        stays: the foot that does not go.
        heading: of the robot.
        robot: whose legs they are.
        time: now [s].
        dt: control period [s].
    """
    side = other(stays)
    natural = np.array([0.0, robot.stance_width if side == "left" else -robot.stance_width])
    place = heading.local(feet[side], feet[stays])
    astray = math.hypot(*(place - natural))
    scale = robot.scale
    if robot.sole_width < NARROW * SAFE_TO_LIFT * scale.length:
        return None
    if astray < ASTRAY * scale.length or math.hypot(*(place - 0.5 * natural)) > robot.hip_reach:
        return None
    return Restoration(
        side=side,
        foothold=heading.world(natural, feet[stays]),
        over=feet[stays],
        start=0.5 * (feet["left"] + feet["right"]),
        since=time,
        step_time=math.ceil(max(SHORTEST * scale.time, astray / (FOOT_SPEED * scale.speed)) / dt) * dt,
        scale=scale,
    )


class StanceRecovery:
    """Sees when it is quiet, and leads the COG to where the closing step can begin.

    Attributes:
        plan: the closing step to be made; None unless the COG is on its way to where it can begin.
    """

    def __init__(self, robot: Robot, dt: float) -> None:
        """Watch over a robot, in control periods of `dt` [s]."""
        self.plan: Restoration | None = None
        self._robot = robot
        self._scale = robot.scale
        self._dt = dt
        self._sole = SupportPolygon(robot.sole_vertices["left"])
        self._quiet_since: float | None = None
        self._tried = 0

    def interrupt(self) -> None:
        """A foot is lifted: there is nothing to lead up to."""
        self.plan, self._quiet_since = None, None

    def renew(self) -> None:
        """A push makes the robot step: it may close up as often again."""
        self._tried = 0

    def ready(self, dcm: Array, heading: Heading) -> bool:
        """Whether the closing step may begin, with the DCM at (2,) [m]."""
        return self.plan is not None and self.plan.may_lift(dcm, self._sole, heading)

    def watch(self, time: float, dcm: Array, contacts: ContactState, landed: Side) -> str:
        """Begin to lead the COG, or give it up; the reason in words, empty if nothing changes.

        Args:
            time: now [s].
            dcm: (2,) [m].
            contacts: where the feet stand.
            landed: the foot that landed last, which stays.
        """
        if self.plan is not None:
            if time - self.plan.since <= GIVE_UP * self._scale.time:
                return ""
            self.plan, self._tried = None, ATTEMPTS
            return "the legs do not reach so far: the stance stays"
        (x, y), (middle_x, middle_y) = dcm.tolist(), contacts.middle.tolist()
        if math.hypot(x - middle_x, y - middle_y) > QUIET * self._scale.length:
            self._quiet_since = None
        elif self._quiet_since is None:
            self._quiet_since = time
        elif time - self._quiet_since >= QUIET_FOR * self._scale.time and self._tried < ATTEMPTS:
            self._quiet_since = None
            self.plan = closing_step(contacts.positions, landed, contacts.heading, self._robot, time, self._dt)
            if self.plan is not None:
                self._tried += 1
                return f"it is quiet: the COG goes over the {landed} foot"
        return ""
