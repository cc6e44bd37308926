"""Runs a controller at joint level unpushed, and condenses what it is given, what it answers and how it stands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.registry import CONTROLLERS
from controllers.shown import ObservationTerm
from models.errors import InputError
from models.robot import load_robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import EpisodeResult, run_episode
from sim.policy_check.questions import Questions
from sim.record.outcome import Result

Array = NDArray[np.float64]

CONSTANT = 1e-6
"""What changes by less than this share of its greatest value, a network's floats hardly tell apart."""


def policy_report(scenario: Scenario, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run a scenario's controller and say what it saw and did; of JSON types.

    Args:
        scenario: names the controller; without pushes, the robot is to stand.
        progress: called now and then with the simulated time [s].

    Raises:
        InputError: if the controller is not at joint level, cannot be built or fails.
    """
    entry = CONTROLLERS.entry(scenario.controller.name)
    if not entry.at_joints:
        raise InputError(f"controller: {entry.short!r} gives balance commands; a policy moves the joints itself")
    robot = load_robot(scenario.robot)
    controller = make_controller(scenario, robot)
    questions = Questions(controller, entry.short, scenario.timing.control)
    result = run_episode(
        scenario, controller=controller, robot=robot, polygons=False, progress=progress, on_tick=questions.see
    )
    return {
        "description": scenario.description,
        "robot": robot.name,
        "controller": entry.short,
        "period": float(getattr(controller, "period", scenario.timing.control)),
        "seconds": scenario.duration,
        **_standing(result),
        **_shown(questions, entry.short),
        "torque": _torque(result),
    }


def _standing(result: EpisodeResult) -> dict[str, Any]:
    trace, outcome = result.trace, result.outcome
    lasted = float(trace.time[-1] - trace.time[0])
    way = np.hypot(trace["cog_x"] - trace["cog_x"][0], trace["cog_y"] - trace["cog_y"][0])
    return {
        "stands": outcome.result is not Result.FELL,
        "stood_for": lasted if outcome.time_of_fall is None else outcome.time_of_fall,
        "fall": outcome.reason.value if outcome.result is Result.FELL else None,
        "cog_drift": {"end": float(way[-1]), "greatest": float(way.max())},
        "steps": outcome.steps_taken,
        "steps_per_second": outcome.steps_taken / lasted if lasted else 0.0,
    }


def _shown(questions: Questions, who: str) -> dict[str, Any]:
    why = None
    if questions.terms is None:
        why = (
            f"{who} does not show what it is given and what it answers: it lacks observation_terms, last_input or "
            "last_action of controllers.shown.ShowsObservation"
        )
    elif not len(questions.inputs):
        why = f"{who} fell before it had answered"
    if why is not None or questions.terms is None:
        return {"questions": None, "terms": None, "action": None, "not_shown": why}
    inputs, actions = questions.inputs, questions.actions
    return {
        "questions": len(inputs),
        "terms": [_term(term, inputs[:, term.places]) for term in questions.terms],
        "action": _action(actions),
        "not_shown": None,
    }


def _term(term: ObservationTerm, values: Array) -> dict[str, Any]:
    """Of one term: values (k, m) it had at the questions."""
    low, mean, high = values.min(axis=0), values.mean(axis=0), values.max(axis=0)
    greatest = np.maximum(np.abs(values).max(axis=0), 1.0)
    constant = high - low < CONSTANT * greatest
    at_clip = np.zeros(len(term.components))
    if term.clip is not None:
        at_clip = ((values <= term.clip[0]) | (values >= term.clip[1])).mean(axis=0)
    return {
        "name": term.name,
        "size": len(term.components),
        "min": float(low.min()),
        "mean": float(mean.mean()),
        "max": float(high.max()),
        "constant": [name for name, still in zip(term.components, constant, strict=True) if still],
        "clip": None if term.clip is None else list(term.clip),
        "at_clip": {name: float(share) for name, share in zip(term.components, at_clip, strict=True) if share},
        "components": [
            {"name": name, "min": float(a), "mean": float(b), "max": float(c)}
            for name, a, b, c in zip(term.components, low, mean, high, strict=True)
        ],
    }


def _action(values: Array) -> dict[str, Any]:
    """Of the answers (k, a)."""
    change = np.diff(values, axis=0)
    return {
        "size": int(values.shape[1]),
        "rms": _rms(values),
        "max": float(np.abs(values).max(initial=0.0)),
        "change_rms": _rms(change),
        "change_max": float(np.abs(change).max(initial=0.0)),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _torque(result: EpisodeResult) -> dict[str, Any]:
    # The tick of a fall has no physics any more.
    limited = result.trace["saturated"]
    ran = limited[np.isfinite(limited)]
    motors = result.motors
    return {
        "saturated_share": float((ran > 0).mean()) if len(ran) else 0.0,
        "saturated_joint": None if motors is None else motors.saturated_joint,
        "peak_use": None if motors is None else motors.peak_torque_use,
        "peak_joint": None if motors is None else motors.peak_torque_joint,
    }
