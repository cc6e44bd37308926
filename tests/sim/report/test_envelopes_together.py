"""Several sweeps of one suite, laid over each other in one picture and in one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

from models.errors import InputError
from sim.report.envelopes_together import check_alike, draw_together, read_named
from sim.results.table import SUITE
from tests.sim.analysis.sweep_tables import CONTROLLERS, OMEGA, adaptive, edge, folder_of
from tests.sim.program import call

LIMITS = {"supervisor": 2.5, "regulator": 0.8, "statue": 0.9}


def swept(path: Path, share: float, **parameters: Any) -> Path:
    """A sweep whose controllers recover from a share of their limits."""

    def law(asked: Mapping[str, Any]) -> bool:
        return bool(asked["delta_v"] <= share * LIMITS[asked["controller"]] * OMEGA * edge(asked["direction_deg"]))

    return folder_of(path, adaptive(law, **parameters))


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("exact") / "sweep", 1.0)


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swept(tmp_path_factory.mktemp("late") / "sweep", 0.6, controllers=["supervisor"])


def test_who_is_in_all_sweeps_is_drawn_and_told(
    exact: Path, late: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "both.png"
    assert call("envelope", exact, late, "--label", "exact", "--label", "late", "--out", path) == 0
    told = capsys.readouterr()
    lines = [line for line in told.out.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert [line[0] for line in cells[2:]] == ["supervisor, exact", "supervisor, late"]
    mean = cells[0].index("mean")
    assert float(cells[2][mean].strip("*")) > 1.5 * float(cells[3][mean].strip("*"))
    assert "left out, for not all of the sweeps have them: regulator, statue" in told.err
    with Image.open(path) as image:
        assert min(image.size) > 600


def test_sweeps_differ_by_line_and_a_single_controller_by_colour_too(exact: Path, late: Path) -> None:
    sweeps = [read_named("exact", exact), read_named("late", late)]
    figure = draw_together(sweeps)
    (axes,) = figure.axes
    curves = [line for line in axes.get_lines() if len(line.get_xdata()) == 9 and line.get_linestyle() != "None"]
    assert [line.get_linestyle() for line in curves] == ["-", "--"]
    for line, one in zip(curves, sweeps, strict=True):
        own = [each["over_omega_d"] for each in one.summary["robust"] if each["controller"] == "supervisor"]
        np.testing.assert_array_equal(np.asarray(line.get_ydata())[:-1], own)
    assert to_hex(curves[0].get_color()) == CONTROLLERS["supervisor"]["colour"] != to_hex(curves[1].get_color())
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["no step", "supervisor, exact", "supervisor, late"]
    twice = draw_together([sweeps[0], replace(sweeps[0], name="again")])
    colours = {line.get_color() for line in twice.axes[0].get_lines() if line.get_linestyle() == "--"}
    assert colours >= {look["colour"] for look in CONTROLLERS.values()}


def test_a_long_name_has_a_line_of_the_legend_to_itself(exact: Path, late: Path) -> None:
    figure = draw_together([read_named("exact", exact), read_named("typical, 4 ms late, body errors", late)])
    figure.canvas.draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert box.x0 >= 0.0
    assert box.x1 <= figure.bbox.width


def test_many_directions_have_no_column_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ways = [float(way) for way in range(0, 360, 15)]
    folders = [
        swept(tmp_path / name, share, controllers=["supervisor"], directions=ways, replicas=1)
        for name, share in (("a", 1.0), ("b", 0.7))
    ]
    assert call("envelope", *folders) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert lines[0] == "| Δv/(ωd) | directions | mean | worst | worst at | holes |"
    assert [line.split("|")[1].strip() for line in lines[2:]] == ["supervisor, a", "supervisor, b"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--label", "one"], "--label: 1 for 2 sweeps"),
        (["--label", "one", "--label", "one"], "must differ"),
        (["--case", "x"], "--case: does nothing with several sweeps"),
    ],
)
def test_sweeps_that_cannot_be_told_apart_are_refused(exact: Path, arguments: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        call("envelope", exact, exact, *arguments)


def test_sweeps_whose_thresholds_mean_different_things_are_refused(exact: Path, tmp_path: Path) -> None:
    one = read_named("a", exact)
    for key, value, words in (
        ("suite", "other", "b: its suite is 'other', that of a is 'made_up'"),
        ("robots", ["hand"], r"b: its robot is \['hand'\]"),
        ("worlds", ["pendulum"], r"b: its world is \['pendulum'\]"),
    ):
        with pytest.raises(InputError, match=words):
            check_alike([one, replace(one, name="b", summary=one.summary | {key: value})])
    only = {"regulator": swept(tmp_path / "r", 1.0, controllers=["regulator"])}
    only["statue"] = swept(tmp_path / "s", 1.0, controllers=["statue"])
    with pytest.raises(InputError, match="no controller is in all of regulator, statue"):
        check_alike([read_named(name, folder) for name, folder in only.items()])


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ("replicas = 9\n", "its replicas is not that of a"),
        ("[axes]\ndelta_v = [0.1, 0.2]\n", "its axis delta_v is not that of a"),
        ("[axes]\ncontroller = ['supervisor']\n", None),
        ("no TOML", "suite.toml: cannot be read"),
    ],
)
def test_one_suite_of_two_contents_is_refused(exact: Path, tmp_path: Path, changed: str, words: str | None) -> None:
    other = swept(tmp_path / "sweep", 1.0, controllers=["supervisor"])
    (other / SUITE).write_text(changed, encoding="utf-8")
    if words is None:
        check_alike([read_named("a", exact), read_named("b", other)])
        return
    with pytest.raises(InputError, match=words):
        check_alike([read_named("a", exact), read_named("b", other)])
