"""One episode of a robot that stands and is swayed, cut down to what is measured in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.baselines.regulator_alone import RegulatorAlone
from controllers.pendulum import Pendulum
from controllers.supervisor.momentum_state import momentum_state
from models.errors import InputError
from models.robot import Robot
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode, run_episode
from sim.identify.excitation import Sway, Swayed
from sim.identify.response import Window
from sim.record.outcome import Result
from sim.record.trace import Trace

Array = NDArray[np.float64]
AXES = ("x", "y")
# Margin of times of ticks [s].
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """What one seed gave.

    Attributes:
        windows: one for each axis.
        error: (n, 2) realised less commanded ZMP, in both windows [m].
        to_withstand: (n, 2) realised ZMP less that of the law at the true state [m].
        sight: (n, 2) seen less true DCM [m]; None if the true state is seen.
    """

    windows: tuple[Window, Window]
    error: Array
    to_withstand: Array
    sight: Array | None


def pair(trace: Trace, name: str) -> Array:
    """(n, 2) channels `name_x` and `name_y`."""
    return np.column_stack([trace[f"{name}_{axis}"] for axis in AXES])


def sway(scenario: Scenario, robot: Robot, peaks: Array, progress: Callable[[float], None]) -> Standing:
    """Sway a robot for an episode.

    Args:
        scenario: with the controller `regulator`, unpushed, and as long as the sway.
        robot: whom the scenario names.
        peaks: (2,) of the sway along each axis [m].
        progress: called now and then with the simulated time [s].

    Raises:
        InputError: if it falls.
    """
    inner = make_controller(scenario, robot)
    assert isinstance(inner, RegulatorAlone)
    delay = round(scenario.sensing.latency / scenario.timing.control)
    controller = Swayed(inner, Sway.drawn(scenario.seed, peaks), delay)
    watch = _Watch(robot, spin=scenario.stepping.angular_momentum)
    result = run_episode(
        scenario, controller=controller, robot=robot, polygons=False, progress=progress, on_tick=watch.see
    )
    trace, outcome = result.trace, result.outcome
    if outcome.result is Result.FELL:
        way = " and ".join(f"{1e3 * peak:.2g} mm along {axis}" for peak, axis in zip(peaks, AXES, strict=True))
        raise InputError(
            f"it falls at {outcome.time_of_fall:.2f} s while its ZMP is swayed by up to {way}; "
            f"nothing can be identified of a robot that does not stand ({scenario.sensing.words}, seed {scenario.seed})"
        )
    zmp, command, offset = pair(trace, "zmp"), pair(trace, "zmp_cmd"), np.array(controller.offsets)
    states, middles = np.array(watch.states), np.array(watch.middles)
    pendulum = Pendulum(robot.omega, scenario.timing.control)
    resting = np.column_stack([middles[:, 0], np.zeros(len(middles)), middles[:, 1], np.zeros(len(middles))])
    law = middles - (states - resting) @ scenario.gain.of(pendulum).F.T + offset
    dcm = states[:, 0::2] + states[:, 1::2] / robot.omega
    windows, rows = [], []
    for axis in (0, 1):
        begin, end = Sway.window(axis)
        at = np.flatnonzero((trace.time >= begin - _ROUNDING) & (trace.time < end - _ROUNDING))
        at = at[at + 1 < len(trace)]
        rows.append(at)
        windows.append(
            Window(
                time=trace.time[at],
                law=law[at, axis],
                command=command[at, axis],
                # What the command of a tick came to is measured when the next begins.
                realised=zmp[at + 1, axis],
                offset=offset[at, axis],
                dcm=dcm[at, axis],
            )
        )
    at = np.concatenate(rows)
    return Standing(
        windows=(windows[0], windows[1]),
        error=zmp[at + 1] - command[at],
        to_withstand=zmp[at + 1] - law[at],
        sight=None if scenario.sensing.is_true else pair(trace, "dcm_error")[at],
    )


class _Watch:
    """Notes, tick by tick, the true state (4,) that the law is meant for, and the middle (2,) of the feet."""

    def __init__(self, robot: Robot, *, spin: bool) -> None:
        self._robot, self._spin = robot, spin
        self.states: list[Array] = []
        self.middles: list[Array] = []

    def see(self, episode: Episode) -> None:
        truth = episode.truth
        self.states.append(momentum_state(truth, self._robot) if self._spin else truth.balance_state())
        self.middles.append(0.5 * (truth.feet["left"].position + truth.feet["right"].position)[:2])
