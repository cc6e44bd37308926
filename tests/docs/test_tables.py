"""The tables of the pages have every field and every column, with the defaults and units of the code."""

from __future__ import annotations

import importlib
import json
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from models.adopt.hints import Hints
from scenarios.catalogue import load
from scenarios.schema import Scenario
from scenarios.suite import Suite
from sim.episode.episode import run_episode
from sim.episode.push_record import PushRecord, TorqueRecord
from sim.episode.run_folder import outcome_record
from sim.record.motors import MotorUse
from sim.record.trace import ROOT_CHANNELS, SEEN_CHANNELS, SEEN_STANCE_CHANNELS, TRACE_CHANNELS
from sim.results.columns import COLUMNS
from tests.docs.pages import HOUSE, names, tables

RESULTS = HOUSE / "docs" / "results.md"
OPTIONS = "controllers.learned.onnx_policy.OnnxPolicy.Options"


def models_in(model: type[BaseModel]) -> set[type[BaseModel]]:
    """A table of a file, and all tables within it."""
    found, waiting = set[type[BaseModel]](), [model]
    while waiting:
        one = waiting.pop()
        if one not in found:
            found.add(one)
            waiting += [inner for field in one.model_fields.values() for inner in _within(field.annotation)]
    return found


def _within(annotation: Any) -> Iterator[type[BaseModel]]:
    # A class that is named has options of its own, and is no table of fields.
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        if annotation.__name__ != "Choice":
            yield annotation
        return
    for part in get_args(annotation):
        yield from _within(part)


def path_of(model: type[BaseModel]) -> str:
    return f"{model.__module__}.{model.__qualname__}"


def model_at(path: str) -> type[BaseModel]:
    parts = path.split(".")
    for count in range(len(parts) - 1, 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for name in parts[count:]:
            found = getattr(found, name)
        assert issubclass(found, BaseModel)
        return found
    raise AssertionError(path)


FIELD_TABLES = [
    (page.name, path, rows) for page in sorted((HOUSE / "docs").glob("*.md")) for path, rows in tables(page, "fields")
]


@pytest.mark.parametrize(
    ("pages", "whole"),
    [({"scenario.md", "sensing.md"}, Scenario), ({"suite.md"}, Suite), ({"robots.md"}, Hints)],
    ids=["scenario", "suite", "hints"],
)
def test_every_table_of_a_file_has_one_in_its_pages(pages: set[str], whole: type[BaseModel]) -> None:
    told = {path for name, path, _ in FIELD_TABLES if name in pages}
    assert told == {path_of(model) for model in models_in(whole)}


@pytest.mark.parametrize(("page", "path", "rows"), FIELD_TABLES, ids=[path for _, path, _ in FIELD_TABLES])
def test_a_table_has_every_field_with_its_default(page: str, path: str, rows: list[list[str]]) -> None:
    model = model_at(path)
    assert sorted(name for row in rows for name in names(row[0])) == sorted(model.model_fields)
    for cell, default, *_ in rows:
        for name in names(cell):
            field = model.model_fields[name]
            if field.is_required():
                assert default == "needed", name
            elif values := names(default):
                (value,) = values
                kept = field.default
                plain = kept.model_dump(mode="json") if isinstance(kept, BaseModel) else kept
                plain = list(plain) if isinstance(plain, tuple) else plain
                assert tomllib.loads(f"x = {value}")["x"] == plain, name
            else:
                # Said in words: nothing, or a table whose own fields are told apart.
                empty = field.default is None or isinstance(field.default, BaseModel) or not field.default
                assert empty, f"{name}: its default, {field.default!r}, is not told"


def test_options_of_policies_are_all_told() -> None:
    assert OPTIONS in {path for _, path, _ in FIELD_TABLES}


def test_columns_of_a_sweep_are_those_of_the_table() -> None:
    ((_, rows),) = [one for one in tables(RESULTS, "columns") if one[0] == "results.parquet"]
    told = {names(name)[0]: (unit, meaning) for name, unit, meaning in rows}
    assert told == {name: (column.unit, column.meaning) for name, column in COLUMNS.items()}
    assert list(told) == list(COLUMNS)


def test_columns_of_a_trace_are_those_of_the_recorder() -> None:
    ((_, rows),) = [one for one in tables(RESULTS, "columns") if one[0] == "trace.parquet"]
    told = [(name, unit) for cell, unit, _ in rows for name in names(cell)]
    assert told == [*TRACE_CHANNELS.items(), *ROOT_CHANNELS.items()]
    ((_, rows),) = [one for one in tables(RESULTS, "columns") if one[0] == "trace.parquet, senses"]
    told = [(name, unit) for cell, unit, _ in rows for name in names(cell)]
    assert told == [*SEEN_CHANNELS.items(), *SEEN_STANCE_CHANNELS.items()]


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    """What `outcome.json` holds of an episode on the body."""
    push = {"start": 0.1, "direction": 0.0, "delta_v": 0.1}
    return outcome_record(run_episode(load("quiet", {"duration": 0.5, "pushes": [push]}), polygons=False))


@pytest.mark.parametrize("what", ["outcome.json", "pushes", "motors", "torque"])
def test_outcome_is_told_whole(what: str, record: dict[str, Any]) -> None:
    wanted = {
        "outcome.json": [*record],
        "pushes": [*record["pushes"][0]],
        "motors": [field.name for field in fields(MotorUse)],
        "torque": [field.name for field in fields(TorqueRecord)][len(fields(PushRecord)) :],
    }[what]
    told = [name for of, rows in tables(RESULTS, "keys") if of == what for row in rows for name in names(row[0])]
    assert sorted(told) == sorted(wanted)


def test_summary_is_told_whole(tmp_path: Path) -> None:
    from sim.cli.app import main

    suite = tmp_path / "tiny.toml"
    axes = '[axes]\nworld = ["pendulum"]\ndirection = [0]\ndelta_v = [0.05]\nstart = [0.1]\n'
    suite.write_text(f'description = "one push"\nafter = 1.0\n{axes}')
    assert main(["sweep", str(suite), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    told = [
        name for of, rows in tables(RESULTS, "keys") if of == "summary.json" for row in rows for name in names(row[0])
    ]
    assert sorted(told) == sorted(written)
