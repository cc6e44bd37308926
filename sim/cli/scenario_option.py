"""The scenario and the classes that a command line names, with what its options change of a scenario."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from controllers.registry import Registry
from models.errors import InputError
from scenarios.catalogue import check_against, find, load
from scenarios.error_messages import first_error
from scenarios.schema import Scenario
from scenarios.variants import changed


def open_scenario(name: str, overrides: Mapping[str, Any], assignments: Sequence[str] = ()) -> Scenario:
    """Load and check a scenario.

    Args:
        name: of a shipped scenario, or a `.toml` file.
        overrides: top-level fields that replace the file's.
        assignments: `field=value` of `--set`.

    Raises:
        InputError: if it says something that is not allowed; one line that names the file or the option.
    """
    scenario = load(name, overrides)
    source = str(find(name))
    if assignments:
        scenario = assigned(scenario, assignments)
    from models.robot import load_robot

    try:
        robot = load_robot(scenario.robot)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None
    check_against(scenario, robot, source=source)
    return scenario


def named(registry: Registry, option: str, name: str | None) -> str | None:
    """A name as scenarios hold it; None if none is given.

    Raises:
        InputError: if there is no such class; it begins with the option.
    """
    if name is None:
        return None
    try:
        found = registry.absolute(name, Path())
        registry.entry(found)
    except InputError as error:
        raise InputError(f"{option}: {error}") from None
    return found


def assigned(scenario: Scenario, assignments: Sequence[str]) -> Scenario:
    """A scenario with `field=value` put into it: a dotted field, and a value as TOML has it, or a text as it is.

    Raises:
        InputError: if one is not allowed; it begins with `--set`.
    """
    changes = dict(map(_assignment, assignments))
    try:
        return Scenario.model_validate(changed(scenario.as_dict(), changes), context={"folder": Path()})
    except ValidationError as error:
        raise InputError(f"--set: {first_error(error, Scenario)}") from None


def _assignment(text: str) -> tuple[str, Any]:
    field, equals, value = text.partition("=")
    if not equals or not field.strip():
        raise InputError(f"--set: {text!r} is not of the form field=value, for instance stepping.max_steps=2")
    try:
        read = tomllib.loads(f"value = {value}")
    except tomllib.TOMLDecodeError:
        return field.strip(), value.strip()
    if list(read) != ["value"]:
        raise InputError(f"--set: {text!r} holds more than one field; give each a --set of its own")
    return field.strip(), read["value"]
