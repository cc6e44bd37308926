"""The ablation compares variants push by push, in one command."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from scipy.stats import binomtest

from models.errors import InputError
from sim.analysis import ablation as analysis
from sim.analysis.frame import reference_rows, varying
from sim.analysis.summary import summarise
from sim.analysis.thresholds import thresholds
from sim.presenter.render import markdown, print_sections
from sim.presenter.sections import ablation_table, sections
from sim.report.ablation_chart import ABLATION, draw_ablation
from sim.report.report import REPORT, write_report
from sim.results.table import read_results
from tests.sim.analysis.sweep_tables import OMEGA, edge, folder_of, frame, row, sweep_facts
from tests.sim.program import call
from tests.sim.sweep.test_variants import VARIANTS

DESIGNS: dict[str, dict[str, Any]] = {"full": {}, "weak | pale": {"stepping.max_steps": 1}, "alike": {"gain.k": 1.6}}
LIMITS = {"full": 2.0, "weak | pale": 1.4, "alike": 2.0}
SIZES = (1.0, 1.3, 1.6, 1.9, 2.2)
WAYS = (22.5, 112.5, 202.5, 292.5)


def table(ways: tuple[float, ...] = WAYS, **parameters: Any) -> list[dict[str, Any]]:
    """Rows of a suite with variants; one push, forward left, only the weak one recovers."""
    rows = []
    for variant in DESIGNS:
        for way in ways:
            for size in SIZES:
                for replica in (0, 1):

                    def law(asked: Mapping[str, Any], variant: str = variant, size: float = size) -> bool:
                        if (asked["direction_deg"], size, asked["replica"]) == (22.5, 1.9, 1):
                            return variant == "weak | pale"
                        return size <= LIMITS[variant]

                    pushed = {"direction_deg": way, "delta_v": round(size * OMEGA * edge(way), 6), "replica": replica}
                    one = row(law, variant=variant, **pushed, **parameters)
                    # As in a sweep, of the push and not of who answers it.
                    rows.append(one | {"seed": hash((way, size, replica)) % 2**32})
    return rows


def facts(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return sweep_facts(rows, variants=DESIGNS)


def ablation(rows: list[dict[str, Any]], sweep: dict[str, Any]) -> dict[str, Any] | None:
    return analysis.ablation(frame(rows), sweep)


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folder_of(tmp_path_factory.mktemp("ablation") / "sweep", table(), variants=DESIGNS)


def test_variants_are_compared_push_by_push() -> None:
    rows = table()
    section = ablation(rows, facts(rows))
    assert section is not None
    full, weak, alike = section["designs"]
    # 4 directions, 2 replicas: sizes up to 1.9 but for one push; up to 1.3 and that one.
    assert [one["recovered"]["count"] for one in section["designs"]] == [31, 17, 31]
    assert full["against"] is None
    assert (weak["against"]["pairs"], weak["against"]["lost"], weak["against"]["gained"]) == (40, 15, 1)
    assert weak["against"]["difference"] == pytest.approx(-14 / 40)
    # The exact McNemar test is a sign test of the pairs that differ.
    assert weak["against"]["p"] == pytest.approx(binomtest(1, 16).pvalue)
    assert (alike["against"]["difference"], alike["against"]["p"]) == (0.0, 1.0)
    assert [there["direction_deg"] for there in weak["by_direction"]] == list(WAYS)
    assert [(there["count"], there["n"]) for there in weak["by_direction"]] == [(5, 10), (4, 10), (4, 10), (4, 10)]


def test_pushes_that_only_one_variant_was_given_are_not_compared() -> None:
    rows = [one for one in table() if one["variant"] != "alike" or one["direction_deg"] == 112.5]
    section = ablation(rows, facts(rows))
    assert section is not None
    assert [one["recovered"]["n"] for one in section["designs"]] == [40, 40, 10]
    assert section["designs"][2]["against"]["pairs"] == 10
    nothing = ablation([one for one in rows if one["variant"] != "alike"], facts(rows))
    assert nothing is not None
    assert nothing["designs"][2]["against"]["p"] is None
    assert "| alike | – | – | – | – | – |" in markdown(ablation_table(nothing))


def test_crashed_is_not_lost() -> None:
    rows = table()
    for one in rows:
        if one["variant"] == "alike":
            one["outcome"] = "crashed"
    rows[0]["outcome"] = "crashed"
    section = ablation(rows, facts(rows))
    assert section is not None
    full, weak, alike = section["designs"]
    assert [(one["recovered"]["n"], one["crashed"]) for one in section["designs"]] == [(39, 1), (40, 0), (0, 40)]
    assert full["by_direction"][0]["n"] == 9
    assert weak["against"]["pairs"] == 39
    assert (alike["against"]["pairs"], alike["against"]["lost"], alike["against"]["p"]) == (0, 0, None)
    assert alike["by_direction"] == []
    told = markdown(ablation_table(section))
    assert "| alike | – | – | 40 | – | – | – | – | – | – | – |" in told
    assert "episodes that crashed are counted apart" in told
    words = [text.get_text() for text in draw_ablation(section).axes[0].texts]
    assert words[2] == "40 crashed"


def test_the_same_push_in_two_worlds_is_two_pushes() -> None:
    rows = table() + table(world="pendulum")
    section = ablation(rows, facts(rows))
    assert section is not None
    assert (section["designs"][1]["against"]["pairs"], section["designs"][1]["against"]["lost"]) == (80, 30)


def test_many_directions_are_sorted_into_sectors() -> None:
    rows = table(tuple(10.0 * i for i in range(36)))
    section = ablation(rows, facts(rows))
    assert section is not None
    assert section["sectors"]
    assert [there["direction_deg"] for there in section["designs"][0]["by_direction"]] == [45.0 * i for i in range(8)]
    assert sum(there["n"] for there in section["designs"][0]["by_direction"]) == 360


def test_a_suite_without_variants_has_none() -> None:
    rows = [one | {"variant": None} for one in table()]
    assert ablation(rows, sweep_facts(rows)) is None
    assert len(reference_rows(frame(rows), sweep_facts(rows))) == len(rows)


def test_thresholds_are_of_each_variant_and_direction_s_own_sizes() -> None:
    rows = [one | {"whole_body": "ik" if one["variant"] == "alike" else "dynamics"} for one in table()]
    assert varying(frame(rows)) == ["variant"]
    found = {(one.case["variant"], one.direction_deg): one for one in thresholds(frame(rows))}
    assert len(found) == 12
    # Made of sizes in m/s with six digits.
    for name, size in (("full", 1.9), ("weak | pale", 1.3), ("alike", 1.9)):
        assert found[name, 112.5].over_omega_d == pytest.approx(size, rel=1e-5)
    assert not any(one.capped for one in found.values())


def test_what_the_sets_foretold_is_scored_for_the_full_design_alone() -> None:
    rows = table()
    confusion = summarise(frame(rows), facts(rows))["prediction_score"]["confusion"]["humanoid"]
    assert sum(confusion.values()) == 40
    assert confusion["safe_recovered"] + confusion["unsafe_recovered"] == 31


def test_folder_is_shown_as_a_table_and_bars(sweep: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert call("ablation", sweep) == 0
    output = capsys.readouterr()
    lines = [line for line in output.out.splitlines() if line.startswith("|")]
    assert lines[0] == "| variant | recovered | [95 %] | difference | pushes that differ | p | " + (
        "22.5° | 112.5° | 202.5° | 292.5° |"
    )
    assert lines[3].startswith(
        "| weak \\| pale | 17 of 40 | 42 % [29, 58] | −35 | 15 lost, 1 gained | < 0.001 | 5 of 10 |"
    )
    assert lines[4].startswith("| alike | 31 of 40 | 78 % [62, 88] | +0 | 0 lost, 0 gained | 1.000 |")
    assert "not corrected" in output.out
    with Image.open(sweep / ABLATION) as image:
        assert min(image.size) > 200
    for name in ("one.svg", "two.svg"):
        assert call("ablation", sweep, "--picture", tmp_path / name) == 0
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    words = "".join(ElementTree.parse(tmp_path / "one.svg").getroot().itertext())
    assert "weak | pale" in words
    assert "17 of 40" in words


def test_bars_are_the_rates_with_their_intervals(sweep: Path) -> None:
    section = ablation(table(), facts(table()))
    assert section is not None
    (axes,) = draw_ablation(section).axes
    assert [bar.get_width() for bar in axes.patches] == [31 / 40, 17 / 40, 31 / 40]
    ends = [tuple(line.get_xdata()) for line in axes.get_lines()][:3]
    assert ends == [tuple(one["recovered"]["interval"]) for one in section["designs"]]


def test_report_and_summary_hold_the_ablation(sweep: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_report(sweep, sweep / REPORT, failures=0)
    page = (sweep / REPORT).read_text(encoding="utf-8")
    assert "What each part is worth" in page
    cells = re.sub(r"<td[^>]*>", "<td>", page)
    shown = ("weak | pale", "17 of 40", "42 % [29, 58]", "−35", "15 lost, 1 gained", "&lt; 0.001", "5 of 10")
    assert "".join(f"<td>{cell}</td>" for cell in shown) in cells
    print_sections(sections(summarise(frame(table()), facts(table()))))
    assert "15 lost, 1 gained" in capsys.readouterr().out


def test_one_command_runs_it_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    suite = tmp_path / "mine.toml"
    small = VARIANTS.replace("direction = [0, 90]", "direction = [0]").replace("replicas = 2", "replicas = 1")
    suite.write_text(small)
    for _ in range(2):
        assert call("ablation", "--suite", suite, "--out", tmp_path / "out", "--workers", "1") == 0
        assert "| full | " in capsys.readouterr().out
    rows = read_results(tmp_path / "out").to_pylist()
    assert len(rows) == 6
    assert (tmp_path / "out" / ABLATION).is_file()
    assert "recovered" in {row["outcome"] for row in rows}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--suite", "smoke"], "smoke.toml: variants: is missing; an ablation compares them"),
        (["DIR", "--suite", "ablation"], "--suite: nothing is run for a folder that is given"),
        (["DIR", "--out", "x"], "--out: nothing is run for a folder that is given"),
        (["--picture", "x.pdf"], "--picture: 'x.pdf' must end in .png or .svg"),
        (["gone"], "'gone' is not the folder of a sweep"),
    ],
)
def test_what_cannot_be_compared_is_refused(more: list[str], words: str, sweep: Path) -> None:
    with pytest.raises(InputError) as caught:
        call("ablation", *(str(sweep) if part == "DIR" else part for part in more))
    assert words in str(caught.value)


def test_folder_without_variants_is_refused(tmp_path: Path) -> None:
    rows = [one | {"variant": None} for one in table() if one["variant"] == "full"]
    with pytest.raises(InputError, match="'made_up', which has no variants to compare"):
        call("ablation", folder_of(tmp_path / "sweep", rows))
