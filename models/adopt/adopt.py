"""Adopts a robot: reads any biped's MJCF and writes one that keeps our conventions, with a report beside it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
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
    source: Path, folder: Path, *, hints: Hints | None = None, progress: Callable[[str], None] = lambda stage: None
) -> Adopted:
    """Write a robot that the testbed runs.

    Args:
        source: MJCF of a biped, x forward, y left, z up in its first keyframe.
        folder: gets `<name>.xml`, `assets/` and a report; must not exist or be empty. Whole or not at all.
        hints: what the file cannot say; None for `robot.toml` beside it, if there is one.
        progress: called with the name of each stage.

    Raises:
        InputError: if the robot cannot be adopted; one line that names the cause.
    """
    if hints is None:
        beside = source.parent / HINTS
        hints = read_hints(beside) if beside.is_file() else Hints()
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; choose another one")
    name = hints.name or source.stem
    progress("reading")
    read = read_source(source, hints)
    soles = find_soles(read)
    servos = read_servos(read)
    progress("looking for a stand")
    stand = find_stand(read, soles)
    progress("writing")
    spec = rewrite(read, soles, stand, servos)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".adopting-", dir=folder.parent) as within:
            draft = Path(within) / folder.name
            draft.mkdir()
            load_robot(str(write(spec, source, draft, name)))
            if folder.exists():
                folder.rmdir()
            draft.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror}") from None
    robot = load_robot(str(folder / f"{name}.xml"))
    report = findings(read, robot, soles, stand, servos)
    (folder / REPORT).write_text(report, encoding="utf-8")
    return Adopted(robot=robot, report=report)
