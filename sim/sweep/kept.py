"""What a worker keeps from one episode to the next, for it costs more to make than a short episode takes."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from controllers.interface import WholeBodyLayer
from controllers.registry import CONTROLLERS, ESTIMATORS, LAYERS
from controllers.senses import Estimator
from models.robot import Robot
from scenarios.schema import Scenario
from sim.episode.build import layer_of, make_estimator, make_layer
from sim.episode.episode import EpisodeResult, run_episode
from sim.episode.humanoid_world import HumanoidWorld, compiled_in
from sim.results.push_size import robot_named

KEPT = 8
"""So many whole-body layers, estimators and worlds are kept, each."""
WARM_TICKS = 12
"""Control ticks of an episode that only warms up: a push of two, and time to answer it."""
T = TypeVar("T")
_layers: dict[Hashable, WholeBodyLayer | None] = {}
_estimators: dict[Hashable, Estimator | None] = {}
_worlds: dict[Hashable, HumanoidWorld] = {}
_warm: set[Hashable] = set()


def run_kept(scenario: Scenario) -> EpisodeResult:
    """Run a scenario with what is kept; its bits are those of a process that has run nothing before."""
    robot = robot_named(scenario.robot)
    try:
        return run_episode(
            scenario,
            robot=robot,
            layer=layer_kept(scenario, robot),
            estimator=_estimator(scenario, robot),
            world=_world(scenario, robot),
            polygons=False,
        )
    except BaseException:
        # nobody knows where in a tick they were left
        for known in (_layers, _estimators, _worlds):
            if known:
                known.popitem()
        raise


def warm_up(scenario: Scenario) -> None:
    """Do what is done once in a process for episodes of this kind, unless it has been done: load, compile, cut sets."""
    if (kind := _kind(scenario)) in _warm:
        return
    _warm.add(kind)
    # What is wrong with it, its own episode tells.
    with suppress(Exception):
        run_kept(_brief(scenario))


def warm_up_shipped(scenarios: Iterable[Scenario]) -> None:
    """The same of scenarios whose classes are all Okiagari's own: others might end this process."""
    for scenario in scenarios:
        if is_shipped(scenario):
            warm_up(scenario)


def _brief(scenario: Scenario) -> Scenario:
    """A few ticks of a scenario, with its first push at once."""
    dt = scenario.timing.control
    pushes = [push.model_copy(update={"start": 0.0, "duration": 2 * dt}) for push in scenario.pushes[:1]]
    return scenario.model_copy(update={"duration": WARM_TICKS * dt, "pushes": tuple(pushes)})


def _kind(scenario: Scenario) -> Hashable:
    """What decides what is loaded and compiled."""
    layer = layer_of(scenario)
    estimator = scenario.sensing.who.name if scenario.sensing.estimates else None
    told = scenario.stepping.model_dump(), scenario.controller.model_dump(), scenario.sensing.preset
    names = scenario.world, scenario.robot, layer and layer.name, estimator
    return *names, json.dumps(told, sort_keys=True, default=str)


def is_shipped(scenario: Scenario) -> bool:
    """Whether all classes that a scenario names are Okiagari's own."""
    layer, sensing = layer_of(scenario), scenario.sensing
    return (
        scenario.controller.name in CONTROLLERS.shipped
        and (layer is None or layer.name in LAYERS.shipped)
        and (not sensing.estimates or sensing.who.name in ESTIMATORS.shipped)
    )


def _world(scenario: Scenario, robot: Robot) -> HumanoidWorld | None:
    """A compiled world, made once for each robot and all that is compiled in; None for the pendulum."""
    if scenario.world != "humanoid":
        return None
    key = robot.sha256, compiled_in(scenario)
    return _kept(_worlds, key, lambda: HumanoidWorld(scenario, robot))


def layer_kept(scenario: Scenario, robot: Robot) -> WholeBodyLayer | None:
    """A whole-body layer, made once for each kind, robot and period; None if there is nothing for it to do."""
    # placo does not give back a solver's memory, 0.8 MB each: a worker must not make one an episode.
    if (choice := layer_of(scenario)) is None:
        return None
    key = json.dumps([scenario.robot, robot.sha256, choice.model_dump(), scenario.timing.control])
    return _kept(_layers, key, lambda: make_layer(scenario, robot))


def _estimator(scenario: Scenario, robot: Robot) -> Estimator | None:
    """The same of an estimator."""
    if not scenario.sensing.estimates:
        return None
    sensing = scenario.sensing
    figures = sensing.joint_figures.model_dump(), sensing.imu_figures.model_dump()
    told: list[Any] = [scenario.robot, robot.sha256, sensing.who.model_dump(), sensing.at_drive, *figures]
    key = json.dumps([*told, scenario.timing.control])
    return _kept(_estimators, key, lambda: make_estimator(scenario, robot))


def _kept(known: dict[Hashable, T], key: Hashable, make: Callable[[], T]) -> T:
    if key in known:
        known[key] = known.pop(key)  # the one that was asked for last goes last
        return known[key]
    if len(known) >= KEPT:
        known.pop(next(iter(known)))
    known[key] = make()
    return known[key]
