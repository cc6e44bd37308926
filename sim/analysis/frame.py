"""The table of a sweep as a data frame: how it is read, grouped, and taken apart push by push."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from sim.results.table import read_results
from sim.results.train import SURVIVED

CASE_COLUMNS = (
    "robot",
    "world",
    "whole_body",
    "variant",
    "body",
    "duration",
    "start",
    "height",
    "mass_scale",
    "friction",
    "sensing",
    "latency",
    "noise_position",
    "noise_velocity",
    "body_error",
)
"""What else than controller, direction and size a suite may vary; episodes that agree in all of these form a case."""

# What only a closer look at one episode needs; long, and not wanted ten thousand times in memory.
_BULKY = frozenset({"traceback", "trace_hash"})
# Integers and flags that may be null keep their type.
_TYPES = {pa.bool_(): pd.BooleanDtype(), pa.int64(): pd.Int64Dtype()}
DIGITS = 9
"""Floats that differ beyond so many decimals only are the same."""


def load_rows(folder: Path, *, all_columns: bool = False) -> pd.DataFrame:
    """The episodes of a sweep's folder.

    Args:
        folder: of a sweep.
        all_columns: also those that only a closer look at one episode needs.

    Raises:
        ResultsError: if there are none, or a file is damaged.
    """
    table = read_results(folder)
    return as_frame(table.select([name for name in table.schema.names if all_columns or name not in _BULKY]))


def as_frame(table: pa.Table) -> pd.DataFrame:
    """A table of Arrow as a data frame; a missing value is NaN or NA."""
    return table.to_pandas(types_mapper=_TYPES.get)


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows as dictionaries of Python's types; a missing value is None."""
    found: list[dict[str, Any]] = frame.astype(object).where(frame.notna(), None).to_dict("records")
    return found


def groups(frame: pd.DataFrame, by: Sequence[str]) -> Iterator[tuple[tuple[Any, ...], pd.DataFrame]]:
    """Rows by the values of some columns, in order of those values, missing ones (None) first.

    Floats that differ by rounding only are one value. Without a column, all rows are one group.
    """
    if not by:
        yield (), frame
        return
    keys = frame[list(by)].round(DIGITS).sort_values(list(by), na_position="first", kind="stable")
    for values, members in keys.groupby(list(by), sort=False, dropna=False, observed=True):
        yield tuple(map(plain, values)), frame.loc[members.index]


def plain(value: Any) -> Any:
    """A value of a cell as JSON takes it: None if it is missing, a list [low, high] if it is a range."""
    if isinstance(value, pd.Interval):
        return [plain(value.left), plain(value.right)]
    if pd.isna(value):
        return None
    return value.item() if hasattr(value, "item") else value


def distinct(frame: pd.DataFrame, name: str) -> list[Any]:
    """The values of a column in order, a missing one (None) first."""
    return [value for (value,), _ in groups(frame, [name])]


def is_finished(frame: pd.DataFrame, sweep: Mapping[str, Any]) -> bool:
    """Whether a sweep has run all that its suite asks for: only then does `sweep.json` know how many that were."""
    return bool(sweep.get("finished") == len(frame))


def varying(frame: pd.DataFrame, columns: Sequence[str] = CASE_COLUMNS) -> list[str]:
    """Those of the columns in which the rows differ, but for what a variant differs in by its own definition."""
    keys = frame[list(columns)].round(DIGITS)
    found = [name for name in columns if keys[name].nunique(dropna=False) > 1]
    if "variant" not in found:
        return found
    within = keys.groupby("variant", dropna=False)
    return [name for name in found if name == "variant" or (within[name].nunique(dropna=False) > 1).any()]


def recovered(frame: pd.DataFrame) -> pd.Series:
    """Whether each episode ended well."""
    return frame["outcome"] == "recovered"


def crashed(frame: pd.DataFrame) -> pd.Series:
    """Whether each episode ended in an error of the program: then nobody knows how the push would have ended."""
    return frame["outcome"] == "crashed"


def score(frame: pd.DataFrame) -> pd.Series:
    """How well each episode went: pushes of a train that were survived, else 1 if it was recovered."""
    return frame[SURVIVED].fillna(recovered(frame).astype("Int64"))


def reference_rows(frame: pd.DataFrame, sweep: Mapping[str, Any]) -> pd.DataFrame:
    """The rows of the full design, which is a suite's first variant; all rows if there are no variants.

    Args:
        frame: of a sweep, or of the pushes of its trains.
        sweep: what `sweep.json` says of it.
    """
    first = next(iter(sweep.get("variants") or {}), None)
    return frame if first is None else frame[frame["variant"] == first]


def each_push(frame: pd.DataFrame) -> pd.DataFrame:
    """Rows with each train taken apart: a row for each push that began, recovered if it was survived.

    What was predicted of a push and how large it was is then where it is in the row of a single push.
    """
    told = frame["pushes"].dropna().map(json.loads).explode().dropna()
    if told.empty:
        return frame
    pushes = pd.DataFrame(told.tolist(), index=told.index).rename(columns={"start": "push_start"})
    pushes["push_direction_deg"] = pushes["direction_deg"]
    trains = frame.drop(columns=pushes.columns, errors="ignore").join(pushes, how="right")
    trains["outcome"] = trains["outcome"].mask(trains["survived"].astype(bool), "recovered")
    found = pd.concat([frame[frame["pushes"].isna()], trains[frame.columns].astype(frame.dtypes)])
    return found.sort_index(kind="stable").reset_index(drop=True)
