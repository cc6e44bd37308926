"""The folder that a run leaves behind: complete, or not there at all."""

from __future__ import annotations

import fcntl
import hashlib
import itertools
import json
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w

from models.errors import InputError
from sim.record.places import made_parents, real_path

if TYPE_CHECKING:
    from sim.episode.episode import EpisodeResult

SCENARIO = "scenario.toml"
TRACE = "trace.parquet"
OUTCOME = "outcome.json"
DECISIONS = "decisions.json"
FIGURE = "figure.png"
VIDEO = "video.mp4"
PAGE = "replay.html"
LOCK = ".lock"
"""Held while a run is being written, and let go by the system however it ends."""
FILES = (SCENARIO, TRACE, OUTCOME, DECISIONS, FIGURE, VIDEO, PAGE)


class TargetTakenError(InputError):
    """A folder holds a run already, or another run is writing it now."""


def check_target(target: Path, *, overwrite: bool) -> None:
    """Check that a run may be written to `target`.

    Args:
        target: a folder that does not exist or is empty; with `overwrite` it may hold a former run.
        overwrite: whether a former run may be replaced.

    Raises:
        InputError: if it may not.
    """
    real = real_path(target, "--out")
    if real in (Path.cwd(), *Path.cwd().parents):
        raise InputError(f"--out: {str(target)!r} is the folder that you are in, or above it; choose one beside")
    if not real.exists():
        return
    if not real.is_dir():
        raise InputError(f"--out: {str(target)!r} is a file; it must be a folder that is empty or does not exist")
    held = sorted(entry.name for entry in real.iterdir())
    if not held:
        return
    foreign = [name for name in held if name not in FILES]
    if foreign:
        raise InputError(
            f"--out: {str(target)!r} holds {foreign[0]!r}, which no run writes; choose a folder that does not exist"
        )
    if not overwrite:
        raise TargetTakenError(f"--out: {str(target)!r} holds a run already; choose another folder or pass --overwrite")


@contextmanager
def claimed(target: Path, *, overwrite: bool = False) -> Iterator[Path]:
    """A folder to write into, which becomes `target` in one move when the block ends well, and else disappears.

    From the beginning no other run can claim the same target.

    Args:
        target: see `check_target`; symbolic links are followed.
        overwrite: whether a former run may be replaced.

    Raises:
        InputError: if `target` may not be written.
        TargetTakenError: if it holds a run, or another one is writing it.
    """
    check_target(target, overwrite=overwrite)
    real = real_path(target, "--out")
    if len(os.fsencode(real.name)) > 255:
        raise InputError(f"--out: {str(target)[:60]!r}... cannot be made: File name too long")
    with made_parents(real, "--out", target), _stage(real, target) as stage:
        yield stage
        (stage / LOCK).unlink()
        _replace(real, stage)


@contextmanager
def claimed_at(target: Path, *, overwrite: bool = False) -> Iterator[tuple[Path, Path]]:
    """The target, and the folder to write into; see `claimed`."""
    with claimed(target, overwrite=overwrite) as stage:
        yield target, stage


@contextmanager
def claimed_free(name: str, root: Path = Path("out")) -> Iterator[tuple[Path, Path]]:
    """The first of `root/name`, `root/name-2`, ... that nobody has, and the folder to write into; see `claimed`."""
    for number in itertools.count(1):
        target = root / (name if number == 1 else f"{name}-{number}")
        with ExitStack() as stack:
            if os.path.lexists(target) and not (target.is_dir() and not any(target.iterdir())):
                continue
            try:
                stage = stack.enter_context(claimed(target))
            except TargetTakenError:
                continue
            yield target, stage
            return


@contextmanager
def _stage(real: Path, target: Path) -> Iterator[Path]:
    """The folder beside the target that is moved to it in the end: a move within one file system is all or nothing."""
    # Short whatever the target's name, and the same for every run that wants it.
    stage = real.parent / f".okiagari-{hashlib.sha256(os.fsencode(real.name)).hexdigest()[:12]}.part"
    while True:
        stage.mkdir(exist_ok=True)
        lock = open(stage / LOCK, "w")  # noqa: SIM115
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            raise TargetTakenError(f"--out: {str(target)!r} is being written by another run; choose another") from None
        # A run that ended meanwhile has taken its folder with it.
        if (stage / LOCK).exists() and os.stat(stage / LOCK).st_ino == os.fstat(lock.fileno()).st_ino:
            break
        lock.close()
    try:
        for left in stage.iterdir():  # by a run that was killed
            if left.name != LOCK:
                left.unlink()
        yield stage
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        lock.close()


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
        "sight": None if result.sight is None else asdict(result.sight),
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
