"""A scenario's choice of a class: a name of the registry, or a table of a name and options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, ValidationInfo, model_serializer

from controllers.fields import Strict, conflict, file_fields, file_hash, refusal, within
from controllers.registry import CONTROLLERS, ESTIMATORS, LAYERS, Entry, Registry, short
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

    def files(self, registry: Registry) -> dict[str, Path]:
        """The files that its options name: option -> absolute path."""
        named = file_fields(registry.entry(self.name).options) if self.options else ()
        return {option: Path(path) for option in named if (path := self.options.get(option)) is not None}

    def sources(self, registry: Registry) -> dict[str, str]:
        """What it is made of beside Okiagari: SHA-256 of its class's file, and of those that its options name.

        Raises:
            InputError: if one cannot be read, or two are called the same.
        """
        source = registry.entry(self.name).source
        found = {} if source is None else {self.short: source}
        for option, path in self.files(registry).items():
            value = file_hash(path)
            if found.setdefault(path.name, value) != value:
                raise InputError(f"{option}: two files are called {path.name!r}; rename one")
        return found

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
            options |= _checked_files(registry.entry(name), options, info)
        return Choice(name=name, options=options)

    return BeforeValidator(read)


def _checked_files(entry: Entry, options: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
    """Check options; the files among them by their absolute paths."""
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
        checked = model.model_validate(options, context=info.context)
    except ValidationError as error:
        raise within(first_error(error, model)) from None
    return {name: getattr(checked, name) for name in file_fields(model) if name in options}


def lacking(choice: Choice, registry: Registry) -> str | None:
    """An option that must be given and is not; None if there is none."""
    fields = registry.entry(choice.name).options.model_fields.items()
    needed = (name for name, field in fields if field.is_required() and name not in SHARED)
    return next((name for name in needed if name not in choice.options), None)


def _name(registry: Registry) -> AfterValidator:
    return AfterValidator(lambda name, info: named(registry, name, info))


REGISTRIES = {"controller": CONTROLLERS, "whole_body": LAYERS}
"""Field of a scenario that names a class -> where its names are looked up."""
ControllerName = Annotated[str, _name(CONTROLLERS)]
LayerName = Annotated[str, _name(LAYERS)]
ControllerChoice = Annotated[Choice, _choice(CONTROLLERS)]
LayerChoice = Annotated[Choice, _choice(LAYERS)]
EstimatorChoice = Annotated[Choice, _choice(ESTIMATORS)]
