"""The live view in a real browser: pushes by hand are seen, land in the saved scenario, and come back bit by bit."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from controllers.compiled import COMPILING
from models.errors import InputError
from scenarios.catalogue import load
from sim.cli.app import main
from sim.episode import run_folder
from sim.record.trace import load_trace
from sim.viewer.live import Watched
from sim.viewer.pace import Pace
from sim.viewer.server import check_free
from tests.sim.chromium import needs_chromium
from tests.sim.program import call
from tests.sim.still_traces import scenario, still_trace
from tests.sim.viewer.browser import Page, browser, coloured, needs_viser

HOUSE = Path(__file__).resolve().parents[3]


PUSHES = r"document.body.innerText.match(/pushes\s+(\d+)/)[1]"


def pushed_and_paused(page: Page) -> np.ndarray | None:
    """A picture of a push that has only just begun; None if a slow machine had the time stand still too late."""
    page.run(
        "void setTimeout(() => [...document.querySelectorAll('button')].find(b => b.innerText == 'Pause').click(), 80)"
    )
    page.press("Push now")
    page.wait("document.body.innerText.includes('Resume')")
    until = time.monotonic() + 5.0
    while time.monotonic() < until:
        # The panel is on the right.
        picture = page.picture()
        if coloured(picture[:, :860], "push") > 300:
            return picture
    page.press("Resume")
    page.wait("!document.body.innerText.includes('Resume')")
    time.sleep(3.0)
    return None


@contextmanager
def program(*arguments: object) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The program while it shows an episode, and the address it tells."""
    with socket.socket() as trial:
        trial.bind(("127.0.0.1", 0))
        port = trial.getsockname()[1]
    command = [sys.executable, "-m", "sim", "run", *map(str, arguments), "--view", "--no-video", "--port", str(port)]
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True
    )
    try:
        assert process.stderr is not None
        told = re.search(r"http://127\.0\.0\.1:\d+", process.stderr.readline())
        assert told is not None, process.stderr.read()
        yield process, told[0]
    finally:
        process.kill()
        process.communicate()


@needs_viser
@needs_chromium
def test_push_by_hand_is_seen_saved_and_replayed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with (
        program("quiet", "--set", "duration=300", "--out", "live") as (process, address),
        browser(address, tmp_path / "profile") as page,
    ):
        page.wait("!!document.body?.innerText.includes('Push now')")
        page.wait("/time\\s+[1-9]/.test(document.body.innerText)")
        tries = (pushed_and_paused(page) for _ in range(8))
        picture = next(picture for picture in tries if picture is not None)
        assert coloured(picture[:, :860], "left leg") > 3000
        assert coloured(picture[:, :860], "right leg") > 3000
        page.press("Resume")
        # the phase says "stepping" for 0.15 s, which a busy browser may not draw; what was decided last stays
        page.wait("/the (left|right) foot landed/.test(document.body.innerText)")
        pushes = int(page.run(PUSHES))
        page.press("Push now")
        page.wait(f"{PUSHES} == {pushes + 1}")
        page.press("Finish")
        assert process.wait(timeout=120) == 0, process.stderr.read()
        told = process.stderr.read().removeprefix(f"{COMPILING}\n")  # where nothing has been compiled yet
        assert told == "", "what was written is what was seen"
        assert page.complaints == []
    saved = load(tmp_path / "live" / run_folder.SCENARIO)
    assert len(saved.pushes) == pushes + 1
    assert saved.pushes[-1].end < saved.duration < 300
    assert call("run", "live/scenario.toml", "--no-video", "--out", "again") == 0
    one, other = (load_trace(tmp_path / folder / run_folder.TRACE) for folder in ("live", "again"))
    assert one.channels == other.channels
    assert one.values.tobytes() == other.values.tobytes()
    assert one["push_fx"].any()
    told = json.loads((tmp_path / "live" / run_folder.OUTCOME).read_text())
    assert [push["start"] for push in told["pushes"]] == [push.start for push in saved.pushes]


@needs_viser
@needs_chromium
def test_interrupt_writes_what_was_run_and_restart_forgets_pushes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with (
        program("quiet", "--world", "pendulum", "--set", "duration=300", "--out", "live") as (process, address),
        browser(address, tmp_path / "profile") as page,
    ):
        page.wait("!!document.body?.innerText.includes('Push now')")
        page.press("Push now")
        page.wait("/pushes\\s+1;/.test(document.body.innerText)")
        page.press("Restart")
        page.wait("/pushes\\s+0/.test(document.body.innerText)")
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=120) == 0, process.stderr.read()
    saved = load(tmp_path / "live" / run_folder.SCENARIO)
    trace = load_trace(tmp_path / "live" / run_folder.TRACE)
    assert saved.pushes == ()
    assert saved.duration < 300.0
    assert trace.time[-1] == pytest.approx(saved.duration - saved.timing.control)


@needs_viser
def test_interrupt_before_anything_is_seen_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with program("quiet", "--out", "live") as (process, _):
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 130
        assert "stopped; nothing was written" in process.stderr.read()
    assert list(tmp_path.iterdir()) == []


def test_what_differs_is_told() -> None:
    run = scenario(duration=0.1)
    seen = Watched(scenario=run, trace=still_trace(run, zmp_x=np.nan))
    assert seen.differs(still_trace(run, zmp_x=np.nan)) is None
    assert seen.differs(still_trace(run, zmp_x=np.nan, cog_x=np.arange(run.ticks) >= 20)) == pytest.approx(0.04)


def test_a_taken_port_is_refused() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"--port: {port} cannot be used: .*; choose another"):
            check_free(port)
    check_free(port)


@needs_viser
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--port", "8080"], "--port: 8080 is of no use without --view"),
        (["--view", "--port", "65536"], "--port: 65536 must be at most 65535"),
        (["--view", "--port", "0"], "--port"),
    ],
)
def test_port_is_checked(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "quiet", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_pace_holds_back_and_says_when_it_cannot_keep_up() -> None:
    pace, begin = Pace(), time.perf_counter()
    for tick in range(60):
        pace.wait(0.02 * tick)
    assert time.perf_counter() - begin > 1.1
    assert pace.factor == pytest.approx(1.0, abs=0.1)
    late = Pace()
    for tick in range(12):
        late.wait(0.02 * tick)
        time.sleep(0.1)
    assert late.factor < 0.5
    assert "too slow for real time" in late.words
    assert "too slow" not in Pace().words
