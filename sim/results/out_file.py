"""A file that a command line names to be written: refused before any work is done for it, then written whole."""

from __future__ import annotations

import os
from pathlib import Path

from models.errors import InputError
from sim.results.table import write_bytes


def check_file(path: Path, option: str) -> None:
    """Refuse what cannot be written, before anything is run for it.

    Args:
        path: of the file.
        option: that names it, to begin a message with.

    Raises:
        InputError: if it is a folder, or no file can be made there.
    """
    if os.path.isdir(path):
        raise InputError(f"{option}: {str(path)!r} is a folder; it must be a file")
    place = next(parent for parent in path.absolute().parents if os.path.exists(parent))
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        why = "may not be written to" if place.is_dir() else "is not a folder"
        raise InputError(f"{option}: {str(path)!r} cannot be written: {str(place)!r} {why}")


def write_file(content: bytes, path: Path, option: str) -> None:
    """Write a file, whole or not at all; its folder is made.

    Raises:
        InputError: if it cannot be written.
    """
    check_file(path, option)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{option}: {str(path)!r} cannot be written: {error.strerror}") from None
    write_bytes(content, path)
