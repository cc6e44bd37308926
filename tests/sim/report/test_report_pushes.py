"""Which push a report's film strips and sentences are about."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios.catalogue import load
from sim.report.failures import film_strip
from sim.report.report import REPORT, write_report
from sim.viz.film_strip import FRAMES
from tests.sim.analysis.sweep_tables import LIMITS, adaptive, folder_of, row, threshold_law
from tests.sim.program import call
from tests.sim.renderer import needs_renderer


@needs_renderer
def test_failure_is_run_again_and_filmed() -> None:
    pushes = [{"start": 0.2, "duration": 0.1, "direction": 0.0, "delta_v": 2.0}]
    scenario = load("push_left", {"world": "pendulum", "controller": "regulator", "duration": 3.0, "pushes": pushes})
    one = row(lambda _: False, world="pendulum") | {"scenario": json.dumps(scenario.as_dict())}
    strip = film_strip(one)
    assert strip.note is None
    assert len(strip.frames) == FRAMES
    moments = [moment for moment, _ in strip.frames]
    # From a tenth before the push, and ticks are whole.
    assert moments[0] == pytest.approx(-0.1, abs=0.002)
    assert moments == sorted(moments)
    assert len({uri for _, uri in strip.frames}) == FRAMES
    other = film_strip(one | {"outcome": "not_settled"})
    assert "ended otherwise" in (other.note or "")


@pytest.mark.parametrize(("train", "first_moment"), [(2, -0.1), (None, -0.1 - 1.0)])
@needs_renderer
def test_strip_begins_at_the_pushes_that_the_row_is_about(train: int | None, first_moment: float) -> None:
    pushes = [
        {"start": 0.2, "duration": 0.1, "direction": 0.0, "delta_v": 0.05},
        {"start": 1.2, "duration": 0.1, "direction": 0.0, "delta_v": 2.0},
    ]
    scenario = load("push_left", {"world": "pendulum", "controller": "regulator", "duration": 4.0, "pushes": pushes})
    one = row(lambda _: False, world="pendulum") | {"scenario": json.dumps(scenario.as_dict())}
    strip = film_strip(one | {"train": train, "push_start": 1.2})
    # Moments are told from the start of the push that felled; of a train the push before it is not shown.
    assert strip.frames[0][0] == pytest.approx(first_moment, abs=0.002)


def test_first_push_and_what_was_held_out_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = adaptive(threshold_law(LIMITS), directions=[0.0, 90.0])
    for one in rows:
        one |= {"first_direction_deg": 37.0 * one["replica"], "first_delta_v": 0.4, "mid_step": one["replica"] < 4}
    first = {"size": 1.2, "gap": 0.25, "duration": 0.1, "direction": [0.0, 360.0]}
    folder = folder_of(tmp_path / "sweep", rows, first=first, tuned_on="seeds of their own")
    write_report(folder, folder / REPORT, failures=0)
    text = (folder / REPORT).read_text(encoding="utf-8")
    for words in (
        "The controllers were tuned on seeds of their own.",
        "A first push precedes",
        "0.25 s after a first one, of 1.2 ωd of its own direction and 0.1 s long",
        "to 0°, 37°, 74°, 111°, 148° (one a replica)",
        "How hard it can be pushed a second time",
    ):
        assert words in text
    own = [one for one in rows if one["controller"] == "supervisor"]
    counted = f"{sum(one['mid_step'] for one in own)} of {len(own)} (supervisor)"
    assert counted in text
    assert call("envelope", folder) == 0
    assert "after a first one, of 1.2 ωd" in capsys.readouterr().out


def test_crashed_episode_has_no_strip() -> None:
    strip = film_strip(row(lambda _: False) | {"outcome": "crashed"})
    assert strip.frames == ()
    assert strip.note
