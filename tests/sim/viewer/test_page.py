"""The page of a run: one file that needs nothing else, and shows robot and marks in a real browser."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import sim.viewer.server as server
from models.errors import InputError
from sim.cli.app import main
from sim.episode import run_folder
from sim.record.trace import Trace
from sim.viewer.page import replay_page
from tests.sim.chromium import needs_chromium
from tests.sim.still_traces import during, scenario, still_trace
from tests.sim.viewer.browser import browser, coloured, needs_viser

FORWARD = {"start": 0.0, "duration": 0.9, "direction": 0.0, "impulse": 9.0}


def pushed(world: str = "humanoid", description: str = "stands & <b>is pushed</b>") -> Trace:
    run = scenario(duration=1.0, world=world, pushes=[FORWARD], description=description)
    return still_trace(run, push_fx=during(run, 0.0, 0.9, 10.0), push_z=0.35)


@needs_viser
def test_needs_nothing_but_itself() -> None:
    page = replay_page(pushed())
    assert set(re.findall(r"https?://[\w./-]+", page)) == {"http://www.w3.org/2000/svg"}
    assert "<title>utmu2, humanoid, supervisor: stands &amp; &lt;b&gt;is pushed" in page
    assert "<b>is pushed" not in page


@needs_viser
def test_legend_names_what_the_controllers_see_if_it_is_not_the_truth() -> None:
    run = scenario(duration=0.1)
    assert "COG as seen" in replay_page(still_trace(run, dcm_error_x=0.01))
    assert "COG as seen" not in replay_page(still_trace(run))


@needs_viser
@needs_chromium
@pytest.mark.parametrize("world", ["humanoid", "pendulum"])
def test_browser_shows_robot_and_marks(world: str, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(replay_page(pushed(world)), encoding="utf-8")
    with browser(path.as_uri(), tmp_path / "profile") as page:
        page.wait("!!document.querySelector('canvas')")
        page.wait_for_picture(lambda picture: coloured(picture, "push") > 300)
        picture = page.picture()
        assert "ZMP command" in page.text()
        requests, complaints = page.requests, page.complaints
    assert coloured(picture, "support") > 100
    assert coloured(picture, "cog") > 50
    legs = coloured(picture, "left leg"), coloured(picture, "right leg")
    assert (min(legs) > 3000) == (world == "humanoid"), legs
    assert complaints == []
    assert all(address.split(":")[0] in ("file", "data", "blob") for address in requests)


@needs_viser
def test_command_writes_it_and_refuses_what_it_must(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run = tmp_path / "run"
    run.mkdir()
    pushed("pendulum").save(run / run_folder.TRACE)
    assert main(["replay", "run", "--html"]) == 0
    assert capsys.readouterr().out == "run/replay.html\n"
    first = (run / run_folder.PAGE).read_bytes()
    (run / run_folder.PAGE).write_text("mine")
    for arguments, words in (
        (["replay", "run", "--html"], "'run/replay.html' is there already; choose another file or pass --overwrite"),
        (["replay", "run"], "EPISODE: give the name of a sweep's episode"),
        (["replay", "run", "--html", "--video"], "EPISODE: give the name of a sweep's episode"),
        (["replay", ".", "--html"], "'.' is not the folder of a run"),
        (["replay", "run", "--html", "--out", "run"], "--out: 'run' is a folder; it must be a file"),
    ):
        assert main(arguments) == 2
        assert words in capsys.readouterr().err
    assert (run / run_folder.PAGE).read_text() == "mine"
    assert main(["replay", "run", "--html", "--overwrite"]) == 0
    assert abs(len((run / run_folder.PAGE).read_bytes()) - len(first)) < 0.01 * len(first)
    assert sorted(path.name for path in run.iterdir()) == [run_folder.PAGE, run_folder.TRACE]


def test_without_viser_one_line_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs viser.*okiagari\[view\]"):
        replay_page(pushed())


def test_colours_can_be_told() -> None:
    picture = np.zeros((2, 2, 3), dtype=np.uint8)
    picture[0] = 222, 225, 229
    assert {coloured(picture, name) for name in ("push", "support", "cog", "left leg", "right leg")} == {0}
