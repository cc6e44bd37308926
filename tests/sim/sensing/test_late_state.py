"""The true state, late and noisy, as the controllers see it without sensors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from controllers.interface import Observation
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.humanoid_world import HumanoidWorld
from sim.episode.plant import HumanoidPlant
from sim.sensing.late_state import LateState
from tests.sim.episode.test_disturbance import run

ROBOT = load_robot("utmu2")


def scenario(**sensing: Any) -> Scenario:
    return load("quiet", {"duration": 0.3, "sensing": sensing, "pushes": []})


def observations(count: int) -> list[Observation]:
    first = HumanoidWorld(scenario(), ROBOT).observe()
    return [replace(first, time=tick * 0.002, cog=first.cog + tick) for tick in range(count)]


def test_the_exact_state_is_passed_on_as_it_is() -> None:
    observation = observations(1)[0]
    assert LateState(scenario()).see(observation) is observation


def test_latency_is_of_that_many_ticks() -> None:
    late = LateState(scenario(latency=0.006))
    true = observations(6)
    seen = [late.see(observation) for observation in true]
    assert [true.index(next(t for t in true if t.cog is s.cog)) for s in seen] == [0, 0, 0, 0, 1, 2]
    assert [s.time for s in seen] == [t.time for t in true]


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 5])
def test_an_episode_sees_the_state_of_so_many_physics_steps_ago(steps: int) -> None:
    asked = load("quiet", {"duration": 0.3, "sensing": {"latency": steps / 1000}})
    plant = HumanoidPlant(asked, ROBOT)
    episode = Episode(asked, plant)
    truth = {0: plant.observe()}
    physics, step = plant.world.physics, plant.world.physics.step

    def stepped(count: int = 1) -> None:
        for _ in range(count):
            step(1)
            truth[physics.steps_done] = plant.observe()

    physics.step = stepped  # type: ignore[method-assign]
    controller = make_controller(asked, ROBOT)
    for tick in range(12):
        seen = episode.observe()
        expected = truth[max(0, 2 * tick - steps)]
        np.testing.assert_array_equal(seen.cog, expected.cog)
        np.testing.assert_array_equal(seen.configuration, expected.configuration)
        assert seen.time == pytest.approx(0.002 * tick)
        episode.begin(controller.command(seen))  # type: ignore[union-attr]
        plant.step()
        episode.end()


def test_noise_has_its_size_and_its_seed() -> None:
    noisy = scenario(state_noise={"position": 0.01, "velocity": 0.1})
    observation = observations(1)[0]
    late = LateState(noisy)
    seen = [late.see(observation) for _ in range(2000)]
    position = np.array([s.cog - observation.cog for s in seen])
    velocity = np.array([s.cog_velocity - observation.cog_velocity for s in seen])
    # 6000 samples: their standard deviation is known to 1 % (one sigma); 5 % is five sigmas.
    assert position.std() == pytest.approx(0.01, rel=0.05)
    assert velocity.std() == pytest.approx(0.1, rel=0.05)
    np.testing.assert_array_equal(LateState(noisy).see(observation).cog, seen[0].cog)
    other = LateState(noisy.model_copy(update={"seed": 1}))
    assert (other.see(observation).cog != seen[0].cog).all()


@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_late_and_noisy_episode_differs_and_repeats_bit_for_bit(world: str) -> None:
    sensing = {"latency": 0.004, "state_noise": {"position": 0.001, "velocity": 0.01}}
    plain, first, again = run(world=world), run(world=world, sensing=sensing), run(world=world, sensing=sensing)
    assert first.trace.values.tobytes() == again.trace.values.tobytes()
    assert plain.trace["cog_y"].tobytes() != first.trace["cog_y"].tobytes()
    assert plain.sight is None
    assert first.sight is not None
    assert first.sight.peak > first.sight.rms > 0.001
    np.testing.assert_allclose(first.trace["seen_cog_y"][2:], first.trace["cog_y"][:-2], atol=0.006)
