"""The one presenter of a summary: the same words in the terminal, in Markdown and on the page."""

from __future__ import annotations

import base64
import html
import re
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from sim.analysis.summary import summarise
from sim.cli.app import app
from sim.presenter.formatting import case_words, condensed, fixed, fraction, percent, replica_words
from sim.presenter.render import markdown, print_sections
from sim.presenter.sections import sections
from sim.presenter.threshold_section import envelope_table
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import CONTROLLERS, LIMITS, adaptive, folder_of, frame, sweep_facts, threshold_law

STRANGE = "my_controller.py:A$b$ [bold]<i>|*x*"


def summary(rows: list[dict[str, Any]], **facts: Any) -> dict[str, Any]:
    return summarise(frame(rows), sweep_facts(rows, **facts))


def printed(told: dict[str, Any], width: int) -> str:
    stream = StringIO()
    print_sections(sections(told), Console(file=stream, width=width, force_terminal=False, highlight=False))
    return stream.getvalue()


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    return summary(adaptive(threshold_law(LIMITS)))


def test_prints_what_is_promised(told: dict[str, Any]) -> None:
    words = ("supervisor", "regulator (never steps)", "315°", "worst", "[m/s]", "false safe", "humanoid", "left_knee")
    for word in words:
        assert word in printed(told, 80)


@pytest.mark.parametrize("width", [60, 80, 10_000])
def test_no_number_is_cut_or_broken(told: dict[str, Any], width: int) -> None:
    text = printed(told, width)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    found = text.split()
    for section in sections(told):
        for table in section.tables:
            if table.shown == "everywhere":
                numbers = (cell for heading in table.numbers for cell in table.columns[heading])
                assert all(part in found for cell in numbers for part in cell.split())


def test_what_is_piped_is_not_folded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = adaptive(threshold_law(LIMITS))
    app(args=["summary", str(folder_of(tmp_path / "sweep", rows))], prog_name="okiagari", standalone_mode=False)
    out = capsys.readouterr().out
    (line,) = (line for line in out.splitlines() if line.strip().startswith("45°"))
    # The limits, and the thresholds of three controllers, in one line.
    assert len(line.split()) == 1 + 2 + 3 * 4


def test_page_and_terminal_tell_the_same(tmp_path: Path, told: dict[str, Any]) -> None:
    folder = folder_of(tmp_path / "sweep", adaptive(threshold_law(LIMITS)))
    write_report(folder, folder / REPORT, failures=0)
    page = html.unescape((folder / REPORT).read_text(encoding="utf-8"))
    assert page.count('<div class="scroll"') == sum(len(section.tables) for section in sections(told))
    # The thresholds go on beyond the edge of a phone.
    assert re.search(r'scroll sideways →</p>\s*<div class="scroll" tabindex="0"><table>\s*<caption>Robust', page)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", page)
    assert cells == [
        table.columns[heading][i]
        for section in sections(told)
        for table in section.tables
        for i in range(len(table.rows))
        for heading in table.columns
    ]


def test_names_are_no_markup_anywhere(tmp_path: Path) -> None:
    rows = [
        one | {"controller": {"supervisor": STRANGE}.get(one["controller"], "_hidden")}
        for one in adaptive(threshold_law(LIMITS), controllers=["supervisor", "statue"], directions=[0.0, 45.0])
    ]
    found = summary(rows)
    assert STRANGE in printed(found, 10_000)
    text = markdown(envelope_table(found, {}))
    assert r"| my_controller.py:A$b$ [bold]\<i>\|\*x\* |" in text
    assert r"| \_hidden |" in text
    folder = folder_of(tmp_path / "sweep", rows)
    write_report(folder, folder / REPORT, failures=0)
    page = (folder / REPORT).read_text(encoding="utf-8")
    assert STRANGE not in page
    assert html.escape(STRANGE, quote=False) in page
    pictures = [base64.b64decode(found).decode() for found in re.findall(r"svg\+xml;base64,([^\"]*)", page)]
    # Titles and legends of the envelopes, the heat maps and the curves.
    assert sum(html.escape(STRANGE, quote=False) in picture for picture in pictures) == 4
    assert sum("_hidden" in picture for picture in pictures) == 4


def test_labels_are_what_people_see_and_the_order_is_the_sweeps(told: dict[str, Any]) -> None:
    assert list(told["controllers_shown"]) == list(CONTROLLERS)
    rows = envelope_table(told, {}).rows
    assert [row["Δv/(ωd)"] for row in rows] == [look["label"] for look in CONTROLLERS.values()]
    turned = dict(reversed(CONTROLLERS.items()))
    other = summary(adaptive(threshold_law(LIMITS)), controllers=turned)
    assert list(other["controllers_shown"]) == list(turned)


def test_worst_of_the_suite_s_highest_level_is_a_bound() -> None:
    def one(size: float | None, capped: bool) -> dict[str, Any]:
        return {"size": size, "capped": capped}

    assert condensed([one(1.0, True), one(2.0, True)], "size") == ("≥ 1.50", "≥ 1.00")
    assert condensed([one(1.0, False), one(2.0, True)], "size") == ("≥ 1.50", "1.00")
    assert condensed([one(1.0, True), one(1.0, False)], "size") == ("≥ 1.00", "1.00")
    assert condensed([one(1.0, False), one(2.0, False)], "size", 1) == ("1.5", "1.0")
    assert condensed([one(None, False)], "size") == ("–", "–")
    found = summary(adaptive(lambda _: True, controllers=["supervisor"], levels=6))
    assert "≥ 0.30" in printed(found, 80)


@pytest.mark.parametrize(
    ("replicas", "words"),
    [(1, "its only replica"), (2, "both replicas"), (3, "all 3 replicas"), (5, "at least 4 of 5 replicas")],
)
def test_replicas_are_the_suite_s(replicas: int, words: str) -> None:
    found = summary(adaptive(threshold_law(LIMITS), replicas=replicas, directions=[0.0]))
    assert found["replicas"] == replicas
    assert replica_words(replicas) == words
    assert f"is recovered in {words};" in printed(found, 10_000)


def test_crashes_are_told() -> None:
    rows = adaptive(threshold_law(LIMITS), directions=[0.0])
    assert "Crashed" not in printed(summary(rows), 80)
    for one in rows[:3]:
        one["outcome"] = "crashed"
    text = printed(summary(rows), 10_000)
    assert "Crashed by an error of the program, which counts as not recovered: 3 (supervisor)." in text


def test_robots_are_told_apart(tmp_path: Path) -> None:
    weak = {name: 0.5 * limit for name, limit in LIMITS.items()}
    rows = adaptive(threshold_law(LIMITS)) + adaptive(threshold_law(weak), robot="gone")
    text = printed(summary(rows), 10_000)
    for robot in ("utmu2", "gone"):
        assert f"{robot}: Robust recoverable push" in text
    assert "case" not in text
    folder = folder_of(tmp_path / "sweep", rows)
    write_report(folder, folder / REPORT, failures=0)
    page = (folder / REPORT).read_text(encoding="utf-8")
    assert "How hard it can be pushed – gone" in page
    assert "How hard it can be pushed – utmu2" in page
    assert "utmu2: robust Δv/(ωd) of the supervisor" in page


def test_words() -> None:
    rate = {"n": 50, "count": 41, "rate": 0.82, "interval": [0.69, 0.902]}
    assert percent(rate) == "82 % [69, 90]"
    assert fraction(rate) == "41 of 50"
    assert percent({"n": 0, "count": 0, "rate": None, "interval": None}) == "–"
    assert fixed(0.5, capped=True) == "≥ 0.50"
    assert fixed(None) == "–"
    assert case_words({"mass_scale": 1.1, "friction": None}) == "mass scale 1.1, friction as the scenario has it"


def test_a_threshold_above_a_hole_is_marked_wherever_it_is_shown(told: dict[str, Any]) -> None:
    own = next(one for one in told["robust"] if one["controller"] == "supervisor" and one["direction_deg"] == 90.0)
    hole = {
        "episode": "0" * 12,
        "controller": "supervisor",
        "direction_deg": 90.0,
        "replica": 0,
        "delta_v": 0.5 * own["delta_v"],
        "outcome": "fell",
        "reason": "tilt",
        "of_threshold": 0.5,
    }
    assert "*: above a hole" not in printed(told | {"holes": []}, 200)
    holed = told | {"holes": [hole]}
    text = printed(holed, 200)
    assert f"{own['over_omega_d']:.2f} *" in text
    assert "*: above a hole" in text
    table = envelope_table(holed, {})
    (row,) = (row for row in table.rows if row["Δv/(ωd)"] == "supervisor")
    assert [way for way, cell in row.items() if str(cell).endswith(" *")] == ["90°"]
