"""The sets of a scenario in numbers: what they promise, and how hard a push they hold beside what is possible."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.certificate import Certificate, certify
from controllers.footholds import StepLimits
from controllers.limits import no_step_limit, recoverable_delta_v
from controllers.pendulum import Pendulum
from controllers.supervisor import Supervisor
from controllers.support import Foot
from controllers.tracker import Tracker
from models.arena import SIDES, Side
from models.robot import Robot, load_robot, other
from scenarios.schema import Scenario
from sim.brain import make_brain
from sim.plant import PendulumPlant
from sim.recording import robot_facts

Array = NDArray[np.float64]

DIRECTIONS = tuple(range(0, 360, 45))
# Speeds tried up to the stepping limit, so that "every push up to" is found and not only the last; then halvings.
_SPEEDS, _HALVINGS = 24, 10


def set_report(scenario: Scenario, *, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Compute the sets of a scenario's robot at rest in its first stance.

    A push is a sudden change of the COG velocity here, as in the paper's Section V.

    Args:
        scenario: gives the robot, the control period, the gain, the stepping and the pushes.
        progress: called with the share of the work that is done.

    Returns:
        JSON types, lengths in m, velocities in m/s; what is unbounded is null.
    """
    robot = load_robot(scenario.robot)
    supervisor = _standing(scenario, robot)
    regulator = supervisor.regulator
    assert regulator is not None
    moa, gain = regulator.admissible, regulator.gain
    rest, pendulum = moa.x_C, moa.pendulum
    report: dict[str, Any] = {
        "scenario": scenario.description,
        "robot": robot_facts(robot),
        "dt": pendulum.dt,
        "gain": {"name": gain.name, "F": gain.F.tolist(), "poles": _poles(supervisor)},
        "regulator": _certificate(certify(moa)),
    }
    directions = []
    for i, degrees in enumerate(DIRECTIONS):
        directions.append(_reach(supervisor, scenario, math.radians(degrees)))
        if progress is not None:
            progress((i + 1) / (len(DIRECTIONS) + 1))
    report["directions"] = directions
    pushes, hardest = [], None
    for push in scenario.pushes:
        jump = push.impulse_vector(robot.mass)[:2] / robot.mass
        x = rest + np.array([0.0, jump[0], 0.0, jump[1]])
        choice = supervisor.best_step(x)
        slack = moa.slack(x)
        pushes.append(
            {
                "start": push.start,
                "direction_deg": push.direction_deg,
                "delta_v": float(np.hypot(*jump)),
                "regulator_slack": slack,
                "plan": None if choice is None else choice.name,
                "tracking_slack": None if choice is None else choice.plan.slack,
                "explanation": moa.explain(x),
            }
        )
        if choice is not None and (hardest is None or slack < hardest[0]):
            hardest = slack, choice
    report["pushes"] = pushes
    if hardest is not None:
        tracking = certify(Tracker(hardest[1].plan, gain).sets, planes=())
        report["tracking"] = _certificate(tracking) | {"plan": hardest[1].name, "slack": hardest[1].plan.slack}
    if progress is not None:
        progress(1.0)
    return report


def _standing(scenario: Scenario, robot: Robot) -> Supervisor:
    """The scenario's supervisor after its first tick, at rest in the robot's stand."""
    pose = scenario.variation.model_copy(update={"pose": 0.0})
    quiet = scenario.model_copy(update={"world": "pendulum", "controller": "supervisor", "variation": pose})
    supervisor = make_brain(quiet, robot)
    assert isinstance(supervisor, Supervisor)
    supervisor.command(PendulumPlant(quiet, robot).observe())
    return supervisor


def _reach(supervisor: Supervisor, scenario: Scenario, direction: float) -> dict[str, Any]:
    """Recoverable velocities in a direction, beside the limits."""
    regulator = supervisor.regulator
    assert regulator is not None
    moa, stepping = regulator.admissible, scenario.stepping
    standing = no_step_limit(moa.pendulum, moa.polygon, direction, moa.centre)
    own = recoverable_delta_v(moa, direction)
    limits = [
        step_limit(
            moa.pendulum, regulator.feet, supervisor.options.limits, moa.centre, direction, min(stepping.step_times), n
        )
        for n in range(stepping.max_steps + 1)
    ]
    most = max(standing, *limits)
    unit = np.array([0.0, math.cos(direction), 0.0, math.sin(direction)])

    def held(speed: float) -> bool:
        x = moa.x_C + speed * unit
        if moa.contains(x):
            return True
        choice = supervisor.best_step(x)
        return choice is not None and choice.plan.slack >= 0.0

    return {
        "direction_deg": round(math.degrees(direction)),
        "regulator_delta_v": own,
        "no_step_limit": standing,
        "regulator_ratio": own / standing,
        "stepping_delta_v": _first_failure(held, own, 1.05 * most),
        "stepping_limit": most,
        "stepping_limit_steps": stepping.max_steps,
    }


def _first_failure(held: Callable[[float], bool], start: float, most: float) -> float:
    """Every push up to this [m/s] is held, as far as a grid of speeds can tell."""
    inside = start
    for speed in np.linspace(start, most, _SPEEDS + 1)[1:].tolist():
        if held(speed):
            inside = speed
            continue
        outside = speed
        for _ in range(_HALVINGS):
            half = 0.5 * (inside + outside)
            inside, outside = (half, outside) if held(half) else (inside, half)
        break
    return inside


def step_limit(
    pendulum: Pendulum,
    feet: dict[Side, Foot],
    limits: StepLimits,
    centre: Array,
    direction: float,
    step_time: float,
    steps: int,
) -> float:
    """Largest velocity [m/s] from rest over `centre` (2,) that `steps` steps could stop: Koolen's N-step limit.

    The recursion d_N = r + (l + d_{N-1} - r) e^{-omega T} along the direction, with the longest way l that each foot
    has from the other one; where both have the same, it is Koolen's closed form (`controllers.limits.capturability`).
    An upper bound: across the direction everything is allowed.
    """
    n = np.array([math.cos(direction), math.sin(direction)])
    shrink = math.exp(-pendulum.omega * step_time)
    reach = {side: float(((foot.vertices - foot.position) @ n).max()) for side, foot in feet.items()}
    distance = dict(reach)
    for _ in range(steps):
        following = {}
        for stance in SIDES:
            swing = other(stance)
            longest = _longest(limits, swing, feet[stance].yaw, n)
            # After a landing behind the stance foot, the stance foot still bounds the support.
            landed = max(longest + distance[swing], reach[stance])
            following[stance] = reach[stance] + (landed - reach[stance]) * shrink
        distance = following
    return pendulum.omega * max(float((feet[side].position - centre) @ n) + distance[side] for side in SIDES)


def _longest(limits: StepLimits, swing: Side, yaw: float, n: Array) -> float:
    """Longest way [m] along n from the stance foot to where the swing foot may land."""
    sideways = (limits.min_width, limits.max_width) if swing == "left" else (-limits.max_width, -limits.min_width)
    c, s = math.cos(yaw), math.sin(yaw)
    ahead, left = c * n[0] + s * n[1], c * n[1] - s * n[0]
    return limits.max_stride * abs(ahead) + max(left * side for side in sideways)


def _poles(supervisor: Supervisor) -> list[list[float]]:
    """Continuous closed-loop poles of each axis, as [real, imaginary] [1/s]."""
    assert supervisor.regulator is not None
    moa = supervisor.regulator.admissible
    loop = np.linalg.eigvals(moa.gain.closed_loop(moa.pendulum)[:2, :2]).astype(complex)
    return [[float(z.real), float(z.imag)] for z in np.log(loop) / moa.pendulum.dt]


def _certificate(certificate: Certificate) -> dict[str, Any]:
    facts = {"holds": certificate.holds} | asdict(certificate)
    facts["areas"] = [
        {key: None if value == math.inf else value for key, value in area.items()} for area in facts["areas"]
    ]
    return facts
