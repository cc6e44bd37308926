"""A file that a command line names to be written: refused before any work is done for it, then written whole."""

from __future__ import annotations

from pathlib import Path

from sim.record.places import check_writable, made_parents, real_path
from sim.results.table import write_bytes


def check_file(path: Path, option: str) -> None:
    """Refuse what cannot be written, before anything is run for it.

    Args:
        path: of the file.
        option: that names it, to begin a message with.

    Raises:
        InputError: if it is a folder, or no file can be made there.
    """
    check_writable(path, option)


def write_file(content: bytes, path: Path, option: str) -> None:
    """Write a file, whole or not at all; its folder is made, and a symbolic link is followed.

    Raises:
        InputError: if it cannot be written.
    """
    check_file(path, option)
    real = real_path(path, option)
    with made_parents(real, option):
        write_bytes(content, real)
