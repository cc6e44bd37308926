"""Kinds of fields that tables of scenarios and options of controllers are made of, and their errors."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Annotated, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from models.errors import InputError

# Minus zero is not below zero, and numpy takes it for negative all the same.
NotNegative = Annotated[float, Field(ge=0), AfterValidator(abs)]
# TOML and JSON know lists only, so the container is lenient while its numbers stay strict.
Vector = Annotated[tuple[float, float, float], Field(strict=False)]

# Times are decimal fractions of a second: what differs by rounding only is equal.
WHOLE = 1e-9


class Strict(BaseModel):
    """A frozen table of a scenario file: no unknown fields, no conversions, no NaN and no infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def snap(steps: float) -> float:
    """A number of steps, made whole when it is whole but for rounding."""
    nearest = round(steps)
    return nearest if abs(steps - nearest) <= WHOLE * max(1.0, abs(steps)) else steps


def refusal(why: str) -> PydanticCustomError:
    """The error of a field whose value is refused; `why` names the value and what is allowed."""
    return PydanticCustomError("refusal", "{why}", {"why": why})


def within(line: str) -> PydanticCustomError:
    """The error of a field in a table; `line` begins with the field's name within that table."""
    return PydanticCustomError("conflict", "{line}", {"line": line})


def conflict(field: str, why: str) -> PydanticCustomError:
    """The error of a table whose fields do not fit together; `field` is relative to that table."""
    return PydanticCustomError("conflict", "{field}: {why}", {"field": field, "why": why})


class _OwnFile:
    """Marks a field of options that names a file."""


def _beside(name: str, info: ValidationInfo) -> str:
    """The absolute path of a file, which is relative to the folder of the file that is read, if one is."""
    path = (info.context or {}).get("folder", Path()) / name
    if not os.path.isfile(path):  # False, too, for a name that no system can have
        raise refusal(f"{name!r}: there is no file {os.path.abspath(path)!r}")
    return str(path.resolve())


File = Annotated[str, Field(min_length=1), AfterValidator(_beside), _OwnFile()]
"""An option that names a file: relative to the scenario's file, absolute once it is read. What the file holds belongs
to the controller like its own source: its hash goes into results and baselines. `File | None` may be left out."""


def file_fields(model: type[BaseModel]) -> tuple[str, ...]:
    """The fields of options that name files."""
    return tuple(
        name
        for name, field in model.model_fields.items()
        for marks in (field.metadata, *(getattr(kind, "__metadata__", ()) for kind in get_args(field.annotation)))
        if any(isinstance(mark, _OwnFile) for mark in marks)
    )


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes.

    Raises:
        InputError: if it cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{str(path)!r} cannot be read: {error.strerror}") from None
