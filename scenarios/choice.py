"""A scenario's choice of a class: a name of the registry, or a table of a name and options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, ValidationInfo, model_serializer

from controllers.fields import Strict, conflict, refusal, within
from controllers.registry import CONTROLLERS, LAYERS, Entry, Registry, short
from models.errors import InputError
from scenarios.error_messages import first_error, near

SHARED = ("gain", "stepping")
"""Options that are tables of the scenario itself, so that all its controllers have them alike."""


class Choice(Strict):
    """Which class, and its own options.

    Attributes:
        name: short, or `/path/to/file.py:Class`.
        options: as given, checked by the class's own model.
    """

    name: str
    options: dict[str, Any] = Field(default_factory=dict)

    @property
    def short(self) -> str:
        """What tables, titles and folders call it."""
        return short(self.name)

    def __str__(self) -> str:
        return self.short

    @model_serializer
    def _as_in_a_file(self) -> str | dict[str, Any]:
        return {"name": self.name, **self.options} if self.options else self.name


def named(registry: Registry, name: str, info: ValidationInfo) -> str:
    """A name that is checked and absolute; a file is relative to the folder of the file that is read, if one is.

    Raises:
        PydanticCustomError: if there is no such class.
    """
    folder = (info.context or {}).get("folder", Path())
    try:
        name = registry.absolute(name, folder)
        if name not in registry.shipped:
            registry.entry(name)
    except InputError as error:
        raise refusal(str(error)) from None
    return name


def _choice(registry: Registry) -> BeforeValidator:
    def read(value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, Choice):
            return value
        table = {"name": value} if isinstance(value, str) else value
        if not isinstance(table, dict):
            raise ValueError("is neither a name nor a table with a name")
        if not isinstance(table.get("name"), str) or not table["name"]:
            raise conflict("name", "is missing or no text; it must be given")
        options = {key: option for key, option in table.items() if key != "name"}
        name = named(registry, table["name"], info)
        if options:
            _check(registry.entry(name), options)
        return Choice(name=name, options=options)

    return BeforeValidator(read)


def _check(entry: Entry, options: dict[str, Any]) -> None:
    model = entry.options
    for field in SHARED:
        if field in options and field in model.model_fields:
            raise conflict(field, f"is a table of the scenario itself, [{field}], for all its controllers")
    own = [name for name in model.model_fields if name not in SHARED]
    for field in options:
        if field not in own:
            allowed = ", ".join(own) if own else "none"
            raise conflict(field, f"unknown option of {entry.short!r}{near(field, own)}; allowed: {allowed}")
    try:
        model.model_validate(options)
    except ValidationError as error:
        raise within(first_error(error, model)) from None


def _name(registry: Registry) -> AfterValidator:
    return AfterValidator(lambda name, info: named(registry, name, info))


REGISTRIES = {"controller": CONTROLLERS, "whole_body": LAYERS}
"""Field of a scenario that names a class -> where its names are looked up."""
ControllerName = Annotated[str, _name(CONTROLLERS)]
LayerName = Annotated[str, _name(LAYERS)]
ControllerChoice = Annotated[Choice, _choice(CONTROLLERS)]
LayerChoice = Annotated[Choice, _choice(LAYERS)]
