"""Where a command may write: checked by trying, before any work is done for it."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from models.errors import InputError

# Of the name of a file that is written beside another one, which it then replaces: the dot and the ending.
_BESIDE = 24


def real_path(path: Path, option: str) -> Path:
    """The path behind all symbolic links.

    Raises:
        InputError: if it is none: too long, a loop, or a link to what is not there.
    """
    try:
        if path.is_symlink() and not path.exists():
            raise InputError(f"{option}: {str(path)!r} is a symbolic link to {os.readlink(path)!r}, which is not there")
        path.exists()
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{option}: {_short(path)} cannot be a path: {why}") from None


@contextmanager
def made_parents(path: Path, option: str, shown: Path | None = None) -> Iterator[None]:
    """Make the folders above a path, and take back those that are empty if the block fails.

    Args:
        path: without symbolic links.
        option: that names it, to begin a message with.
        shown: what to call it in messages; None for its own name.

    Raises:
        InputError: if they cannot be made or written to.
    """
    called = _short(shown or path)
    missing = [parent for parent in path.parents if not parent.exists()]
    above = next(parent for parent in path.parents if parent.exists())
    if not above.is_dir():
        raise InputError(f"{option}: {called} cannot be made: {str(above)!r} is not a folder")
    try:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=path.parent):
                pass
        except OSError as error:
            raise InputError(f"{option}: {called} cannot be made: {error.strerror}") from None
        yield
    except BaseException:
        _take_back(missing)
        raise


def check_writable(path: Path, option: str) -> None:
    """Refuse a file that could not be written, and leave nothing behind.

    Raises:
        InputError: if it is a folder, its name is too long, or no file can be made there.
    """
    real = real_path(path, option)
    if real.is_dir():
        raise InputError(f"{option}: {_short(path)} is a folder; it must be a file")
    if len(os.fsencode(real.name)) + _BESIDE > 255:
        raise InputError(f"{option}: {_short(path)} cannot be made: File name too long")
    try:
        with made_parents(real, option, path):
            raise _Tried
    except _Tried:
        return


class _Tried(Exception):
    """All went well; what was made for the trial goes again."""


def _take_back(folders: list[Path]) -> None:
    with contextlib.suppress(OSError):
        for folder in folders:
            folder.rmdir()


def _short(path: Path) -> str:
    text = repr(str(path))
    return text if len(text) <= 90 else f"{text[:60]}...{text[-20:]}"
