"""The table of a sweep: one row an episode, typed, with units; read so that a damaged file is named."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from models.errors import InputError, one_line
from sim.record.parquet import read_parquet
from sim.results.checksum import BLANK, add_checksum, has_checksum, is_intact
from sim.results.columns import COLUMNS, LATER, RENAMED, SCHEMA

RESULTS = "results.parquet"
"""All rows of a finished sweep."""
ROWS = "rows"
"""Folder of the rows that are not in `RESULTS` yet, in files of one or more rows."""
SWEEP = "sweep.json"
"""What was run: suite, its hash, versions, commit."""
SUITE = "suite.toml"
"""The suite as it was given."""


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
    table = table.rename_columns([RENAMED.get(name, name) for name in table.schema.names])
    for name in SCHEMA.names:
        if name in LATER and name not in table.schema.names:
            meant = pa.repeat(pa.scalar(LATER[name], SCHEMA.field(name).type), table.num_rows)
            table = table.add_column(min(SCHEMA.get_field_index(name), table.num_columns), name, meant)
    if table.schema.names != SCHEMA.names or table.schema.types != SCHEMA.types:
        raise ResultsError(f"{path}: not a table of a sweep of this version of Okiagari; move it out of the folder")
    if not has_checksum(content):
        raise _damaged(path, "it has no checksum")
    return table.replace_schema_metadata(SCHEMA.metadata)


def _damaged(path: Path, error: object) -> ResultsError:
    why = one_line(error).rstrip(".")
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
    # Of one row, what is meant to make a table small makes it larger, and takes three times as long.
    small = {"compression": "none", "use_dictionary": False, "write_statistics": False}
    how: dict[str, Any] = {"compression": "zstd"} if table.num_rows > 1 else small
    pq.write_table(blank, sink, write_page_checksum=True, **how)
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
