"""What the controllers see of the world, tick by tick: the state as it is, late and noisy, or as it is estimated."""

from __future__ import annotations

from typing import Protocol

from controllers.interface import Observation
from controllers.registry import ESTIMATORS
from scenarios.schema import Scenario
from sim.episode.guard import Guard
from sim.episode.plant import HumanoidPlant, Plant
from sim.sensing.late_state import LateState
from sim.sensing.sensors import Sensors


class Senses(Protocol):
    """Shows the controllers one episode."""

    def see(self, truth: Observation, tick: int) -> Observation:
        """What they see of the true state at the beginning of a tick; to be called once a tick."""


def make_senses(scenario: Scenario, plant: Plant) -> Senses:
    """The senses of a scenario, for one episode of a plant that stands at its start."""
    if isinstance(plant, HumanoidPlant):
        plant.world.physics.watch(None)
        return _Estimated(scenario, plant) if scenario.sensing.estimates else _True(scenario, plant)
    return _True(scenario, plant)


class _True:
    """The true state, late and noisy if the scenario says so."""

    def __init__(self, scenario: Scenario, plant: Plant) -> None:
        self._late = late = LateState(scenario)
        if isinstance(plant, HumanoidPlant) and late.phase:
            substeps, world = scenario.timing.substeps, plant.world

            def take(step: int) -> None:
                if step % substeps == late.phase:
                    late.take(world.observe())

            world.physics.watch(take)

    def see(self, truth: Observation, tick: int) -> Observation:
        """See `Senses`."""
        return self._late.see(truth)


class _Estimated:
    """What an estimator makes of the sensors."""

    def __init__(self, scenario: Scenario, plant: HumanoidPlant) -> None:
        self._plant, self._substeps = plant, scenario.timing.substeps
        physics, choice = plant.world.physics, scenario.sensing.who
        self._sensors = Sensors(scenario, plant.robot, physics.model.ptr, physics.data.ptr)
        assert plant.estimator is not None
        self._estimator = plant.estimator
        self._guard = Guard(f"estimator {choice.short!r}", foreign=choice.name not in ESTIMATORS.shipped)
        physics.watch(self._sensors.sample)

    def see(self, truth: Observation, tick: int) -> Observation:
        """See `Senses`; before the first tick the robot has stood long enough for its state to be known."""
        if not tick:
            self._guard.ask(self._estimator.reset, 0, truth)
            self._sensors.sample(0)
        readings = self._sensors.arrived(tick * self._substeps, truth.time)
        seen = self._guard.ask(self._estimator.estimate, tick, readings, self._plant.targets, truth.time)
        return self._guard.check_observation(seen, tick, truth)
