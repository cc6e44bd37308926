"""Whatever kills a sweep, what was finished is kept, named when damaged, and run only once."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from models.errors import InputError
from sim.results import table as results
from sim.results.table import read_results, row_files
from sim.sweep import store as sweep_store
from sim.sweep.executors import Workers, local
from sim.sweep.runner import Runner
from sim.sweep.sweep import run_sweep
from tests.sim.sweep.sweep_suites import HERE, PENDULUM, Counting, die, die_once, fail, jobs, lasting, suite

HOUSE = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pa.Table:
    """The suite run in this process, without any interruption."""
    folder = tmp_path_factory.mktemp("whole")
    run_sweep(suite(folder), folder / "out", HERE)
    return read_results(folder / "out")


def started(folder: Path, out: Path) -> subprocess.Popen[bytes]:
    path = str(suite(folder).path)
    # Whoever runs the tests in the background of a shell ignores Ctrl-C, and would hand that down.
    sweep = [sys.executable, "-m", "sim", "sweep", path, "--out", out, "--workers", "2"]
    command = ["env", "--default-signal=INT", *sweep]
    environment = os.environ | {"PYTHONPATH": str(HOUSE)}
    return subprocess.Popen(command, cwd=HOUSE, env=environment, stderr=subprocess.PIPE, start_new_session=True)


def members(session: int) -> list[int]:
    """Processes of a session that are not dead."""
    alive = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[3]) == session and words[0] != "Z":
            alive.append(int(entry.name))
    return alive


def test_kill_9_loses_only_what_is_in_flight(whole: pa.Table, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = started(tmp_path, out)
    deadline = time.monotonic() + 120
    while len(list((out / results.ROWS).glob("*.parquet"))) < 3:
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.005)
    process.kill()
    process.wait()
    # Its workers do not outlive it.
    while members(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert members(process.pid) == []

    kept = {path.name: path.read_bytes() for path in row_files(out)}
    assert 3 <= len(kept) < 16
    before = read_results(out)
    ran: list[str] = []
    run_sweep(suite(tmp_path), out, Workers(count=1, make=lambda: Counting(ran)))
    assert not set(ran) & set(before["episode"].to_pylist())
    assert len(ran) == 16 - before.num_rows
    assert lasting(read_results(out)).equals(lasting(whole))
    assert pq.read_table(out / results.RESULTS).num_rows == 16
    assert not list(out.rglob("*.part"))


def halved(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def bit_flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 5] ^= 1
    path.write_bytes(content)


def test_no_bit_of_a_file_can_change_unnoticed(whole: pa.Table, tmp_path: Path) -> None:
    path = tmp_path / "row.parquet"
    results.write_table(whole.slice(0, 1), path)
    sound = path.read_bytes()
    assert results.read_file(path).equals(whole.slice(0, 1))
    rng = np.random.default_rng(0)
    # What is not a page, at the end, is where most of a small file is; the checksum's own place is in there, too.
    places = [*rng.integers(len(sound), size=200).tolist(), *range(len(sound) - 400, len(sound), 3)]
    place = sound.index(b"okiagari-sha256:")
    for at in [*places, *range(place - 2, place + 82)]:
        flipped = bytearray(sound)
        flipped[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        with pytest.raises(InputError) as caught:
            results.read_file(path)
        assert str(caught.value).startswith(f"{path}: ")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("harm", [halved, bit_flipped])
def test_damaged_rows_are_named_and_the_rest_is_kept(
    harm: Callable[[Path], None], whole: pa.Table, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    (out / results.ROWS).mkdir(parents=True)
    for i in range(16):
        row = whole.slice(i, 1)
        results.write_table(row, out / results.ROWS / f"{row['episode'][0]}.parquet")
    victim = out / results.ROWS / f"{whole['episode'][3]}.parquet"
    harm(victim)
    for attempt in (lambda: run_sweep(suite(tmp_path), out, HERE), lambda: read_results(out)):
        with pytest.raises(InputError) as caught:
            attempt()
        assert str(caught.value).startswith(f"{victim}: damaged: ")
        assert "delete it and repeat the sweep, which runs its episodes anew" in str(caught.value)
        assert "\n" not in str(caught.value)
    victim.unlink()
    run_sweep(suite(tmp_path), out, HERE)
    assert lasting(read_results(out)).equals(lasting(whole))


def test_damaged_results_are_made_anew_from_the_rows(whole: pa.Table, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_sweep(suite(tmp_path), out, HERE)
    halved(out / results.RESULTS)
    with pytest.raises(InputError, match=r"results\.parquet: damaged: .* makes it anew from rows"):
        run_sweep(suite(tmp_path), out, HERE)
    (out / results.RESULTS).unlink()
    run_sweep(suite(tmp_path), out, HERE)
    assert lasting(read_results(out)).equals(lasting(whole))


def test_folder_of_another_suite_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    one = suite(tmp_path, PENDULUM.replace("replicas = 2", "replicas = 1"))
    run_sweep(one, out, HERE)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="holds results of the suite 'short' as it was then"):
        run_sweep(suite(tmp_path), out, HERE)
    (out / results.SWEEP).write_text("{")
    with pytest.raises(InputError, match=r"sweep\.json: damaged; delete it"):
        run_sweep(one, out, HERE)
    (out / results.SWEEP).unlink()
    with pytest.raises(InputError, match="episodes that are none of 'short'"):
        run_sweep(suite(tmp_path, PENDULUM.replace("seed = 7", "seed = 8")), out, HERE)
    assert all(path.read_bytes() == content for path, content in before.items() if path.suffix == ".parquet")


def test_foreign_folder_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").touch()
    with pytest.raises(InputError, match=r"holds 'thesis\.tex', which no sweep writes"):
        run_sweep(suite(tmp_path), tmp_path / "out", HERE)


def test_two_sweeps_do_not_write_one_folder(tmp_path: Path) -> None:
    with sweep_store.owned(tmp_path / "out"), pytest.raises(InputError, match="is being written by another sweep"):
        run_sweep(suite(tmp_path), tmp_path / "out", HERE)


def test_full_disk_is_said_and_the_same_sweep_goes_on(
    whole: pa.Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, real, calls = tmp_path / "out", os.fsync, []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) > 7:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(descriptor)

    with monkeypatch.context() as disk:
        disk.setattr("os.fsync", full)
        with pytest.raises(InputError) as caught:
            run_sweep(suite(tmp_path), out, HERE)
    assert "cannot be written: the disk is full; the rows before it are safe" in str(caught.value)
    assert read_results(out).num_rows == 5  # the suite and sweep.json were written before
    assert not list(out.rglob("*.part"))
    run_sweep(suite(tmp_path), out, HERE)
    assert lasting(read_results(out)).equals(lasting(whole))


def test_limit_of_the_system_on_files_is_one_line(tmp_path: Path) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    code = (
        "import sys\nfrom models.errors import InputError\nfrom tests.sim.sweep.test_failures import *\n"
        "try: run_sweep(suite(Path(sys.argv[1])), Path(sys.argv[2]), HERE)\n"
        "except InputError as error: print(error)"
    )
    command = [sys.executable, "-B", "-c", code, str(tmp_path), str(tmp_path / "out")]
    done = subprocess.run(
        command,
        cwd=HOUSE,
        env=os.environ | {"PYTHONPATH": str(HOUSE)},
        preexec_fn=limit,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") == 1
    assert "cannot be written: File too large" in done.stdout


def test_dead_worker_is_replaced_and_its_episode_tried_again(
    whole: pa.Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = jobs(suite(tmp_path))[:6]
    monkeypatch.setenv("VICTIM", work[2].episode.name)
    monkeypatch.setenv("MARK", str(tmp_path / "mark"))
    rows: dict[str, dict[str, object]] = {}
    waiting = iter(work)
    with local(2) as workers:
        Runner(workers, lambda job, row: rows.update({job.episode.name: row}), die_once).work(lambda: waiting)
    assert (tmp_path / "mark").exists()
    expected = {row["episode"]: row["trace_hash"] for row in whole.to_pylist()}
    assert {name: row["trace_hash"] for name, row in rows.items()} == {
        job.episode.name: expected[job.episode.name] for job in work
    }


def test_episode_that_kills_its_worker_is_written_down_as_crashed_and_no_other(
    whole: pa.Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = jobs(suite(tmp_path))[:6]
    victim = work[2].episode
    monkeypatch.setenv("VICTIM", victim.name)
    rows: dict[str, dict[str, object]] = {}
    waiting = iter(work)
    with local(2) as workers:
        Runner(workers, lambda job, row: rows.update({job.episode.name: row}), die).work(lambda: waiting)
    assert len(rows) == 6
    row = rows.pop(victim.name)
    assert row["outcome"] == "crashed"
    assert "BrokenProcessPool" in str(row["traceback"])
    assert row["delta_v"] == victim.parameters["delta_v"]
    assert results.as_table([row]).num_rows == 1
    assert "crashed" not in {other["outcome"] for other in rows.values()}


def test_error_is_tried_twice_and_kept_with_its_traceback(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MARK", str(tmp_path / "mark"))
    (first, *_) = jobs(suite(tmp_path))
    rows = []
    waiting = iter([first])
    Runner(HERE, lambda job, row: rows.append(row), fail).work(lambda: waiting)
    (row,) = rows
    assert (row["outcome"], row["reason"]) == ("crashed", "ZeroDivisionError: on purpose")
    assert row["traceback"].startswith("Traceback")
    assert (tmp_path / "mark").read_text().split() == [first.episode.name] * 2


def test_workers_end_when_interrupted(tmp_path: Path) -> None:
    process = started(tmp_path, tmp_path / "out")
    deadline = time.monotonic() + 120
    while not list((tmp_path / "out" / results.ROWS).glob("*.parquet")):
        assert time.monotonic() < deadline
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C does: to all of them
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert told.decode().splitlines()[-1] == "okiagari: stopped; the same command goes on where it was"
    while members(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert members(process.pid) == []
    assert read_results(tmp_path / "out").num_rows >= 1
