"""Names of classes on the command line, where a file is relative to the present folder."""

from __future__ import annotations

from pathlib import Path

from controllers.registry import Registry
from models.errors import InputError


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
