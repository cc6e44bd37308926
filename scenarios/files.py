"""Scenario and suite files: found by name or path, read as TOML, and what they name beside them."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any, Literal

from models.errors import InputError, one_line
from scenarios.error_messages import near

Kind = Literal["scenario", "suite"]
_HERE = Path(__file__).parent
_FOLDERS: dict[Kind, Path] = {"scenario": _HERE, "suite": _HERE / "suites"}
_DEEPEST = 20
"""More tables within tables than any file means; beyond some hundreds, Python itself gives up."""
_COMMANDS: dict[Kind, str] = {"scenario": "okiagari run", "suite": "okiagari sweep"}


def shipped_files(kind: Kind) -> dict[str, Path]:
    """The files of a kind that come with Okiagari: name -> file."""
    return {path.stem: path for path in sorted(_FOLDERS[kind].glob("*.toml"))}


def find_file(kind: Kind, name: str | Path) -> Path:
    """Find a file by its name or path.

    Args:
        kind: what it should be.
        name: of one that is shipped, or a path to a `.toml` file.

    Raises:
        InputError: if there is none; lists the names there are.
    """
    known = shipped_files(kind)
    if str(name) in known:
        return known[str(name)]
    path = Path(name)
    if path.suffix == ".toml":
        if os.path.isfile(path):  # False, too, for a name that no system can have
            return path
        raise InputError(f"{kind}: no file {str(path)!r}")
    for other, command in _COMMANDS.items():
        if str(name) in shipped_files(other):
            raise InputError(f"{kind}: {str(name)!r} is a {other}: {command} {name}")
    raise InputError(
        f"{kind}: {str(name)!r} is neither one of {', '.join(known)} nor a path to a .toml file{near(str(name), known)}"
    )


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """The text of a file, and its fields.

    Raises:
        InputError: if it cannot be read, is no TOML, or holds tables or lists more than 20 deep.
    """
    try:
        text = path.read_text(encoding="utf-8")
        fields = tomllib.loads(text)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:  # of the encoding, or of TOML
        raise InputError(f"{path}: not a TOML file: {one_line(error)}") from None
    except RecursionError:
        fields = {}
        deep = True
    else:
        deep = _is_deep(fields)
    if deep:
        raise InputError(f"{path}: holds tables or lists within each other, more than {_DEEPEST} deep")
    return text, fields


def _is_deep(fields: Any) -> bool:
    level = [fields]
    for _ in range(_DEEPEST):
        inner = (each.values() if isinstance(each, dict) else each for each in level)
        level = [value for values in inner for value in values if isinstance(value, dict | list)]
    return bool(level)


def robot_beside(path: Path, robot: str) -> str:
    """A robot as a file names it: the path of an `.xml` file is relative to that of the file."""
    beside = path.parent / robot
    if not robot.endswith(".xml"):
        return robot
    return str(beside.resolve()) if os.path.isfile(beside) else os.path.abspath(beside)
