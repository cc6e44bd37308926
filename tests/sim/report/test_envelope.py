"""The envelope as a picture and as a table for a document."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from models.errors import InputError
from sim.analysis.summary import summarise, write_summary
from sim.report.envelope import ENVELOPE, draw_envelope, envelopes, write_envelope
from tests.sim.analysis.sweep_tables import (
    CONTROLLERS,
    OMEGA,
    adaptive,
    edge,
    folder_of,
    frame,
    sweep_facts,
)
from tests.sim.program import call

LIMITS = {"supervisor": 2.5, "regulator": 0.8, "statue": 0.9}


def law(asked: Mapping[str, Any]) -> bool:
    return bool(asked["delta_v"] <= LIMITS[asked["controller"]] * OMEGA * edge(asked["direction_deg"]))


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folder_of(tmp_path_factory.mktemp("envelope") / "sweep", adaptive(law))


def test_table_holds_the_thresholds_of_the_summary(sweep: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("envelope", sweep) == 0
    lines = capsys.readouterr().out.splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    assert {len(line) for line in cells} == {13}
    assert cells[0] == ["Δv/(ωd)", *(f"{way}°" for way in range(0, 360, 45)), "mean", "worst", "mean Δv/√(gh)", "holes"]
    assert [line[0] for line in cells[2:]] == ["supervisor", "regulator (never steps)", "statue (holds still)"]
    rows = adaptive(law)
    summary = summarise(frame(rows), sweep_facts(rows))
    own = {one["direction_deg"]: one["over_omega_d"] for one in summary["robust"] if one["controller"] == "supervisor"}
    assert cells[2][1:9] == [f"{own[way]:.2f}" for way in range(0, 360, 45)]
    assert cells[2][9] == f"**{summary['robust_mean_over_omega_d']['supervisor']:.2f}**"
    assert cells[2][10] == f"{summary['robust_worst_over_omega_d']['supervisor']:.2f}"
    assert cells[2][11] == f"{summary['robust_mean_over_sqrt_gh']['supervisor']:.3f}"
    assert cells[2][12] == "0"
    assert (sweep / ENVELOPE).is_file()


def test_picture_is_drawn_and_comes_out_alike(sweep: Path, tmp_path: Path) -> None:
    summary = write_summary(sweep)
    for name in ("a/one.png", "a/two.png", "a/one.svg", "a/two.svg"):
        write_envelope(summary, {}, tmp_path / name)
    for kind in ("png", "svg"):
        assert (tmp_path / f"a/one.{kind}").read_bytes() == (tmp_path / f"a/two.{kind}").read_bytes()
    with Image.open(tmp_path / "a/one.png") as image:
        assert min(image.size) > 600
        assert len(image.convert("RGB").getcolors(1 << 24)) > 100
    assert "supervisor" in "".join(ElementTree.parse(tmp_path / "a/one.svg").getroot().itertext())


def test_limit_without_a_step_is_the_circle_at_one(sweep: Path) -> None:
    summary = write_summary(sweep)
    (axes,) = draw_envelope(summary, {}, normalised=True, koolen=False).axes
    lines = {line.get_label(): line for line in axes.get_lines()}
    circle = np.asarray(lines["no step"].get_ydata(), dtype=float)
    np.testing.assert_array_equal(circle, 1.0)
    assert not any("Koolen" in str(label) for label in lines)
    drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()]
    best = np.array([one["over_omega_d"] for one in summary["robust"] if one["controller"] == "supervisor"])
    assert any(len(values) == 9 and np.array_equal(values[:8], best) for values in drawn)


def test_one_of_several_cases_is_chosen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weak = {"supervisor": 1.0, "regulator": 0.5, "statue": 0.5}

    def weaker(asked: Mapping[str, Any]) -> bool:
        return bool(asked["delta_v"] <= weak[asked["controller"]] * OMEGA * edge(asked["direction_deg"]))

    rows = adaptive(law) + adaptive(weaker, world="pendulum")
    folder = folder_of(tmp_path / "sweep", rows)
    assert call("envelope", folder) == 0
    table = capsys.readouterr().out
    assert "| world humanoid | supervisor | 2.50 |" in table
    assert "| world pendulum | supervisor | 1.00 |" in table
    with pytest.raises(InputError, match="choose one of 'world humanoid', 'world pendulum'"):
        call("envelope", folder, "--out", tmp_path / "one.png")
    assert call("envelope", folder, "--case", "world pendulum") == 0
    assert "| supervisor | 1.00 |" in capsys.readouterr().out


def test_what_the_suite_cut_short_is_a_bound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(tmp_path / "sweep", adaptive(law, levels=12, directions=[0.0, 90.0]))
    assert call("envelope", folder) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("| supervisor"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    # 0.6 m/s is 1.5 and 1.875 omega d, and the largest of the suite.
    assert cells[1:-1] == ["≥ 1.50", "≥ 1.88", "**≥ 1.69**", "≥ 1.50", "≥ 0.245"]


def test_thresholds_above_a_hole_are_marked() -> None:
    def holed(asked: Mapping[str, Any]) -> bool:
        return law(asked) and (asked["delta_v"], asked["replica"]) != (0.1, 2)

    for recovers, marks in ((law, 0), (holed, 8)):
        rows = adaptive(recovers, controllers=["supervisor"])
        summary = summarise(frame(rows), sweep_facts(rows))
        figure = draw_envelope(summary, {}, normalised=True)
        assert len([text for text in figure.axes[0].texts if text.get_text() == "*"]) == marks
        assert ("above a hole" in {text.get_text() for text in figure.legends[0].get_texts()}) == bool(marks)
        assert all(("above a hole" in picture.caption) == bool(marks) for picture in envelopes(summary))


def test_names_that_our_font_lacks_are_drawn_without_warnings(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    rows = adaptive(law, controllers=["supervisor"])
    looks = {"supervisor": CONTROLLERS["supervisor"] | {"label": "起き上がり \u2312"}}
    summary = summarise(frame(rows), sweep_facts(rows) | {"controllers": looks})
    for kind in ("png", "svg"):
        write_envelope(summary, {}, tmp_path / f"one.{kind}")
    assert not [str(warning.message) for warning in recwarn.list if "Glyph" in str(warning.message)]
    # The browser that shows an SVG has fonts of its own.
    assert "起き上がり" in (tmp_path / "one.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("more", "words"),
    [(["--out", "x.pdf"], "must end in .png or .svg"), (["--case", "y"], "the suite has only one case")],
)
def test_what_cannot_be_drawn_is_refused(sweep: Path, more: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        call("envelope", sweep, *more)


def test_without_levels_there_is_no_envelope(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "sweep", adaptive(law, levels=1))
    with pytest.raises(InputError, match="no thresholds"):
        call("envelope", folder)


def test_of_many_directions_the_table_tells_the_least_and_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def weak_at_75(asked: Mapping[str, Any]) -> bool:
        limit = 1.2 if asked["direction_deg"] == 75.0 else 2.5
        return bool(asked["delta_v"] <= limit * OMEGA * edge(asked["direction_deg"]))

    ways = [float(way) for way in range(0, 360, 15)]
    folder = folder_of(tmp_path / "many", adaptive(weak_at_75, controllers=["supervisor"], directions=ways))
    assert call("envelope", folder) == 0
    head, _, row = (line for line in capsys.readouterr().out.splitlines() if line.startswith("|"))
    told = dict(zip(*([cell.strip() for cell in line.strip("|").split("|")] for line in (head, row)), strict=True))
    assert list(told) == ["Δv/(ωd)", "directions", "mean", "worst", "worst at", "mean Δv/√(gh)", "holes"]
    assert (told["directions"], told["worst at"]) == ("24", "75°")
    assert float(told["worst"]) < 1.2 < 2.0 < float(told["mean"].strip("*"))
    (axes,) = draw_envelope(write_summary(folder), {}, normalised=True, koolen=False).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == [
        *("forward", "45°", "left", "135°", "back", "225°", "right", "315°")
    ]
