"""An episode of a sweep comes back bit for bit, or it is said what has changed since."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from models.errors import InputError
from sim.results import table as results
from sim.results.table import SWEEP, as_table, read_results
from sim.sweep.replay import find_row, replay
from sim.sweep.sweep import run_sweep
from tests.sim.sweep.sweep_suites import HERE, HUMANOID, suite

SHORT = HUMANOID.replace('"supervisor", ', "")


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a sweep over one humanoid episode and one on the pendulum."""
    folder = tmp_path_factory.mktemp("swept")
    run_sweep(suite(folder, SHORT.replace('["humanoid"]', '["humanoid", "pendulum"]')), folder / "out", HERE)
    return folder / "out"


def rows(folder: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read_results(folder).to_pylist()
    return found


def forged(row: dict[str, Any], folder: Path) -> Path:
    """A sweep's folder with this row."""
    folder.mkdir()
    (folder / SWEEP).write_text("{}")
    results.write_table(as_table([row]), folder / results.RESULTS)
    return folder


def test_every_bit_comes_back(swept: Path) -> None:
    for row in rows(swept):
        again = replay(swept, row["episode"])
        assert again.identical
        assert again.words() == f"bit-identical: {row['outcome']}, trace {row['trace_hash'][:12]}"


def test_a_bit_that_differs_is_noticed(swept: Path, tmp_path: Path) -> None:
    row = rows(swept)[0]
    changed = forged(row | {"trace_hash": "0" * 64}, tmp_path / "a")
    again = replay(changed, row["episode"])
    assert not again.identical
    assert again.words().startswith("differs in trace_hash: was ")


def test_it_says_which_version_differs(swept: Path, tmp_path: Path) -> None:
    row = rows(swept)[0]
    versions = json.loads(row["versions"])
    older = row | {"trace_hash": "0" * 64, "versions": json.dumps(versions | {"mujoco": "3.0.0"})}
    again = replay(forged(older, tmp_path / "a"), row["episode"])
    assert dict(again.versions)["mujoco"] == ("3.0.0", versions["mujoco"])
    assert f"mujoco 3.0.0 then, {versions['mujoco']} now" in again.words()
    # Other versions that give the same bits are no difference.
    same = forged(older | {"trace_hash": row["trace_hash"]}, tmp_path / "b")
    assert replay(same, row["episode"]).identical


def test_beginning_of_a_name_is_enough_if_there_is_one_such(swept: Path) -> None:
    row, other = rows(swept)
    length = next(i for i in range(12) if row["episode"][: i + 1] != other["episode"][: i + 1]) + 1
    assert find_row(swept, row["episode"][:length]) == row
    with pytest.raises(InputError, match=f"has no episode 'zz'; its 2 episodes are named like {row['episode']}"):
        find_row(swept, "zz")
    with pytest.raises(InputError, match="has no episode ''"):
        find_row(swept, "")
