"""The folder that a run leaves behind: complete, or not there at all."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from models.errors import InputError

if TYPE_CHECKING:
    from sim.episode.episode import EpisodeResult

SCENARIO = "scenario.toml"
TRACE = "trace.parquet"
OUTCOME = "outcome.json"
DECISIONS = "decisions.json"
FIGURE = "figure.png"
VIDEO = "video.mp4"
FILES = (SCENARIO, TRACE, OUTCOME, DECISIONS, FIGURE, VIDEO)


def free_folder(name: str, root: Path = Path("out")) -> Path:
    """The first of `root/name`, `root/name-2`, ... that does not exist yet."""
    number, folder = 1, root / name
    while folder.exists():
        number += 1
        folder = root / f"{name}-{number}"
    return folder


def check_target(target: Path, *, overwrite: bool) -> None:
    """Check that a run may be written to `target`.

    Args:
        target: a folder that does not exist or is empty; with `overwrite` it may hold a former run.
        overwrite: whether a former run may be replaced.

    Raises:
        InputError: if it may not.
    """
    if not os.path.exists(target):  # False, too, for a name that no system can have
        parent = next(folder for folder in target.absolute().parents if os.path.exists(folder))
        if not (parent.is_dir() and os.access(parent, os.W_OK | os.X_OK)):
            raise InputError(f"--out: {str(target)!r} cannot be made; {parent} must be a folder that you may write to")
        return
    if not target.is_dir():
        raise InputError(f"--out: {str(target)!r} is a file; it must be a folder that is empty or does not exist")
    held = sorted(entry.name for entry in target.iterdir())
    if not held:
        return
    foreign = [name for name in held if name not in FILES]
    if foreign:
        raise InputError(
            f"--out: {str(target)!r} holds {foreign[0]!r}, which no run writes; choose a folder that does not exist"
        )
    if not overwrite:
        raise InputError(f"--out: {str(target)!r} holds a run already; choose another folder or pass --overwrite")


@contextmanager
def staged(target: Path, *, overwrite: bool = False) -> Iterator[Path]:
    """A folder to write into, which becomes `target` in one move when the block ends well, and else disappears.

    Args:
        target: see `check_target`.
        overwrite: whether a former run may be replaced.

    Raises:
        InputError: if `target` may not be written.
    """
    check_target(target, overwrite=overwrite)
    target.parent.mkdir(parents=True, exist_ok=True)
    # Beside the target: a move within one file system is all or nothing.
    stage = target.parent / f".{target.name}.{os.getpid()}.part"
    stage.mkdir()
    try:
        yield stage
        _replace(target, stage)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _replace(target: Path, stage: Path) -> None:
    former = stage.with_suffix(".former")
    if target.exists():
        target.rename(former)
    try:
        stage.rename(target)
    except OSError:
        if former.exists():
            former.rename(target)
        raise
    shutil.rmtree(former, ignore_errors=True)


def write_records(folder: Path, result: EpisodeResult) -> None:
    """Write scenario, trace, outcome and decisions of a run into an existing folder."""
    (folder / SCENARIO).write_text(tomli_w.dumps(result.scenario.as_dict()), encoding="utf-8")
    result.trace.save(folder / TRACE)
    _write_json(folder / OUTCOME, outcome_record(result))
    _write_json(folder / DECISIONS, result.decisions)


def outcome_record(result: EpisodeResult) -> dict[str, Any]:
    """What `outcome.json` holds."""
    scenario, outcome, metadata = result.scenario, result.outcome, result.trace.metadata
    return {
        "outcome": outcome.result.value,
        "reason": outcome.reason.value,
        "time_of_fall": outcome.time_of_fall,
        "settled_at": outcome.settled_at,
        "steps_taken": outcome.steps_taken,
        "description": scenario.description,
        "world": scenario.world,
        "controller": scenario.controller.short,
        "whole_body": scenario.whole_body.short,
        "robot": metadata["robot"]["name"],
        "mass": metadata["robot"]["mass"],
        "omega": metadata["robot"]["omega"],
        "seed": metadata["seed"],
        "real_time_factor": result.real_time_factor,
        "versions": metadata["versions"],
        "commit": metadata["commit"],
        "pushes": [asdict(push) for push in result.pushes],
        "motors": None if result.motors is None else asdict(result.motors),
    }


def _write_json(path: Path, content: Any) -> None:
    path.write_text(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    """The same of types that JSON knows; a number that is not finite becomes null."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
