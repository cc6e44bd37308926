"""Numbers of the command line, refused in words that name what is allowed."""

from __future__ import annotations

from collections.abc import Callable

import typer


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a whole number") from None


def number(text: str) -> float:
    """A number."""
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a number") from None


def at_least(least: int) -> Callable[[str], int]:
    """A parser of whole numbers that are not below `least`."""

    def parse(text: str) -> int:
        value = whole(text)
        if value < least:
            raise typer.BadParameter(f"{value} is not allowed; it must be >= {least}")
        return value

    return parse
