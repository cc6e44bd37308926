"""The QP of the inverse dynamics, solved by ourselves, against placo's own answer to it.

But for one weight, which placo has no place for: it is left out where the two are compared, and tested by itself.
"""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np
import pytest

from controllers.whole_body import dynamics_tasks
from controllers.whole_body.inverse_dynamics import DynamicsOptions, DynamicsWholeBody
from models.robot import Robot, load_robot
from tests.controllers.recorded_layer import Tick, recorded

Array = np.ndarray


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


@pytest.fixture(scope="module")
def ticks() -> list[Tick]:
    """A push that takes a step: standing, swing, landing."""
    changes: dict[str, Any] = {
        "duration": 1.2,
        "whole_body": {"name": "dynamics", "solver": "placo"},
        "pushes": [{"start": 0.2, "direction": 90.0, "delta_v": 0.5}],
    }
    return recorded(changes)[1]


def torques(layer: DynamicsWholeBody, ticks: list[Tick]) -> Array:
    layer.reset()
    return np.array([layer.targets(tick.seen, tick.command).torque for tick in ticks])


def test_it_answers_as_placo_does_while_standing_swinging_and_landing(
    robot: Robot, ticks: list[Tick], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    solve = daqp.solve

    def counted(*problem: Any, **settings: Any) -> Any:
        asked.append(1)
        return solve(*problem, **settings)

    monkeypatch.setattr(dynamics_tasks, "YAW_MOMENT_WEIGHT", 0.0)
    own = DynamicsWholeBody(robot, 0.002, DynamicsOptions())
    monkeypatch.setattr(own._placo, "torque", lambda *_: pytest.fail("it needed placo"))
    monkeypatch.setattr("controllers.whole_body.torque_program.daqp.solve", counted)
    found = torques(own, ticks)
    swinging = sum(not tick.stands for tick in ticks)
    assert 50 < swinging < len(ticks) - 200
    # Each swing tick, and standing ones in which a limit counts, but not all: either way is taken.
    assert swinging < len(asked) < len(ticks)
    # The conditioning of either solver's matrix, about 1e8, leaves some 1e-8 of torques of some N m; 5e-8 was found.
    assert np.abs(found - [tick.targets.torque for tick in ticks]).max() < 1e-6


def test_an_answer_depends_on_nothing_that_went_before(robot: Robot, ticks: list[Tick]) -> None:
    layer = DynamicsWholeBody(robot, 0.002, DynamicsOptions())
    first = torques(layer, ticks)
    assert np.array_equal(first, torques(layer, ticks))
    backwards = torques(layer, ticks[::-1])
    assert np.array_equal(first, backwards[::-1])


def test_placo_is_asked_where_it_finds_no_answer(
    robot: Robot, ticks: list[Tick], monkeypatch: pytest.MonkeyPatch
) -> None:
    tick = next(tick for tick in ticks if not tick.stands)
    layer = DynamicsWholeBody(robot, 0.002, DynamicsOptions())
    none: Any = (np.zeros(26), 0.0, -1, {})
    monkeypatch.setattr("controllers.whole_body.torque_program.daqp.solve", lambda *_, **__: none)
    targets = layer.targets(tick.seen, tick.command)
    assert not targets.solver_failed
    # Placo's answer in the episode itself; it keeps nothing that counts, but for rounding.
    assert targets.torque == pytest.approx(tick.targets.torque, abs=1e-9)


def test_a_sole_that_stands_alone_is_asked_for_little_moment_about_the_vertical(
    robot: Robot, ticks: list[Tick], monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = daqp.solve

    def moments(weight: float) -> Array:
        found: list[float] = []

        def watched(*problem: Any, **settings: Any) -> Any:
            answer = solve(*problem, **settings)
            found.append(abs(answer[0][-1]))  # the last of one sole's wrench
            return answer

        monkeypatch.setattr(dynamics_tasks, "YAW_MOMENT_WEIGHT", weight)
        layer = DynamicsWholeBody(robot, 0.002, DynamicsOptions())
        monkeypatch.setattr("controllers.whole_body.torque_program.daqp.solve", watched)
        torques(layer, [tick for tick in ticks if not tick.stands])
        return np.array(found)

    dear, free = moments(dynamics_tasks.YAW_MOMENT_WEIGHT), moments(0.0)
    assert len(dear) == len(free) > 50
    # [N m]: medians of 0.08 and 0.84 were found
    assert np.median(dear) < 0.25 * np.median(free)
