"""The episodes of a suite: names, seeds and scenarios, each from its own parameters alone."""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from controllers.registry import short
from models.errors import InputError
from models.robot import Robot
from scenarios.catalogue import check_against
from scenarios.choice import REGISTRIES
from scenarios.error_messages import first_error
from scenarios.files import robot_beside
from scenarios.push import FASTEST, Push
from scenarios.random_pushes import Random
from scenarios.schema import Scenario
from scenarios.suite import SIZES, Suite
from scenarios.suite_catalogue import START, LoadedSuite
from scenarios.variants import WORLD, changed, parameter_of
from sim.results.push_size import robot_named
from sim.sweep.naming import episode_name, episode_seed
from sim.sweep.pushes import DIGITS, canonical, first_push, sized, stream, train_pushes

# Who answers the push does not change what is drawn: controllers are compared push by push.
_WHO = ("world", "controller", "whole_body")
# Nor do senses and the true body: they are compared push by push, too.
_UNDRAWN = (*_WHO, "sensing", "body_error")
_SCENARIO = ("robot", "world", "controller", "whole_body")
_TABLES = ("train", "first")
_PUSH = ("body", "direction", "delta_v", "impulse", "duration", "start", "height")
# Sets what a replica draws apart from what else is drawn with the episode's seed.
_STREAM = 2


@dataclass(frozen=True, kw_only=True)
class PlannedEpisode:
    """One episode of a suite.

    Attributes:
        name: short hash of the suite's seed and the parameters.
        suite: name of the suite.
        series: what adaptive series it belongs to; else its own name.
        seed: of the scenario.
        parameters: what was asked, as in the suite; one of delta_v, impulse and relative, `direction` unless the base
            scenario gives a vector, but neither of a `train`, whose pushes differ; `first` if there is a push before
            it; `variant`, with the `changes` that are no parameters themselves, if there are variants.
    """

    name: str
    suite: str
    series: str
    seed: int
    parameters: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Series:
    """Episodes of which a later one may depend on how those before it ended.

    Attributes:
        name: the same for the same parameters.
        episodes: in order.
        stop_after: so many failures in a row end it; None for never.
    """

    name: str
    episodes: tuple[PlannedEpisode, ...]
    stop_after: int | None = None


def plan(loaded: LoadedSuite) -> list[Series]:
    """All episodes of a suite, in series that may be run side by side.

    Raises:
        InputError: if one of them is impossible.
    """
    suite, adaptive, size = loaded.suite, loaded.suite.adaptive, loaded.suite.size_axis or ""
    check = _checker(loaded)
    groups: dict[str, list[PlannedEpisode]] = {}
    for asked, design in itertools.product(_conditions(loaded), _designs(loaded)):
        for replica in range(suite.replicas):
            parameters = asked | {"replica": replica} | design
            name = episode_name(suite.seed, parameters)
            alike = {key: value for key, value in parameters.items() if key != size}
            if adaptive is None:
                series = name
            elif adaptive.each_replica:
                series = episode_name(suite.seed, alike)
            else:
                series = episode_name(suite.seed, {key: value for key, value in alike.items() if key != "replica"})
            drawn = asked | {"replica": replica}
            seed = episode_seed(suite.seed, {key: value for key, value in drawn.items() if key not in _UNDRAWN})
            episode = PlannedEpisode(name=name, suite=loaded.name, series=series, seed=seed, parameters=parameters)
            groups.setdefault(series, []).append(episode)
            check(episode)
    names = [episode.name for group in groups.values() for episode in group]
    assert len(set(names)) == len(names), "two episodes of one name"
    if adaptive is None:
        return [Series(name=name, episodes=tuple(group)) for name, group in groups.items()]
    grown = {
        name: tuple(sorted(group, key=lambda episode: (episode.parameters[size], episode.parameters["replica"])))
        for name, group in groups.items()
    }
    return [Series(name=name, episodes=group, stop_after=adaptive.stop_after) for name, group in grown.items()]


def suite_hash(loaded: LoadedSuite) -> str:
    """Of all that decides which episodes a suite has; two suites of one hash are the same."""
    # What is not given is left out, so that what suites may say one day leaves those that do not say it alike.
    left_out = {"description", "tuned_on", "scenario"}
    content = loaded.suite.model_dump(mode="json", exclude=left_out, exclude_none=True)
    base = loaded.base.as_dict()
    del base["description"]
    return hashlib.sha256(canonical([content, base, dict(loaded.push)])).hexdigest()


def robots(loaded: LoadedSuite) -> dict[str, str]:
    """The robots of a suite: name -> as scenarios name it, which for an own robot is the path of its file.

    Raises:
        InputError: if one cannot be read, or two are called the same.
    """
    suite, found = loaded.suite, dict[str, str]()
    asked = [*(suite.axes.robot or (loaded.base.robot,))]
    asked += [changes["robot"] for changes in (suite.variants or {}).values() if "robot" in changes]
    for full in (robot_beside(loaded.path, name) for name in asked):
        name = _read(loaded, full).name if full.endswith(".xml") else full
        if found.setdefault(name, full) != full:
            raise InputError(f"{loaded.path}: robot: two are called {name!r}; rename one of the files")
    return found


def _called(loaded: LoadedSuite, robot: str) -> str:
    """What tables call a robot that the suite names."""
    full = robot_beside(loaded.path, robot)
    return next(name for name, known in robots(loaded).items() if known == full)


def _conditions(loaded: LoadedSuite) -> Iterator[dict[str, Any]]:
    """What is asked of each episode, replicas apart."""
    suite, base, push = loaded.suite, loaded.base, loaded.push
    plain = Push.model_fields
    always: dict[str, Any] = {"robot": _called(loaded, base.robot if suite.axes.robot is None else suite.axes.robot[0])}
    always |= {"world": base.world}
    always |= {name: getattr(base, name).short for name in REGISTRIES}
    always |= {name: functools.reduce(getattr, field.split("."), base) for name, field in WORLD.items()}
    always |= {name: push.get(name, plain[name].default) for name in ("body", "duration", "height")}
    always |= {"start": push.get("start", START)}
    always |= _beside(suite)
    axes = {
        name: tuple(map(short, values)) if name in REGISTRIES else values for name, values in suite.axes.given().items()
    }
    if "robot" in axes:
        axes["robot"] = tuple(_called(loaded, robot) for robot in axes["robot"])
    drawn = {} if suite.random is None else suite.random.given()
    for name in ("direction", "delta_v", "impulse") if suite.train is None else ():
        given = {*axes, *drawn}
        if name in push and not (given & {*SIZES} if name != "direction" else name in given):
            always[name] = push[name]
    for values in itertools.product(*axes.values()):
        chosen = always | dict(zip(axes, values, strict=True))
        if suite.random is None:
            yield chosen
        else:
            yield from (chosen | _draw(suite.random, suite.seed, i) for i in range(suite.random.count))


def _designs(loaded: LoadedSuite) -> Iterator[dict[str, Any]]:
    """What each variant adds to the parameters: its name, what it replaces of them, and all else that it changes."""
    if loaded.suite.variants is None:
        yield {}
        return
    for variant, changes in loaded.suite.variants.items():
        replaced = {name: value for field, value in changes.items() if (name := parameter_of(field)) is not None}
        replaced |= {name: short(replaced[name]) for name in REGISTRIES if name in replaced}
        replaced |= {"robot": _called(loaded, replaced["robot"])} if "robot" in replaced else {}
        rest = {field: value for field, value in changes.items() if parameter_of(field) is None}
        yield replaced | {"variant": variant, "changes": rest}


def _beside(suite: Suite) -> dict[str, Any]:
    """The pushes that are not those of the axes: another train makes another episode."""
    return {name: part.model_dump() for name in _TABLES if (part := getattr(suite, name)) is not None}


def _draw(random: Random, seed: int, number: int) -> dict[str, float]:
    """The values of one drawn push, each from a stream of its own: another range changes no other value."""
    spans = random.given().items()
    return {name: round(float(stream(seed, number, name).uniform(*span)), DIGITS) for name, span in spans}


def scenario_of(loaded: LoadedSuite, episode: PlannedEpisode) -> Scenario:
    """The scenario of an episode.

    Raises:
        InputError: if its parameters do not fit together.
    """
    suite, replica, parameters = loaded.suite, loaded.suite.replica, episode.parameters
    rng = np.random.default_rng([episode.seed, _STREAM])
    later, turned = rng.uniform(-1.0, 1.0, 2)
    push = dict(loaded.push)
    if "direction" in parameters or suite.train is not None:
        push.pop("vector", None)
        push.pop("direction", None)
    if {*SIZES} & parameters.keys() or suite.train is not None:
        push.pop("delta_v", None)
        push.pop("impulse", None)
    push |= {name: parameters[name] for name in _PUSH if name in parameters}
    if "relative" in parameters:
        push |= sized(parameters["direction"], parameters["relative"], _robot(loaded, parameters))
    start = push["start"] + parameters["replica"] * replica.shift + replica.time * later
    push["start"] = max(0.0, round(start, DIGITS))
    if "direction" in push:
        push["direction"] = round(push["direction"] + replica.direction * turned, DIGITS)
    pushes = [push]
    if suite.train is not None:
        pushes = train_pushes(suite, push, parameters["replica"], _robot(loaded, parameters))
    elif suite.first is not None:
        pushes = [first_push(suite, push, parameters, _robot(loaded, parameters)), push]
    fields = loaded.base.as_dict() | {"world": parameters["world"]}
    for name in REGISTRIES:
        # The base's options are of the base's class.
        if parameters[name] != getattr(loaded.base, name).short:
            fields[name] = loaded.classes(name)[parameters[name]]
    given = {field: value for name, field in WORLD.items() if (value := parameters[name]) is not None}
    fields = changed(fields, given)
    fields["variation"] = {"pose": replica.pose} if replica.pose is not None else fields["variation"]
    fields = changed(fields, parameters.get("changes", {}))
    # The last row of a trace is one tick before the end, and it is that row which must be late enough.
    end = pushes[-1]["start"] + pushes[-1]["duration"]
    fields["duration"] = round(end + suite.after + 2 * fields["timing"]["control"], DIGITS)
    fields |= {"seed": episode.seed, "pushes": pushes, "description": f"{loaded.name}: {suite.description}"}
    fields["robot"] = _robot_name(loaded, parameters)
    try:
        return Scenario.model_validate(fields, context={"folder": loaded.path.parent})
    except ValidationError as error:
        raise InputError(f"{loaded.path}: {_within(parameters)}{first_error(error, Scenario)}") from None


def _within(parameters: Mapping[str, Any]) -> str:
    """Where in the suite's file an episode's scenario comes from, to begin a message with."""
    return f'variants."{parameters["variant"]}".' if "variant" in parameters else ""


def _robot_name(loaded: LoadedSuite, parameters: Mapping[str, Any]) -> str:
    return robots(loaded)[parameters["robot"]]


def _robot(loaded: LoadedSuite, parameters: Mapping[str, Any]) -> Robot:
    return _read(loaded, _robot_name(loaded, parameters))


def _read(loaded: LoadedSuite, robot: str) -> Robot:
    try:
        return robot_named(robot)
    except InputError as error:
        raise InputError(f"{loaded.path}: {error}") from None


def _checker(loaded: LoadedSuite) -> Callable[[PlannedEpisode], None]:
    """Checks whether parameters fit together and to their robot, once for each that matters to that."""
    known = set()

    def check(episode: PlannedEpisode) -> None:
        if (key := (*_fitting(episode.parameters), _is_too_hard(loaded, episode.parameters))) in known:
            return
        known.add(key)
        scenario = scenario_of(loaded, episode)
        try:
            robot = robot_named(scenario.robot)
            check_against(scenario, robot, source=_within(episode.parameters).removesuffix(".") or "scenario")
        except InputError as error:
            raise InputError(f"{loaded.path}: {error}") from None

    return check


def _fitting(parameters: Mapping[str, Any]) -> Iterator[Any]:
    """The parameters that can be at odds with others; each alone has been checked when the suite was read."""
    yield from (parameters.get(name) for name in (*_SCENARIO, *WORLD, "body", "variant"))
    yield bool(parameters.get("height"))


def _is_too_hard(loaded: LoadedSuite, parameters: Mapping[str, Any]) -> bool:
    """Whether an impulse is one that `check_against` refuses for this robot's mass."""
    impulse = parameters.get("impulse")
    return impulse is not None and impulse > FASTEST * _robot(loaded, parameters).mass
