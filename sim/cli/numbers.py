"""Numbers of the command line, checked like those of a file and refused in the same words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from controllers.fields import NotNegative
from scenarios.error_messages import first_error
from scenarios.push import LONGEST


def _reader(kind: Any) -> Callable[[object], Any]:
    adapter = TypeAdapter(Annotated[kind, Field(allow_inf_nan=False)] if kind is float else kind)

    def read(text: object) -> Any:  # typer hands in defaults, too, as they are
        try:
            return adapter.validate_strings(str(text))
        except ValidationError as error:
            raise typer.BadParameter(first_error(error, BaseModel).removeprefix(": ")) from None

    return read


number = _reader(float)
"""Reads a number."""
not_negative = _reader(Annotated[NotNegative, Field(allow_inf_nan=False)])
"""Reads a number that is not below 0."""
whole = _reader(Annotated[int, Field(ge=0)])
"""Reads a whole number that is not below 0."""
positive = _reader(Annotated[int, Field(ge=1)])
"""Reads a whole number that is at least 1."""
several = _reader(Annotated[int, Field(ge=2, le=1000)])
"""Reads how many there shall be to tell a spread: at least 2."""
seconds = _reader(Annotated[float, Field(gt=0, le=LONGEST, allow_inf_nan=False)])
"""Reads a length of an episode [s]."""
