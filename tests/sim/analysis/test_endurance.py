"""Trains in the summary, the report and the check: medians, survival, and every push scored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from models.errors import InputError
from sim.analysis.baseline import of_sweep, read_baseline, write_baseline
from sim.analysis.check import NotComparable, compare, describe
from sim.analysis.endurance import endurance
from sim.analysis.frame import each_push
from sim.analysis.statistics import spread
from sim.analysis.summary import summarise
from sim.presenter.render import print_sections
from sim.presenter.sections import sections
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import folder_of, frame, sweep_facts, train_row

COUNTS = {"supervisor": [4, 9, 7, 10, 6, 7, 8, 5], "regulator": [3, 3, 4, 3, 2, 3, 4, 3]}
TRAIN = {"count": 10, "interval": 3.0, "first": 0.5, "growth": 0.1, "direction": [0.0, 360.0]}


def table(counts: dict[str, list[int]], **parameters: Any) -> list[dict[str, Any]]:
    return [
        train_row(count, controller=name, replica=i, **parameters)
        for name, survived in counts.items()
        for i, count in enumerate(survived)
    ]


def test_spread_is_of_the_values_in_whatever_order() -> None:
    values = [float(value) for value in (1, 2, 2, 3, 4, 4, 5, 7, 9, 30)]
    found = spread(values)
    assert found["median"] == 4.0
    assert found["quartiles"] == [2.25, 6.5]
    low, high = found["interval"]
    assert 1.0 <= low < 4.0 < high < 30.0
    assert spread(values[::-1]) == found
    assert spread([3.0])["interval"] == [3.0, 3.0]


def test_interval_of_the_median_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(200):
        low, high = spread(rng.exponential(1.0, 20).tolist())["interval"]
        covered += low <= np.log(2.0) <= high
    # Binomial: 95 % of 200 with a standard deviation of 1.5 %; the bootstrap of so few errs by a point or two.
    assert 0.90 <= covered / 200 <= 0.99


def test_entry_for_every_controller() -> None:
    found = {entry["controller"]: entry for entry in endurance(frame(table(COUNTS)))}
    assert found.keys() == COUNTS.keys()
    one = found["supervisor"]
    assert (one["n"], one["pushes"], one["survived_all"]) == (8, 10, 1)
    assert one["pushes_survived"]["median"] == 7.0
    assert one["pushes_survived"]["quartiles"] == [5.75, 8.25]
    assert "case" not in one
    counts = [rate["count"] for rate in one["survival"]]
    assert counts == [8, 8, 8, 8, 8, 7, 6, 5, 3, 2, 1]
    assert all(rate["n"] == 8 for rate in one["survival"])


def test_cases_are_kept_apart() -> None:
    rows = table(COUNTS) + table({"supervisor": [10] * 8}, world="pendulum")
    found = {(entry["controller"], entry["case"]["world"]): entry for entry in endurance(frame(rows))}
    assert found["supervisor", "pendulum"]["survived_all"] == 8
    assert found["supervisor", "humanoid"]["survived_all"] == 1


def crash(row: dict[str, Any]) -> None:
    row |= {"outcome": "crashed", "pushes_survived": None, "total_impulse": None, "pushes": None}


def test_crashed_trains_are_counted_not_survived() -> None:
    rows = table(COUNTS)
    crash(rows[0])
    summary = summarise(frame(rows), sweep_facts(rows))
    assert next(one for one in summary["endurance"] if one["controller"] == "supervisor")["n"] == 7
    assert summary["outcomes"]["crashed"] == 1
    assert sum(one["crashed"] for one in summary["rates"] if list(one["by"]) == ["controller"]) == 1


def test_summary_scores_every_push() -> None:
    rows = table(COUNTS)
    summary = summarise(frame(rows), sweep_facts(rows, train=TRAIN))
    survived = sum(map(sum, COUNTS.values()))
    assert summary["episodes"] == len(rows) == 16
    total = next(one for one in summary["rates"] if not one["by"])
    lost = sum(count < 10 for counts in COUNTS.values() for count in counts)
    assert (total["count"], total["n"], total["fell"]) == (survived, survived + lost, lost)
    matrix = summary["prediction_score"]["confusion"]["humanoid"]
    assert sum(matrix.values()) == survived + lost
    assert summary["robust"] == summary["holes"] == []


def test_is_printed_and_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = table(COUNTS)
    crash(rows[-1])
    folder = folder_of(tmp_path / "sweep", rows, train=TRAIN, tuned_on="others; these were held out")
    print_sections(
        sections(summarise(frame(rows), sweep_facts(rows, train=TRAIN))), Console(width=80, force_terminal=False)
    )
    printed = capsys.readouterr().out
    assert "Pushes survived before the fall" in printed
    assert "5.75 to 8.25" in printed
    assert "not recovered: 1 (regulator (never steps))" in " ".join(printed.split())
    assert max(map(len, printed.splitlines())) <= 80
    write_report(folder, folder / REPORT, failures=0)
    page = (folder / REPORT).read_text(encoding="utf-8")
    for words in (
        "How many pushes it survives",
        "survived all",
        "one every 3 s",
        "tuned on others; these were held out.",
        "Share still standing after each push",
        "Of the pushes that were run",
        "Motors",
    ):
        assert words in page
    assert "How hard it can be pushed" not in page


def baseline_of(path: Path, rows: list[dict[str, Any]]) -> Path:
    folder_of(path, rows)
    write_baseline(of_sweep(path), path.with_suffix(".json"))
    return path.with_suffix(".json")


def test_fewer_pushes_are_noticed_and_more_are_not(tmp_path: Path) -> None:
    then = read_baseline(baseline_of(tmp_path / "then", table(COUNTS)))
    same = compare(then, then)
    assert (same.trains, same.lost, same.gained, same.worse) == (True, [], [], False)
    weaker = {name: [count - 1 for count in counts] for name, counts in COUNTS.items()}
    now = of_sweep(folder_of(tmp_path / "now", table(weaker)))
    found = compare(then, now)
    assert found.worse
    assert (len(found.lost), len(found.gained)) == (16, 0)
    total = sum(map(sum, COUNTS.values()))
    assert found.counts == f"{total} pushes survived then, {total - 16} now, in 16 trains"
    assert describe(found.lost[0]).count("°") == 0
    assert not compare(now, then).worse


def test_trains_that_were_not_run_again_are_missed(tmp_path: Path) -> None:
    then = read_baseline(baseline_of(tmp_path / "then", table(COUNTS)))
    fewer = {name: counts[:-1] for name, counts in COUNTS.items()}
    now = of_sweep(folder_of(tmp_path / "now", table(fewer)))
    with pytest.raises(NotComparable, match="was not run now"):
        compare(then, now)
    assert compare(now, then).unpaired == 2


def test_baseline_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = baseline_of(tmp_path / "then", table(COUNTS))
    rows = read_baseline(path).rows
    assert sorted(rows["pushes_survived"]) == sorted(count for counts in COUNTS.values() for count in counts)
    path.write_text(path.read_text().replace('"outcome"', '"outcom"', 1))
    with pytest.raises(InputError, match="lacks 'outcome'"):
        read_baseline(path)


def test_pushes_are_rows_that_can_be_judged() -> None:
    trains = frame(table({"supervisor": [4]}))
    pushes = each_push(trains)
    assert pushes["outcome"].tolist() == ["recovered"] * 4 + ["fell"]
    assert pushes["direction_deg"].tolist() == [0.0, 36.0, 72.0, 108.0, 144.0]
    assert pushes["in_regulator_set_end"].tolist() == [True] * 5
    assert pushes.dtypes.equals(trains.dtypes)
