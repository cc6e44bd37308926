"""The hardest robust push of each direction is found, run again, and filmed once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from models.errors import InputError
from sim.analysis.thresholds import thresholds
from sim.record.trace import Trace
from sim.report import hardest
from sim.report.hardest import INDEX, Hardest, answered
from sim.results.table import read_results
from sim.sweep.sweep import run_sweep
from sim.viz.film_strip import FRAMES
from tests.sim.analysis.sweep_tables import STEP, adaptive, frame, row, sweep_facts, threshold_law
from tests.sim.program import call
from tests.sim.renderer import needs_renderer
from tests.sim.sweep.sweep_suites import HERE, suite

LIMITS = {"supervisor": 2.5, "regulator": 0.8, "statue": 0.5}
SMALL = """
description = "short pushes on the pendulum"
replicas = 2

[axes]
world = ["pendulum"]
controller = ["regulator"]
direction = [0]
delta_v = [0.1, 0.15, 3.0]
start = [0.6]

# Coarse, for the tests' time.
[scenario.timing]
physics = 0.005
control = 0.01
"""


def hardest_pushes(rows: list[dict[str, Any]], controller: str | None = None) -> list[Hardest]:
    return hardest.hardest_pushes(frame(rows), sweep_facts(rows), controller)


def test_the_first_replica_recovered_at_the_threshold_is_taken() -> None:
    law = threshold_law(LIMITS)
    rows = adaptive(lambda asked: law(asked) and (asked["replica"], asked["direction_deg"]) != (0, 90.0))
    found = hardest_pushes(rows)
    robust = {one.direction_deg: one for one in thresholds(frame(rows)) if one.controller == "supervisor"}
    assert [push.name for push in found] == [f"hardest_{way:03d}" for way in range(0, 360, 45)]
    for push in found:
        way = push.row["direction_deg"]
        assert push.row["delta_v"] == pytest.approx(robust[way].delta_v)
        assert push.row["outcome"] == "recovered"
        assert push.row["replica"] == (1 if way == 90.0 else 0)
    assert {push.row["controller"] for push in hardest_pushes(rows, "statue")} == {"statue"}


def test_direction_without_a_robust_push_has_none() -> None:
    rows = adaptive(
        lambda asked: bool(asked["direction_deg"] == 22.5 and asked["delta_v"] < 3.5 * STEP), directions=[0, 22.5]
    )
    (push,) = hardest_pushes(rows)
    assert push.name == "hardest_022.5"
    assert push.row["delta_v"] == pytest.approx(3 * STEP)


def test_a_threshold_above_a_hole_says_so() -> None:
    law = threshold_law(LIMITS)
    rows = adaptive(lambda asked: law(asked) and (asked["delta_v"], asked["replica"]) != (0.1, 2), directions=[0.0])
    for tried, said in ((adaptive(law, directions=[0.0]), False), (rows, True)):
        assert [one.words.endswith(", above a hole") for one in hardest_pushes(tried)] == [said]


def test_unknown_controllers_and_tables_without_thresholds_are_refused() -> None:
    rows = adaptive(threshold_law(LIMITS), directions=[0.0])
    with pytest.raises(InputError, match="--controller: 'x' is none of the sweep's; choose one of supervisor"):
        hardest_pushes(rows, "x")
    with pytest.raises(InputError, match="no thresholds"):
        hardest_pushes([row(lambda _: True)])


def test_steps_that_restore_the_stance_are_no_answer() -> None:
    time = np.arange(0.0, 4.0, 0.01)
    who = np.select([(time > 1.0) & (time < 1.4), (time > 1.45) & (time < 1.6), (time > 2.5) & (time < 2.8)], [1.0] * 3)
    trace = Trace(values=np.column_stack([time, who]), units={"time": "s", "phase": "1"}, metadata={})
    # To a tick: of the steps between 1 s and 1.6 s the last, though one pauses for a moment; of 2.5 s when alone.
    assert answered(trace, 0.9) == pytest.approx(1.59)
    assert answered(trace, 2.0) == pytest.approx(2.79)
    assert answered(trace, 3.0) == 3.0


@needs_renderer
def test_films_are_made_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_sweep(suite(tmp_path, SMALL), tmp_path / "out", HERE)
    target = tmp_path / "films"
    call("hardest", tmp_path / "out", "--out", target)
    said = capsys.readouterr().out
    assert said.startswith(f"{target / 'hardest_000'}.mp4  0°: 0.15 m/s")
    assert "bit-identical: recovered" in said
    assert {path.name for path in target.iterdir()} == {"hardest_000.mp4", "hardest_000.png", INDEX}
    with Image.open(target / "hardest_000.png") as strip:
        assert strip.size == (FRAMES * 320, 240)
    film = imageio_ffmpeg.read_frames(str(target / "hardest_000.mp4"))
    seconds = next(film)["duration"]
    film.close()
    (one,) = [r for r in read_results(tmp_path / "out").to_pylist() if r["delta_v"] == 0.15 and r["replica"] == 0]
    # Half a second before the push to a second after rest, where the trace ends, to a frame or two.
    assert seconds == pytest.approx(0.5 + one["duration"] + one["settle_time"] + 1.0, abs=0.1)

    before = {path.name: path.stat().st_mtime_ns for path in target.iterdir()}
    call("hardest", tmp_path / "out", "--out", target)
    assert "is filmed already; bit-identical" in capsys.readouterr().out
    assert {path.name: path.stat().st_mtime_ns for path in target.iterdir()} == before
    (target / "hardest_000.png").unlink()
    call("hardest", tmp_path / "out", "--out", target)
    assert "bit-identical" in capsys.readouterr().out
    assert (target / "hardest_000.png").exists()
