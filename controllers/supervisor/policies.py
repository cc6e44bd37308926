"""What the supervisor is made of: its gains, its policy of steps, and its prediction."""

from __future__ import annotations

from controllers import gains
from controllers.admissible.gain_bank import best_dcm_ratio
from controllers.gains import Gain
from controllers.geometry.support_polygon import SupportPolygon
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.polygon_policy import PolygonPolicy
from controllers.stepping.recoverability import Recoverability
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import StepPolicy
from models.robot import Robot

SOFTER = (1.25, 1.1)
"""DCM gains to fall back on before a step; the set of the last one ends at 1 / 1.1 of the limit without a step."""


def with_softer(robot: Robot, pendulum: Pendulum, first: Gain, options: Stepping) -> tuple[Gain, ...]:
    """A gain, and those to fall back on that are not the same."""
    softest = softest_k(robot, options)
    softer = dict.fromkeys(max(k, softest) for k in SOFTER)
    return (first, *(gain for k in softer if (gain := gains.dcm(pendulum, k)).name != first.name))


def softest_k(robot: Robot, options: Stepping) -> float:
    """DCM gain that is given up last: of `SOFTER`, or the one whose set is the largest under the ZMP's error.

    Raises:
        GainBankError: the error leaves nothing of the sole.
    """
    if not options.zmp_error:
        return min(SOFTER)
    room = SupportPolygon(robot.sole_vertices["left"]).shrunk(options.zmp_margin)
    return max(min(SOFTER), best_dcm_ratio(room.slack(room.centre), options.zmp_error))


def step_policy(robot: Robot, pendulum: Pendulum, options: Stepping) -> StepPolicy:
    """The policy that the options name."""
    if options.rule == "polygon":
        return PolygonPolicy(robot, pendulum, options)
    return SetPolicy(robot, pendulum, options, softest_k(robot, options))


def recoverability(robot: Robot, pendulum: Pendulum, options: Stepping, *, on_body: bool) -> Recoverability:
    """The sets that predict the pendulum, which does exactly what they say, or those of a humanoid's slower feet."""
    if on_body:
        return Recoverability.of_body(robot, pendulum, options, softest_k(robot, options))
    return Recoverability(SetPolicy(robot, pendulum, options, softest_k(robot, options)))
