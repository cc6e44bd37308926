"""What the supervisor is made of: its gains, its policy of steps, and its prediction."""

from __future__ import annotations

from controllers import gains
from controllers.gains import Gain
from controllers.options import Stepping
from controllers.pendulum import Pendulum
from controllers.stepping.polygon_policy import PolygonPolicy
from controllers.stepping.recoverability import Recoverability
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import StepPolicy
from models.robot import Robot

SOFTER = (1.25, 1.1)
"""DCM gains to fall back on before a step; the set of the last one ends at 1 / 1.1 of the limit without a step."""


def with_softer(pendulum: Pendulum, first: Gain) -> tuple[Gain, ...]:
    """A gain, and those to fall back on that are not the same."""
    softer = (gains.dcm(pendulum, k) for k in SOFTER)
    return (first, *(gain for gain in softer if gain.name != first.name))


def step_policy(robot: Robot, pendulum: Pendulum, options: Stepping) -> StepPolicy:
    """The policy that the options name."""
    if options.rule == "polygon":
        return PolygonPolicy(robot, pendulum, options)
    return SetPolicy(robot, pendulum, options, min(SOFTER))


def recoverability(robot: Robot, pendulum: Pendulum, options: Stepping, *, on_body: bool) -> Recoverability:
    """The prediction for the humanoid, or for the pendulum, which does exactly what the sets say."""
    if on_body:
        return Recoverability.of_body(robot, pendulum, options, min(SOFTER))
    return Recoverability(SetPolicy(robot, pendulum, options, min(SOFTER)))
