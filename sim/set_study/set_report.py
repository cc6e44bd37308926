"""The sets of a scenario in numbers: what they promise, and how hard a push they hold beside what is possible."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from controllers.admissible.certificate import Certificate, certify
from controllers.admissible.delay import delayed_set
from controllers.admissible.gain_bank import GainBank
from controllers.admissible.gilbert_tan import MoaError
from controllers.admissible.limits import no_step_limit, recoverable_delta_v
from controllers.admissible.moa import MoaSet
from controllers.fields import snap
from controllers.gains import GainError
from controllers.nstep.certificate import StepCertificate
from controllers.nstep.step_sets import StepSets
from controllers.stepping.set_policy import SetPolicy, plan_name
from controllers.supervisor.supervisor import Supervisor
from models.errors import InputError
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against
from scenarios.choice import Choice
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.plant import PendulumPlant
from sim.episode.recording import robot_facts
from sim.set_study import set_reach

DIRECTIONS = tuple(range(0, 360, 45))


def set_report(
    scenario: Scenario, *, zmp_error: float = 0.0, delay: float = 0.0, progress: Callable[[float], None] | None = None
) -> dict[str, Any]:
    """Compute the sets of a scenario's robot at rest in its first stance.

    A push is a sudden change of the COG velocity here, as in the paper's Section V; torques, which are none, are only
    counted.

    Args:
        scenario: gives the robot, the control period, the gain, the stepping and the pushes.
        zmp_error: largest error of the realised ZMP along each axis that a second family of sets withstands [m]; 0 for
            no such family.
        delay: time that the ZMP follows its command by, for a third family, of the regulators alone [s]; 0 for none.
        progress: called with the share of the work that is done.

    Returns:
        JSON types, lengths in m, velocities in m/s; what is unbounded is null.

    Raises:
        InputError: if the delay is no whole multiple of the control period, or the error leaves nothing of the sole.
    """
    robot = load_robot(scenario.robot)
    samples = _samples(delay, scenario.timing.control)
    robust = scenario.model_copy(update={"stepping": scenario.stepping.model_copy(update={"zmp_error": zmp_error})})
    if zmp_error:
        check_against(robust, robot, source="--zmp-error")
    share = 0.5 if zmp_error else 1.0
    supervisor, sets = standing(scenario, robot)
    exact = _family(supervisor, sets, lambda done: progress and progress(share * done))
    report: dict[str, Any] = {
        "scenario": scenario.description,
        "robot": robot_facts(robot),
        "dt": sets.pendulum.dt,
        "exact": exact,
        "pushes": [_push(supervisor, sets, push, robot) for push in scenario.pushes if push.torque is None],
        "torques": sum(push.torque is not None for push in scenario.pushes),
        "robust": None,
        "late": None,
    }
    if delay:
        report["late"] = {"delay": delay, "regulators": [_late(moa, samples) for moa in _bank(supervisor).sets]}
    if zmp_error:
        firm, firm_sets = standing(robust, robot)
        family = _family(firm, firm_sets, lambda done: progress and progress(0.5 + 0.5 * done))
        report["robust"] = {"zmp_error": zmp_error, "left_out": _bank(firm).left_out} | family
    return report


def _family(supervisor: Supervisor, sets: StepSets, progress: Callable[[float], Any]) -> dict[str, Any]:
    """The sets of the regulators and of the steps, and how hard a push they hold in each direction."""
    directions = []
    for i, degrees in enumerate(DIRECTIONS):
        directions.append(_direction(supervisor, sets, math.radians(degrees)))
        progress((i + 1) / len(DIRECTIONS))
    stepping = {
        "step_times": list(sets.step_times),
        "max_steps": sets.max_steps,
        "gain_k": sets.gain_k,
        "rows": _rows(sets),
    }
    regulators = [_regulator(moa) for moa in _bank(supervisor).sets]
    return {"regulators": regulators, "stepping": stepping, "directions": directions}


def _bank(supervisor: Supervisor) -> GainBank:
    assert supervisor.regulator is not None
    return supervisor.regulator.bank


def _samples(delay: float, dt: float) -> int:
    """Control periods in a delay [s]."""
    if not (math.isfinite(delay) and delay >= 0.0 and math.isclose(snap(delay / dt), round(delay / dt))):
        raise InputError(f"--delay: {delay!r} s must be a whole multiple of the control period, {dt!r} s")
    return round(delay / dt)


def _late(moa: MoaSet, samples: int) -> dict[str, Any]:
    """Rows and recoverable velocities of a regulator whose ZMP comes late; or why there is no set."""
    try:
        late = delayed_set(moa.pendulum, moa.gain, moa.polygon, samples, moa.centre)
    except (GainError, MoaError) as error:
        return {"gain": moa.gain.name, "rows": None, "directions": [], "why": str(error)}
    directions = [
        {"direction_deg": degrees, "delta_v": recoverable_delta_v(late, math.radians(degrees))}
        for degrees in DIRECTIONS
    ]
    return {"gain": moa.gain.name, "rows": len(late.polytope.a), "directions": directions, "why": None}


def standing(scenario: Scenario, robot: Robot) -> tuple[Supervisor, StepSets]:
    """The scenario's supervisor after its first tick, at rest in the robot's stand, and its sets of feet at rest."""
    changes = {
        "world": "pendulum",
        "controller": Choice(name="supervisor"),
        "variation": scenario.variation.model_copy(update={"pose": 0.0}),
        "stepping": scenario.stepping.model_copy(update={"rule": "sets"}),
    }
    quiet = scenario.model_copy(update=changes)
    supervisor = make_controller(quiet, robot)
    assert isinstance(supervisor, Supervisor)
    assert isinstance(supervisor.rule, SetPolicy)
    supervisor.command(PendulumPlant(quiet, robot).observe())
    return supervisor, supervisor.rule.lift_sets


def _direction(supervisor: Supervisor, sets: StepSets, direction: float) -> dict[str, Any]:
    """Recoverable velocities in a direction, beside the limits."""
    regulator = supervisor.regulator
    assert regulator is not None
    bank = regulator.bank
    unaided = no_step_limit(bank.pendulum, bank.polygon, direction, bank.centre)
    limits = set_reach.koolen_limits(regulator, sets.limits, direction, sets.step_times, sets.max_steps)
    own, *reaches = set_reach.reaches(sets, regulator, direction)
    steps = []
    for reach, limit in zip(reaches, limits[1:], strict=True):
        pair = set_reach.certificates(sets, regulator, direction, reach)
        steps.append(
            {
                "steps": reach.steps,
                "delta_v": reach.delta_v,
                "limit": max(limit, unaided),
                "taken": reach.taken,
                "first": reach.side,
                "step_time": reach.step_time,
                "certificate": None if pair is None else _both(sets, *pair),
            }
        )
    return {
        "direction_deg": round(math.degrees(direction)),
        "regulator_delta_v": own.delta_v,
        "no_step_limit": unaided,
        "regulator_ratio": own.delta_v / unaided,
        "steps": steps,
    }


def _both(sets: StepSets, inside: StepCertificate, outside: StepCertificate) -> dict[str, Any]:
    """Whether the certificates on either side of a rim hold, and the larger of what they break [m]."""
    return {
        "holds": inside.member and not outside.member and inside.holds(sets) and outside.holds(sets),
        "violation": max(inside.violation(sets), outside.violation(sets)),
    }


def _push(supervisor: Supervisor, sets: StepSets, push: Push, robot: Robot) -> dict[str, Any]:
    """What the sets say of a push of the scenario, with the certificate of the best steps."""
    regulator = supervisor.regulator
    assert regulator is not None
    jump = push.impulse_vector(robot.mass)[:2] / robot.mass
    x = sets.pendulum.rest(regulator.bank.centre) + np.array([0.0, jump[0], 0.0, jump[1]])
    lift = supervisor.best_step(x)
    first = next(
        one
        for one in set_reach.first_steps(sets, regulator)
        if (one.side, one.step_time) == (lift.side, lift.step_time)
    )
    certificate = set_reach.certify(sets, regulator, sets.pendulum.dcm(x), first, lift.steps)
    return {
        "start": push.start,
        "direction_deg": push.direction_deg,
        "delta_v": float(np.hypot(*jump)),
        "regulator_slack": regulator.slack(x),
        "plan": plan_name(lift.side, lift.step_time, lift.steps),
        "stepping_slack": lift.slack,
        "explanation": regulator.explain(x),
        "certificate": {
            "member": certificate.member,
            "holds": certificate.holds(sets),
            "violation": certificate.violation(sets),
            "words": certificate.render(),
        },
    }


def _rows(sets: StepSets) -> list[int]:
    """Rows of the set of 1, 2, ... steps on the left foot, a whole step of the shortest time before landing."""
    shortest = min(sets.step_times)
    return [len(sets.polygon(n, "left", shortest, step_time=shortest).a) for n in range(1, sets.max_steps + 1)]


def _regulator(moa: MoaSet) -> dict[str, Any]:
    return {"gain": moa.gain.name, "F": moa.gain.F.tolist(), "poles": _poles(moa)} | _certificate(certify(moa))


def _poles(moa: MoaSet) -> list[list[float]]:
    """Continuous closed-loop poles of each axis, as [real, imaginary] [1/s]."""
    loop = np.linalg.eigvals(moa.gain.closed_loop(moa.pendulum)[:2, :2]).astype(complex)
    return [[float(z.real), float(z.imag)] for z in np.log(loop) / moa.pendulum.dt]


def _certificate(certificate: Certificate) -> dict[str, Any]:
    facts = {"holds": certificate.holds} | asdict(certificate)
    facts["areas"] = [
        {key: None if value == math.inf else value for key, value in area.items()} for area in facts["areas"]
    ]
    return facts
