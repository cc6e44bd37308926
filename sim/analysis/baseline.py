"""The outcomes that later runs are held to: a text file, small enough to review and to commit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from models.errors import InputError, one_line
from sim.analysis.frame import as_frame, distinct, is_finished, load_rows, records, recovered
from sim.analysis.thresholds import thresholds
from sim.results.columns import LATER, PARAMETERS, RENAMED, SCHEMA
from sim.results.table import read_sweep, write_bytes
from sim.results.train import SURVIVED

_KIND = "okiagari baseline"
_VERSION = 1
# The asked impulse says the same as the change of velocity.
_PARAMETERS = ("controller", *(name for name in PARAMETERS if name not in ("controller", "impulse")))
# All that pairing, thresholds and the words about an episode need; former versions had no variants.
_COLUMNS = ("episode", "seed", *_PARAMETERS, "outcome")
_NEEDED = tuple(name for name in _COLUMNS if name not in LATER)
_HEADER = ("suite", "seed", "robots", "versions", "commit")
# Lines of the file that are lists, one entry a line, so that a change of one outcome is a change of one line.
_LISTS = ("thresholds", "episodes")


class BaselineError(InputError):
    """A baseline is missing, damaged or cannot be made."""


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """What a sweep came to.

    Attributes:
        suite: its name.
        seed: the suite's.
        robots: who was pushed.
        versions: of Python and the libraries, of the robots, and of the files that controllers are made of.
        commit: of Okiagari.
        rows: episodes with name, seed, parameters, outcome, and how many pushes of a train were survived; what else a
            table has may be missing.
    """

    suite: str
    seed: int | None
    robots: tuple[str, ...]
    versions: Mapping[str, str]
    commit: str
    rows: pd.DataFrame


def of_sweep(folder: Path) -> Baseline:
    """What the sweep in a folder came to.

    Raises:
        ResultsError: if the folder cannot be read.
        BaselineError: if the sweep is not finished.
    """
    sweep = read_sweep(folder)
    rows = load_rows(folder)
    if not is_finished(rows, sweep):
        raise BaselineError(f"{str(folder)!r}: the sweep is not finished; repeat the command that began it to go on")
    sources = {name: one.get("source") for name, one in (sweep.get("controllers") or {}).items()}
    sources |= {f"robot {name}": source for name, source in (sweep.get("robots") or {}).items()}
    sources |= sweep.get("files") or {}
    return Baseline(
        suite=str(sweep["name"]),
        seed=sweep.get("seed"),
        robots=tuple(distinct(rows, "robot")),
        versions=(sweep.get("versions") or {}) | {name: source[:12] for name, source in sources.items() if source},
        commit=str(sweep.get("commit")),
        rows=rows,
    )


def write_baseline(baseline: Baseline, path: Path) -> None:
    """Write the file; the same sweep makes the same bytes.

    Raises:
        InputError: if it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BaselineError(f"{path}: cannot be written: {error.strerror}") from None
    write_bytes(_text(baseline).encode(), path)


def read_baseline(path: Path) -> Baseline:
    """Read a file of `write_baseline`.

    Raises:
        BaselineError: if it is missing or damaged, or its thresholds are not those of its episodes.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BaselineError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise BaselineError(f"{path}: not a baseline: {error}") from None
    if not isinstance(content, dict) or content.get("kind") != _KIND or content.get("version") != _VERSION:
        raise BaselineError(f"{path}: not a baseline of this version of Okiagari; make one with 'okiagari baseline'")
    try:
        rows = [
            dict(LATER) | {RENAMED.get(name, name): value for name, value in (content["parameters"] | one).items()}
            for one in content["episodes"]
        ]
        lacking = [name for row in rows for name in _NEEDED if name not in row]
        baseline = Baseline(
            suite=content["suite"],
            seed=content["seed"],
            robots=tuple(content["robots"]),
            versions=content["versions"],
            commit=content["commit"],
            rows=as_frame(pa.Table.from_pylist(rows, schema=SCHEMA)),
        )
    except (KeyError, TypeError, pa.ArrowInvalid) as error:
        raise BaselineError(f"{path}: damaged baseline: {one_line(error)} is missing or wrong") from None
    if lacking or not rows:
        raise BaselineError(
            f"{path}: damaged baseline: {f'an episode lacks {lacking[0]!r}' if lacking else 'no episode'}"
        )
    if content.get("thresholds") != _thresholds(baseline.rows):
        raise BaselineError(
            f"{path}: its thresholds are not those of its episodes; make it anew with 'okiagari baseline'"
        )
    return baseline


def _thresholds(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Only for the eye of a reviewer: they follow from the episodes."""
    return [
        {"controller": one.controller, "direction_deg": one.direction_deg}
        | ({"case": one.case} if one.case else {})
        | {"delta_v": one.delta_v, "ever": one.ever}
        for one in thresholds(rows)
    ]


def _text(baseline: Baseline) -> str:
    rows = baseline.rows
    constant = {name: values[0] for name in _PARAMETERS if len(values := distinct(rows, name)) == 1}
    written = [*_COLUMNS] if rows[SURVIVED].isna().all() else [*_COLUMNS, SURVIVED]
    ordered = rows.sort_values([*_PARAMETERS, "episode"], na_position="first", kind="stable")
    content: dict[str, Any] = {"kind": _KIND, "version": _VERSION}
    content |= {name: getattr(baseline, name) for name in _HEADER}
    content |= {
        "recovered": f"{recovered(rows).sum()} of {len(rows)}",
        "parameters": constant,
        "thresholds": _thresholds(rows),
        "episodes": records(ordered[[name for name in written if name not in constant]]),
    }
    lines = []
    for name, value in content.items():
        if name in _LISTS:
            entries = ",\n".join("  " + json.dumps(entry, allow_nan=False) for entry in value)
            lines.append(f' "{name}": [\n{entries}\n ]' if value else f' "{name}": []')
        else:
            lines.append(f' "{name}": {json.dumps(value, allow_nan=False)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"
