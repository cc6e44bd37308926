"""Adopts a robot: reads any biped's MJCF and writes one that keeps our conventions, with a report beside it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from models.adopt.findings import REPORT, findings
from models.adopt.hints import HINTS, Hints, read_hints
from models.adopt.rewrite import rewrite, write
from models.adopt.servos import read_servos
from models.adopt.soles import find_soles
from models.adopt.source import read_source
from models.adopt.stand import find_stand
from models.errors import InputError
from models.robot import Robot, load_robot
from models.spoken import warnings_kept

_READ, _STOOD, _REWRITTEN = 0.3, 0.5, 0.75
"""Shares of the work after which the robot is read, has a stand, and is rewritten; meshes are compiled in between."""


@dataclass(frozen=True, kw_only=True)
class Adopted:
    """A robot that was adopted.

    Attributes:
        robot: as the testbed reads it.
        report: what was found, chosen and assumed, as Markdown.
    """

    robot: Robot
    report: str


def adopt(
    source: Path,
    folder: Path,
    *,
    hints: Hints | None = None,
    progress: Callable[[float], None] = lambda done: None,
    trial: Callable[[Path], str] | None = None,
) -> Adopted:
    """Write a robot that the testbed runs.

    Args:
        source: MJCF of a biped, x forward, y left, z up in its first keyframe.
        folder: gets `<name>.xml`, `assets/` and a report; must not exist or be empty. Whole or not at all.
        hints: what the file cannot say; None for `robot.toml` beside it, if there is one.
        progress: called with the share that is done, from 0 to 1.
        trial: tries the robot before the folder is there, and may leave files beside its MJCF, whose path it gets;
            what it answers goes into the report.

    Raises:
        InputError: if the robot cannot be adopted; one line that names the cause.
    """
    if hints is None:
        beside = source.parent / HINTS
        hints = read_hints(beside) if beside.is_file() else Hints()
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; choose another one")
    name = hints.name or source.stem
    try:
        with warnings_kept() as said:
            read = read_source(source, hints)
            soles = find_soles(read)
            servos = read_servos(read)
            progress(_READ)
            stand = find_stand(read, soles, lambda done: progress(_READ + (_STOOD - _READ) * done))
            progress(_STOOD)
            spec = rewrite(read, soles, stand, servos)
            progress(_REWRITTEN)
    except UnicodeDecodeError:
        raise InputError(f"{source}: holds a name that is not UTF-8") from None
    read.notes += [f"MuJoCo warned: {each}" for each in said]
    made = [each for each in (folder.parent, *folder.parent.parents) if not each.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".adopting-", dir=folder.parent) as within:
            draft = Path(within) / folder.name
            draft.mkdir()
            with warnings_kept():
                path = write(spec, source, draft, name)
            try:
                robot = load_robot(str(path))
            except InputError as error:
                why = str(error).removeprefix(f"{path}: ")
                raise InputError(f"{source}: does not become a robot that can be used: {why}") from None
            progress(1.0)
            report = findings(read, robot, soles, stand, servos)
            if trial is not None:
                report += f"\n## Trial\n\n{trial(path)}\n"
            (draft / REPORT).write_text(report, encoding="utf-8")
            draft.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    finally:
        for each in made:
            if each.is_dir() and not any(each.iterdir()):
                each.rmdir()
    return Adopted(robot=replace(robot, path=(folder / path.name).resolve()), report=report)
