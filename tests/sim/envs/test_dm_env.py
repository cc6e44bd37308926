"""The episode as a dm_env environment: specs that hold, and the very same trace."""

from __future__ import annotations

import itertools

import dm_env
import numpy as np
import pytest
from absl.testing import absltest
from dm_env import test_utils

from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.envs.dm_env import (
    ActionError,
    balance_action,
    balance_command,
    make_environment,
    observation_from_dict,
)
from sim.episode.build import make_controller, make_layer
from sim.episode.episode import run_episode
from sim.record.outcome import Result

SHORT = load("quiet", {"duration": 0.2})


class TestConformance(test_utils.EnvironmentTestMixin, absltest.TestCase):
    """dm_env's own conformance tests, with actions that stand still."""

    def make_object_under_test(self):
        return make_environment(SHORT)

    def make_action(self):
        return _standing()

    def make_action_sequence(self):
        return itertools.repeat(_standing(), 120)


def _standing() -> np.ndarray:
    robot = load_robot("utmu2")
    action = np.zeros(26)
    for i, side in enumerate(("left", "right")):
        x, y, yaw = robot.sole_stance[side]
        action[2 + 12 * i] = 1.0
        action[3 + 12 * i : 5 + 12 * i] = x, y
        action[12 + 12 * i] = yaw
    return action


@pytest.mark.parametrize("kind", ["balance", "joints"])
def test_driven_through_it_the_supervisor_gives_the_same_trace_bit_for_bit(kind) -> None:
    scenario = load("push_back", {"sensing": {"latency": 0.002}})
    run = run_episode(scenario, polygons=False)
    environment = make_environment(scenario, kind)
    controller, layer = make_controller(scenario, load_robot("utmu2")), make_layer(scenario, load_robot("utmu2"))
    step = environment.reset()
    for _ in range(len(run.trace)):
        seen = observation_from_dict(step.observation)
        command = controller.command(seen)
        if kind == "balance":
            action = balance_action(command)
        else:
            targets = layer.targets(seen, command)
            action = np.concatenate([targets.position, targets.velocity, targets.torque])
        step = environment.step(action)
    result = environment.task.episode.result()
    # Joint targets say neither a ZMP nor which foot is to stand.
    unsaid = {"zmp_cmd_x", "zmp_cmd_y", "left_stance", "right_stance", "phase", "steps"} if kind == "joints" else set()
    # A controller's word is not known to the environment; and its last tick is acted on.
    unsaid |= {"regulator_slack", "tracking_slack", "solver_failed", "torque_use", "speed_use", "saturated"}
    assert result.trace.channels == run.trace.channels
    for channel in run.trace.channels:
        if channel not in unsaid:
            assert np.array_equal(result.trace[channel], run.trace[channel], equal_nan=True), channel
    assert result.outcome.result is run.outcome.result is Result.RECOVERED


def test_a_fall_ends_the_episode_and_the_next_step_begins_anew() -> None:
    environment = make_environment(load("quiet", {"duration": 3.0}), "joints")
    step = environment.reset()
    limp = np.zeros(environment.action_spec().shape)
    while not step.last():
        step = environment.step(limp)
    assert (step.discount, step.reward) == (0.0, 0.0)
    assert environment.step(limp).step_type is dm_env.StepType.FIRST


def test_the_time_limit_ends_the_episode_without_a_fall() -> None:
    environment = make_environment(SHORT)
    step, steps = environment.reset(), 0
    while not step.last():
        step, steps = environment.step(_standing()), steps + 1
    assert steps == SHORT.ticks
    assert (step.discount, step.reward) == (1.0, 1.0)


@pytest.mark.parametrize("spoil", [lambda a: a[:-1], lambda a: a * np.nan, lambda a: a + 5.0])
def test_an_action_that_does_not_fit_is_refused(spoil) -> None:
    environment = make_environment(SHORT)
    environment.reset()
    with pytest.raises(ActionError, match="action"):
        environment.step(spoil(_standing()))


def test_observations_and_commands_survive_the_journey() -> None:
    environment = make_environment(SHORT)
    observation = observation_from_dict(environment.reset().observation)
    controller = make_controller(SHORT, load_robot("utmu2"))
    command = controller.command(observation)
    assert np.array_equal(balance_action(balance_command(balance_action(command))), balance_action(command))
    assert make_layer(SHORT, load_robot("utmu2")).targets(observation, command).torque.any()


def test_a_pendulum_has_none() -> None:
    scenario = Scenario.model_validate(SHORT.as_dict() | {"world": "pendulum"})
    with pytest.raises(Exception, match="pendulum"):
        make_environment(scenario)
