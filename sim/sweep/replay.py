"""Runs one row of a sweep again, and says whether every bit of it came back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.compute as pc
from pydantic import ValidationError

from models.errors import InputError
from scenarios.error_messages import first_error
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode
from sim.record.versions import commit
from sim.results.table import read_results
from sim.sweep.worker import CRASHED, happened, makers_of


@dataclass(frozen=True, kw_only=True)
class Replay:
    """What came of it.

    Attributes:
        row: of the sweep.
        result: of the episode now.
        changed: columns of the outcome that differ: then and now; empty if it is bit-identical.
        versions: what differs of the versions and the commit: then and now.
    """

    row: Mapping[str, Any]
    result: EpisodeResult
    changed: Mapping[str, tuple[Any, Any]]
    versions: Mapping[str, tuple[str, str]]

    @property
    def identical(self) -> bool:
        """Whether every number of the trace and every column of the outcome is the same."""
        return not self.changed

    def words(self) -> str:
        """The verdict, in one line."""
        then, now = self.row["outcome"], self.result.outcome.result.value
        if self.identical:
            return f"bit-identical: {now}, trace {self.row['trace_hash'][:12]}"
        what = f"differs in {', '.join(self.changed)}: was {then}, is {now}"
        if not self.versions:
            return f"{what}; versions and commit are the same, so the machine must differ"
        why = ", ".join(f"{name} {before} then, {after} now" for name, (before, after) in self.versions.items())
        return f"{what}; {why}"


def find_row(folder: Path, name: str) -> dict[str, Any]:
    """The row of an episode.

    Args:
        folder: of a sweep.
        name: of the episode, or enough of its beginning.

    Raises:
        InputError: if there is none or several, or the folder is damaged.
    """
    table = read_results(folder)
    rows = table.filter(pc.starts_with(table["episode"], name)).to_pylist()
    if not rows or not name:
        example = table["episode"][0].as_py()
        raise InputError(
            f"{str(folder)!r} has no episode {name!r}; its {table.num_rows} episodes are named like {example}"
        )
    if len(rows) > 1:
        raise InputError(f"{str(folder)!r} has {len(rows)} episodes that begin with {name!r}; give more of the name")
    found: dict[str, Any] = rows[0]
    return found


def replay(folder: Path, name: str) -> Replay:
    """Run an episode of a sweep again.

    Args:
        folder: of the sweep.
        name: of the episode, or enough of its beginning.

    Raises:
        InputError: see `find_row`; or if the robot is gone.
    """
    row = find_row(folder, name)
    scenario = scenario_of_row(row)
    result = run_episode(scenario)
    now = happened(result, train=row["train"] is not None)
    changed = {key: (row[key], now[key]) for key in now if not _same(row[key], now[key])}
    before = json.loads(row["versions"]) | {"commit": row["commit"]}
    after = makers_of(scenario) | {"commit": commit()}
    differ = {key: (before.get(key, "none"), after.get(key, "none")) for key in {**before, **after}}
    return Replay(
        row=row,
        result=result,
        changed=changed,
        versions={key: pair for key, pair in differ.items() if pair[0] != pair[1]},
    )


def scenario_of_row(row: Mapping[str, Any]) -> Scenario:
    """The scenario that a row was run with.

    Raises:
        InputError: if it is none any more, for instance since its controller's file is gone.
    """
    try:
        return Scenario.model_validate(json.loads(row["scenario"]))
    except ValidationError as error:
        raise InputError(f"episode {row['episode']}: {first_error(error, Scenario)}") from None


def crashed(row: Mapping[str, Any]) -> bool:
    """Whether the row is of an episode that ended in an error of the program."""
    return bool(row["outcome"] == CRASHED)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float) and math.isnan(one):
        return math.isnan(other)
    return bool(one == other)
