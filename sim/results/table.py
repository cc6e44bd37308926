"""The table of a sweep: one row an episode, typed, with units; read so that a damaged file is named."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from models.errors import InputError
from sim.record.parquet import read_parquet
from sim.results.checksum import BLANK, add_checksum, has_checksum, is_intact

RESULTS = "results.parquet"
"""All rows of a finished sweep."""
ROWS = "rows"
"""Folder of the rows that are not in `RESULTS` yet, in files of one or more rows."""
SWEEP = "sweep.json"
"""What was run: suite, its hash, versions, commit."""
SUITE = "suite.toml"
"""The suite as it was given."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of the table.

    Attributes:
        type: of pyarrow.
        unit: "1" for numbers without one; empty for what is no number.
        meaning: one line.
    """

    type: pa.DataType
    unit: str
    meaning: str


def _text(meaning: str) -> Column:
    return Column(type=pa.string(), unit="", meaning=meaning)


def _number(unit: str, meaning: str) -> Column:
    return Column(type=pa.float64(), unit=unit, meaning=meaning)


def _count(meaning: str) -> Column:
    return Column(type=pa.int64(), unit="1", meaning=meaning)


def _flag(meaning: str) -> Column:
    return Column(type=pa.bool_(), unit="", meaning=meaning)


PARAMETERS: Mapping[str, Column] = MappingProxyType(
    {
        "robot": _text("name of a robot or path of its file"),
        "world": _text("humanoid or pendulum"),
        "controller": _text("short name, entry point, or path/to/file.py:Class"),
        "whole_body": _text("dynamics or ik"),
        "variant": _text("name of the suite's variant of the scenario; null if it has none"),
        "body": _text("where the push acts; cog is every body by its mass"),
        "direction_deg": _number(
            "deg", "nominal direction of the push, 0 forward, 90 left, below 360; null of a train"
        ),
        "delta_v": _number("m/s", "impulse / nominal mass; null of a train"),
        "impulse": _number("N s", "asked impulse; null of a train"),
        "duration": _number("s", "length of the push"),
        "start": _number("s", "nominal start of the push"),
        "height": _number("m", "how far above the body's COM the push acts"),
        "mass_scale": _number("1", "true mass / mass that the controllers know"),
        "friction": _number("1", "sliding friction of the floor; null as the arena has it"),
        "delay": _number("s", "age of what the controllers see"),
        "noise_position": _number("m", "sd of the noise of the COG that the controllers see"),
        "noise_velocity": _number("m/s", "sd of the noise of the COG velocity that the controllers see"),
        "replica": _count("number of the repetition, from 0"),
    }
)
"""What was asked; together they name an episode within its suite."""

OUTCOME: Mapping[str, Column] = MappingProxyType(
    {
        "outcome": _text("recovered, fell, not_settled or crashed"),
        "reason": _text("why, in words"),
        "time_of_fall": _number("s", "null without a fall"),
        "delivered_impulse": _number("N s", "summed from the forces that the physics was given, over all of a train"),
        "d_edge": _number("m", "from the middle of the feet to the edge of their hull in the nominal direction"),
        "delta_v_over_omega_d": _number("1", "1 is the no-step limit of the pendulum"),
        "delta_v_over_sqrt_gh": _number("1", "size of the push, comparable between robots"),
        "regulator_slack_end": _number("m", "signed slack of the regulator's set at the end of the push"),
        "tracking_slack_end": _number("m", "the same of the tracking sets; -inf if no step is within reach"),
        "in_regulator_set_end": _flag("membership at the end of the push"),
        "in_tracking_set_end": _flag("the same of the tracking sets"),
        "regulator_slack_decision": _number(
            "m", "at the first decision away from the regulator since the push began; else at the end of the push"
        ),
        "tracking_slack_decision": _number("m", "the same of the tracking set that was chosen"),
        "in_regulator_set_decision": _flag("membership at that decision"),
        "in_tracking_set_decision": _flag("the same of the tracking set that was chosen"),
        "outside_all": _flag("no set held the state at that decision"),
        "chosen": _text("how the push was answered: standing or stepping"),
        "mid_step": _flag("a step was under way when the push began; null of a train, or if it fell before"),
        "pushes_survived": _count("pushes of a train after which it stood until the next; null without a train"),
        "total_impulse": _number("N s", "of the survived pushes of a train; null without a train"),
        "pushes": _text("the pushes of a train that began: size, what was predicted, whether survived; JSON"),
        "steps": _count("steps begun"),
        "settle_time": _number("s", "from the end of the push to rest; null if it did not come to rest"),
        "peak_torque": _number("N m", "of the joint with the greatest torque / stall torque; null on the pendulum"),
        "peak_torque_use": _number("1", "that share"),
        "peak_torque_joint": _text("that joint"),
        "peak_speed": _number("rad/s", "of the joint with the greatest speed / no-load speed; null on the pendulum"),
        "peak_speed_use": _number("1", "that share"),
        "peak_speed_joint": _text("that joint"),
        "saturated_time": _number("s", "how long any motor was at its torque-speed line; null on the pendulum"),
        "saturated_joint": _text("whose was there longest; null if none was"),
        "trace_hash": _text("SHA-256 of every number of the trace"),
    }
)
"""What happened; null in a row that crashed, but for what is known of the push beforehand."""

TIMING: Mapping[str, Column] = MappingProxyType(
    {
        "real_time_factor": _number("1", "simulated time / wall time of the loop"),
        "wall_time": _number("s", "of the whole episode, with setting up"),
    }
)
"""What a clock measured: the only columns that differ when an episode is repeated with the same versions."""

COLUMNS: Mapping[str, Column] = MappingProxyType(
    {"episode": _text("short hash of the suite's seed and the parameters"), "suite": _text("name of the suite")}
    | dict(PARAMETERS)
    | {
        "seed": _count("of the episode; derived from the suite's seed and the parameters but for who answers"),
        "series": _text("rows of one adaptive series share it; else it is the episode"),
        "push_start": _number("s", "start of the push as run; of a train, of its first"),
        "push_direction_deg": _number("deg", "direction of the push as run; null of a train"),
        "first_direction_deg": _number("deg", "of the push before it; null if there is none"),
        "first_delta_v": _number("m/s", "size of the push before it; null if there is none"),
        "train": _count("pushes of the train at most; null without a train"),
    }
    | dict(OUTCOME)
    | dict(TIMING)
    | {
        "traceback": _text("of an episode that crashed"),
        "scenario": _text("the scenario as run, JSON"),
        "versions": _text("of Python and the libraries, JSON"),
        "commit": _text("of Okiagari"),
    }
)
"""Every column, in order."""

LATER = ("variant",)
"""Columns that tables of former versions lack; these mean null by that."""

SCHEMA = pa.schema(
    [
        pa.field(name, column.type, metadata={"unit": column.unit, "meaning": column.meaning})
        for name, column in COLUMNS.items()
    ],
    metadata={"okiagari": json.dumps({"table": "sweep", "version": 2})},
)


class ResultsError(InputError):
    """A results folder is missing, damaged or not one of ours."""


def as_table(rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Rows as a table; a row lacks no column and has none besides."""
    for row in rows:
        if row.keys() != COLUMNS.keys():
            raise ValueError(f"a row's columns differ by {sorted(row.keys() ^ COLUMNS.keys())}")
    return pa.Table.from_pylist(list(rows), schema=SCHEMA)


def read_file(path: Path) -> pa.Table:
    """Read and check one file of rows.

    Raises:
        ResultsError: if it is missing, damaged or not a table of a sweep; one line that says what to do.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ResultsError(f"{path}: cannot be read: {error.strerror}") from None
    if has_checksum(content) and not is_intact(content):
        raise _damaged(path, "its checksum is wrong")
    try:
        table = read_parquet(content)
    except (OSError, pa.ArrowException) as error:
        raise _damaged(path, error) from None
    for name in LATER:
        if name not in table.schema.names:
            nothing = pa.nulls(table.num_rows, SCHEMA.field(name).type)
            table = table.add_column(min(SCHEMA.get_field_index(name), table.num_columns), name, nothing)
    if table.schema.names != SCHEMA.names or table.schema.types != SCHEMA.types:
        raise ResultsError(f"{path}: not a table of a sweep of this version of Okiagari; move it out of the folder")
    if not has_checksum(content):
        raise _damaged(path, "it has no checksum")
    return table.replace_schema_metadata(SCHEMA.metadata)


def _damaged(path: Path, error: object) -> ResultsError:
    why = " ".join(str(error).split()).rstrip(".")
    then = f"makes it anew from {ROWS}" if path.name == RESULTS else "runs its episodes anew and no others"
    return ResultsError(f"{path}: damaged: {why}; delete it and repeat the sweep, which {then}")


def read_results(folder: Path) -> pa.Table:
    """All rows of a sweep, finished or under way, in the order of their episodes' names and none twice.

    Args:
        folder: of a sweep.

    Raises:
        ResultsError: if it is not the folder of a sweep, holds no row, or one of its files is damaged.
    """
    if not os.path.isfile(folder / SWEEP):
        raise _no_sweep(folder)
    tables = [read_file(path) for path in row_files(folder)]
    if not sum(table.num_rows for table in tables):
        raise ResultsError(f"{str(folder)!r} holds no finished episode yet")
    return without_repeats(tables)


def read_sweep(folder: Path) -> dict[str, Any]:
    """What `sweep.json` says: name, description, tuned_on, train, first, suite_hash, seed, versions, ...

    Raises:
        ResultsError: if it is missing or damaged.
    """
    path = folder / SWEEP
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise _no_sweep(folder) from None
    except OSError as error:
        raise ResultsError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:
        content = None
    if not isinstance(content, dict) or "suite_hash" not in content:
        raise ResultsError(f"{path}: damaged; delete it and repeat the sweep, which keeps the rows")
    return content


def _no_sweep(folder: Path) -> ResultsError:
    is_folder, exists = os.path.isdir(folder), os.path.exists(folder)
    why = f"it has no {SWEEP}" if is_folder else "it is a file" if exists else "there is no such folder"
    return ResultsError(f"{str(folder)!r} is not the folder of a sweep: {why}")


def row_files(folder: Path) -> list[Path]:
    """The files that hold the rows of a sweep."""
    whole = folder / RESULTS
    return [whole] * whole.exists() + sorted((folder / ROWS).glob("*.parquet"))


def without_repeats(tables: Iterable[pa.Table]) -> pa.Table:
    """One table in the order of the episodes' names.

    A sweep that was killed between writing all rows and deleting their single files has them in both.
    """
    table = pa.concat_tables([SCHEMA.empty_table(), *tables])
    first = {episode: i for i, episode in reversed(list(enumerate(table["episode"].to_pylist())))}
    return table.take([first[episode] for episode in sorted(first)])


def write_table(table: pa.Table, path: Path) -> None:
    """Write a table so that a file of this name is whole or absent, at any moment.

    Raises:
        ResultsError: if it cannot be written, for instance because the disk is full.
    """
    sink = pa.BufferOutputStream()
    blank = table.replace_schema_metadata({**(table.schema.metadata or {}), b"checksum": BLANK.encode()})
    pq.write_table(blank, sink, compression="zstd", write_page_checksum=True)
    then = "; the rows before it are safe, and the same command goes on from there"
    write_bytes(add_checksum(sink.getvalue().to_pybytes()), path, then)


def write_bytes(content: Any, path: Path, then: str = "") -> None:
    """Write a file so that it is whole or absent, at any moment; else raises `ResultsError`, which ends with `then`."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with open(part, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        what = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else error.strerror
        raise ResultsError(f"{path}: cannot be written: {what}{then}") from None
