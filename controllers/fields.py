"""Kinds of fields that tables of scenarios and options of controllers are made of, and their errors."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

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
