"""Sways a standing robot, pushes it as its scenario says, and condenses what the sets assume of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.admissible.gain_bank import stiffness
from controllers.interface import Phase
from controllers.pendulum import Pendulum
from controllers.registry import CONTROLLERS
from models.errors import InputError
from models.robot import Robot, load_robot
from scenarios.choice import Choice
from scenarios.schema import Scenario
from scenarios.sensing import Sensing
from sim.episode.episode import run_episode
from sim.episode.recording import robot_facts
from sim.identify.excitation import FREQUENCIES, Sway
from sim.identify.response import Window, feedback_gain, lines, mean_of, spread, transfer
from sim.identify.sets_left import sets_left, stand
from sim.identify.swayed_episode import AXES, Standing, pair, sway
from sim.record.trace import Trace

Array = NDArray[np.float64]
# Of an error that sets are asked to withstand: hundredths of a millimetre.
_DIGITS = 5
# An edge of the support along an axis bounds nothing along it, but for rounding.
_EDGE_ON = 1e-9


def identify(
    scenario: Scenario,
    *,
    seeds: int = 4,
    amplitude: float = 0.25,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Measure a scenario's robot under its layer and senses; of JSON types, lengths in m, times in s.

    Args:
        scenario: gives robot, layer, senses, gain, and the pushes of the stepping episodes.
        seeds: episodes of each kind, at least 2, with the scenario's seed and those that follow it.
        amplitude: peak of the offset of the ZMP, as a share of the way from the middle of the feet to the soles' edge.
        progress: called with the share of the work that is done.

    Raises:
        InputError: if the controller has no regulator's gain, or the robot does not stand while it is swayed.
    """
    entry = CONTROLLERS.entry(scenario.controller.name)
    if "gain" not in entry.options.model_fields or entry.at_joints:
        raise InputError(f"controller: {entry.short!r} has no gain of a regulator, so there is nothing to identify")
    robot = load_robot(scenario.robot)
    pendulum = Pendulum(robot.omega, scenario.timing.control)
    designed = scenario.gain.of(pendulum)
    peaks = amplitude * _reach(robot)
    standing = scenario.model_copy(
        update={"pushes": (), "duration": Sway.duration(), "controller": Choice(name="regulator")}
    )
    cases = {"as given": standing}
    if not scenario.sensing.is_true:
        cases["exact"] = standing.model_copy(update={"sensing": Sensing()})
    pushed = len(scenario.pushes) > 0 and entry.short != "regulator"
    total = len(cases) * seeds * Sway.duration() + (seeds * scenario.duration if pushed else 0.0)
    done = 0.0

    def advance(time: float) -> None:
        if progress is not None:
            progress((done + time) / total)

    found: dict[str, Any] = {}
    for name, case in cases.items():
        runs = []
        for seed in _seeds(scenario, seeds):
            runs.append(sway(case.model_copy(update={"seed": seed}), robot, peaks, advance))
            done += Sway.duration()
        found[name] = _standing(runs, pendulum.dt)
    steps = None
    if pushed:
        traces = []
        for seed in _seeds(scenario, seeds):
            result = run_episode(
                scenario.model_copy(update={"seed": seed}), robot=robot, polygons=False, progress=advance
            )
            traces.append((result.trace, result.outcome.time_of_fall))
            done += scenario.duration
        steps = _stepping(traces, stiffness(pendulum, designed))
    given = found["as given"]
    k = float(np.mean([given["axes"][axis]["gain"]["realised"]["mean"] for axis in AXES]))
    errors = {"none": 0.0, "standing": round(_most(given["to_withstand"]), _DIGITS)}
    if steps is not None and steps["steps"]:
        errors["stepping"] = round(_most(steps["to_withstand"]), _DIGITS)
    return {
        "scenario": scenario.description,
        "robot": robot_facts(robot),
        "layer": None if scenario.world == "pendulum" else scenario.whole_body.short,
        "sensing": scenario.sensing.words,
        "dt": pendulum.dt,
        "seeds": list(_seeds(scenario, seeds)),
        "peaks": peaks.tolist(),
        "frequencies": list(FREQUENCIES),
        "gain": {"name": designed.name, "designed": stiffness(pendulum, designed), "identified": k},
        "standing": found,
        "stepping": steps,
        "zmp_error": errors["standing"],
        "zmp_error_stepping": errors.get("stepping"),
        "sets": sets_left(robot, pendulum, designed, k, errors),
    }


def _seeds(scenario: Scenario, count: int) -> range:
    return range(scenario.seed, scenario.seed + count)


def _reach(robot: Robot) -> Array:
    """(2,) way from the middle of the feet to the nearer edge of the support along each axis [m]."""
    polygon, middle = stand(robot)
    facing = np.abs(polygon.M) > _EDGE_ON
    room = (polygon.v - polygon.M @ middle)[:, None]
    return np.where(facing, room / np.maximum(np.abs(polygon.M), _EDGE_ON), np.inf).min(axis=0)


def _most(errors: dict[str, Any]) -> float:
    """The 95 % quantile along the worse axis [m]."""
    return max(float(errors[axis]["q95"]) for axis in AXES)


def _standing(runs: Sequence[Standing], dt: float) -> dict[str, Any]:
    """What the swayed episodes of all seeds say."""
    axes = {axis: _axis([run.windows[i] for run in runs], dt) for i, axis in enumerate(AXES)}
    sights = [run.sight for run in runs if run.sight is not None]
    return {
        "axes": axes,
        "error": _by_axis(np.concatenate([run.error for run in runs])),
        "to_withstand": _by_axis(np.concatenate([run.to_withstand for run in runs])),
        "dcm_error": _length(np.concatenate(sights)) if sights else None,
    }


def _axis(windows: Sequence[Window], dt: float) -> dict[str, Any]:
    """Of one axis: responses at each frequency, gains, and what the response does not explain."""
    body, loop, rest, gains = [], [], [], []
    for window in windows:
        realised, unexplained = lines(window.time, window.realised, FREQUENCIES)
        command, _ = lines(window.time, window.command, FREQUENCIES)
        law, _ = lines(window.time, window.law, FREQUENCIES)
        body.append(transfer(realised, command, FREQUENCIES))
        loop.append(transfer(realised, law, FREQUENCIES))
        rest.append(unexplained)
        gains.append(feedback_gain(window, dt))
    return {
        "body": _over_seeds(body),
        "loop": _over_seeds(loop),
        "residual": spread(np.concatenate(rest)),
        "gain": {
            "commanded": mean_of([one[0] for one in gains]),
            "realised": mean_of([one[1] for one in gains]),
        },
    }


def _over_seeds(responses: Sequence[tuple[Array, Array]]) -> list[dict[str, Any]]:
    return [
        {
            "frequency": frequency,
            "gain": mean_of([gain[i] for gain, _ in responses]),
            "lag": mean_of([lag[i] for _, lag in responses]),
        }
        for i, frequency in enumerate(FREQUENCIES)
    ]


def _by_axis(error: Array) -> dict[str, Any]:
    """The spread of an error (n, 2) along each axis."""
    return {axis: spread(error[:, i]) for i, axis in enumerate(AXES)}


def _length(error: Array) -> dict[str, float] | None:
    """RMS and peak of the length of an error (n, 2) [m]."""
    found = spread(np.hypot(*error.T))
    return None if found is None else {"rms": found["rms"], "peak": found["largest"]}


def _stepping(traces: Sequence[tuple[Trace, float | None]], k: float) -> dict[str, Any]:
    """What the steps of pushed episodes say, until each fell, if it did.

    The law of a step depends on the step; what an error of the seen DCM does to it is taken to be k times that error.
    """
    errors, sights, means, fell = [], [], [], 0
    for trace, fall in traces:
        fell += fall is not None
        stepping = trace["phase"] == Phase.STEPPING.value
        # The ZMP measured at a landing is of the next stance already.
        at = np.flatnonzero(stepping[:-1] & stepping[1:] & (trace.time[1:] < (np.inf if fall is None else fall)))
        error = pair(trace, "zmp")[at + 1] - pair(trace, "zmp_cmd")[at]
        errors.append(error)
        for step in np.split(error, np.flatnonzero(np.diff(at) > 1) + 1):
            if len(step := step[np.isfinite(step).all(axis=1)]):
                means.append(np.abs(step.mean(axis=0)))
        if "dcm_error_x" in trace.units:
            sights.append(pair(trace, "dcm_error")[at])
    error = np.concatenate(errors)
    found: dict[str, Any] = {"episodes": len(traces), "fell": fell, "ticks": len(error), "steps": len(means)}
    if not means:
        return found | {"error": None, "to_withstand": None, "mean_of_step": None, "dcm_error": None}
    sight = np.concatenate(sights) if sights else None
    return found | {
        "error": _by_axis(error),
        "to_withstand": _by_axis(error if sight is None else error + k * sight),
        "mean_of_step": {axis: float(np.max(means, axis=0)[i]) for i, axis in enumerate(AXES)},
        "dcm_error": None if sight is None else _length(sight),
    }
