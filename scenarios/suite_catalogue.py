"""Finding suites by name or path, and reading them with their base scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from controllers.registry import ESTIMATORS, LAYERS, short
from models.errors import InputError
from scenarios.catalogue import load
from scenarios.choice import REGISTRIES, Choice
from scenarios.error_messages import first_error
from scenarios.files import find_file, read_toml, robot_beside, shipped_files
from scenarios.push import LONGEST, Push
from scenarios.schema import Scenario, World
from scenarios.suite import SIZES, Suite
from scenarios.variants import CHANGEABLE, DECIDED, changed, parameter_of

START = 1.0
"""When a push begins that neither the axes nor the base scenario give a start [s]."""


@dataclass(frozen=True, kw_only=True)
class LoadedSuite:
    """A suite with its base scenario.

    Attributes:
        name: of the file.
        path: of the file.
        text: of the file.
        suite: what it says.
        base: the scenario that its episodes vary, without its push.
        push: what its push says.
        only: the world that it is run in instead of its own; None if that is as the file says.
        options: of the command line, in its words, which replaced what the file says; but for the world.
    """

    name: str
    path: Path
    text: str
    suite: Suite
    base: Scenario
    push: Mapping[str, Any]
    only: World | None = None
    options: tuple[str, ...] = ()

    def range(self, name: str) -> tuple[float, ...]:
        """The values that a push's `duration` or `start` may have, or the ends of their range [s]."""
        drawn = {} if self.suite.random is None else self.suite.random.given()
        default = START if name == "start" else Push.model_fields[name].default
        always = (self.push.get(name, default),)
        found: tuple[float, ...] = drawn.get(name) or self.suite.axes.given().get(name) or always
        return found

    def classes(self, field: str) -> dict[str, str]:
        """The classes that its episodes name in a field of a scenario: short name -> name as it is looked up.

        Raises:
            InputError: if two of them are called the same.
        """
        folder, known = self.path.parent, REGISTRIES[field]
        asked = self.suite.axes.given().get(field) or (getattr(self.base, field).name,)
        variants = (self.suite.variants or {}).values()
        asked += tuple(value for changes in variants for name, value in changes.items() if parameter_of(name) == field)
        found: dict[str, str] = {}
        for name in (known.absolute(each, folder) for each in asked):
            if found.setdefault(short(name), name) != name:
                raise InputError(f"{self.path}: {field}: two are called {short(name)!r}; rename a file or a class")
        return found

    def sources(self) -> dict[str, str]:
        """What its layers and estimators are made of, and the files that options name: name -> SHA-256.

        Raises:
            InputError: if two files are called the same, or one cannot be read.
        """
        base, found, paths = self.base.as_dict(), dict[str, str](), dict[str, Path]()
        for changes in ({}, *(self.suite.variants or {}).values()):
            scenario = Scenario.model_validate(changed(base, changes), context={"folder": self.path.parent})
            chosen = [(field, registry, getattr(scenario, field)) for field, registry in REGISTRIES.items()]
            chosen.append(("sensing.estimator", ESTIMATORS, scenario.sensing.who))
            for field, registry, choice in chosen:
                for path in choice.files(registry).values():
                    if paths.setdefault(path.name, path) != path:
                        raise InputError(f"{self.path}: {field}: two files are called {path.name!r}; rename one")
                found |= choice.sources(registry)
        for name in self.classes("whole_body").values():
            found |= Choice(name=name).sources(LAYERS)
        return found


def shipped() -> dict[str, Path]:
    """The suites that come with Okiagari: name -> file."""
    return shipped_files("suite")


def load_suite(name: str | Path) -> LoadedSuite:
    """Read and check a suite.

    Args:
        name: a shipped suite's name, or a path to a `.toml` file.

    Raises:
        InputError: if it cannot be read or says something that is not allowed; one line.
    """
    path = find_file("suite", name)
    text, fields = read_toml(path)
    try:
        suite = Suite.model_validate(fields, context={"folder": path.parent})
    except ValidationError as error:
        raise InputError(f"{path}: {first_error(error, Suite)}") from None
    base = _base(suite, path)
    if len(base.pushes) > 1:
        raise InputError(f"{path}: scenario: has {len(base.pushes)} pushes; a suite's base has at most one")
    if base.pushes:
        _check_replaced(suite, base.pushes[0], path)
    push = base.pushes[0].model_dump(mode="json", exclude_none=True) if base.pushes else {}
    base = base.model_copy(update={"pushes": ()})
    loaded = LoadedSuite(name=path.stem, path=path, text=text, suite=suite, base=base, push=push)
    _check_push(loaded)
    _check_variants(loaded)
    return loaded


def in_world(loaded: LoadedSuite, world: World) -> LoadedSuite:
    """The same suite in one world: the same pushes, whatever worlds its file names."""
    axes = loaded.suite.axes.model_copy(update={"world": (world,)})
    return replace(loaded, suite=loaded.suite.model_copy(update={"axes": axes}), only=world)


def with_controllers(loaded: LoadedSuite, controllers: tuple[str, ...]) -> LoadedSuite:
    """The same suite answered by other controllers, named as `controllers.registry.CONTROLLERS` has them."""
    axes = loaded.suite.axes.model_copy(update={"controller": controllers})
    changed_suite = replace(loaded, suite=loaded.suite.model_copy(update={"axes": axes}))
    changed_suite.classes("controller")
    return changed_suite


def _base(suite: Suite, path: Path) -> Scenario:
    if isinstance(suite.scenario, str):
        given = suite.scenario
        try:
            return load(path.parent / given if given.endswith(".toml") else given)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    for field, instead in (("duration", "after"), ("seed", "seed")):
        if field in suite.scenario:
            why = f"{suite.scenario[field]!r} is not allowed; the suite decides it, by its own {instead}"
            raise InputError(f"{path}: scenario.{field}: {why}")
    fields = {"description": suite.description} | suite.scenario
    if isinstance(fields.get("robot"), str):
        fields["robot"] = robot_beside(path, fields["robot"])
    try:
        return Scenario.model_validate(fields, context={"folder": path.parent})
    except ValidationError as error:
        raise InputError(f"{path}: scenario.{first_error(error, Scenario)}") from None


def _check_replaced(suite: Suite, push: Push, path: Path) -> None:
    """The base scenario's push gives what the suite does not; what nobody would run is not passed over in silence."""
    if suite.train is not None:
        raise InputError(f"{path}: scenario: has a push, and the train draws its own; choose a base without pushes")
    if push.torque is not None:
        raise InputError(f"{path}: scenario: pushes with a {push.torque_words}; the pushes of a suite are forces")
    given = {*suite.axes.given(), *(suite.random.given() if suite.random else ())}
    if "direction" in given and push.vector is not None:
        why = f"the base scenario's push goes along a vector, {list(push.vector)}, which none of them is"
        raise InputError(f"{path}: axes.direction: {why}; give only one of them")
    replaced = given | ({"delta_v", "impulse"} if given & {*SIZES} else set())
    if push.model_fields_set <= replaced:
        why = "has a push of which the axes replace everything; choose a base without pushes"
        raise InputError(f"{path}: scenario: {why}")


def _check_end(loaded: LoadedSuite) -> None:
    """The latest push of an episode must leave time to judge it."""
    suite, replica = loaded.suite, loaded.suite.replica
    train = 0.0 if suite.train is None else (suite.train.count - 1) * suite.train.interval
    latest = max(loaded.range("start")) + (suite.replicas - 1) * replica.shift + replica.time + train
    end = latest + max(loaded.range("duration")) + suite.after + 2 * loaded.base.timing.control
    if end > LONGEST:
        why = f"the last push begins as late as {latest:g} s, so that its episode lasts {end:g} s"
        raise InputError(f"{loaded.path}: axes.start: {why}; at most {LONGEST:g} s are allowed")


def _check_push(loaded: LoadedSuite) -> None:
    """Every push must have a direction and a size, and end before the next begins."""
    suite = loaded.suite
    given = {*suite.axes.given(), *(suite.random.given() if suite.random else ()), *loaded.push}
    for field, others in (("direction", {"direction", "vector"}), ("delta_v", {*SIZES})):
        if suite.train is None and not given & others:
            why = "is missing; the base scenario's push does not give it either"
            raise InputError(f"{loaded.path}: axes.{field}: {why}")
    if "relative" in given and "direction" not in given:
        why = "needs an axis direction; the base scenario's push gives a vector, which may point anywhere"
        raise InputError(f"{loaded.path}: axes.relative: {why}")
    _check_train(loaded)
    _check_first(loaded)
    _check_end(loaded)


def _check_variants(loaded: LoadedSuite) -> None:
    """Every variant must be a scenario, and leave to the axes what they vary."""
    axes, base = loaded.suite.axes.given(), loaded.base.as_dict()
    for name, changes in (loaded.suite.variants or {}).items():
        where = f'{loaded.path}: variants."{name}"'
        for field, value in changes.items():
            if field.partition(".")[0] in DECIDED:
                why = f"{value!r} is not allowed; the suite decides it, a variant may change {', '.join(CHANGEABLE)}"
                raise InputError(f"{where}.{field}: {why}")
            if parameter_of(field) in axes:
                raise InputError(
                    f"{where}.{field}: {value!r} is not allowed; axes.{parameter_of(field)} varies it already"
                )
        try:
            Scenario.model_validate(changed(base, changes), context={"folder": loaded.path.parent})
        except ValidationError as error:
            raise InputError(f"{where}.{first_error(error, Scenario)}") from None


def _check_train(loaded: LoadedSuite) -> None:
    train, control, longest = loaded.suite.train, loaded.base.timing.control, max(loaded.range("duration"))
    if train is not None and train.interval <= longest + control:
        raise InputError(
            f"{loaded.path}: train.interval: {train.interval!r} s must be longer than a push, {longest:g} s, "
            f"and a control period, {control:g} s"
        )


def _check_first(loaded: LoadedSuite) -> None:
    first, control = loaded.suite.first, loaded.base.timing.control
    if first is None:
        return
    if first.gap <= control:
        raise InputError(
            f"{loaded.path}: first.gap: {first.gap!r} s must be longer than the control period, {control:g} s"
        )
    earliest, before = min(loaded.range("start")) - loaded.suite.replica.time, first.gap + first.duration
    if earliest < before:
        raise InputError(
            f"{loaded.path}: axes.start: {earliest:g} s is too early; the first push begins {before:g} s before it"
        )
