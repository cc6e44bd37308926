"""A real Dask scheduler with two workers on loopback gives the rows of one local process, bit for bit."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from models.errors import InputError
from sim.results.table import read_results
from sim.sweep.executors import cluster
from sim.sweep.sweep import run_sweep
from tests.sim.sweep.sweep_suites import HERE, HUMANOID, lasting, suite

pytest.importorskip("distributed", reason="needs the extra `cluster`: pip install 'okiagari[cluster]'")

HOUSE = Path(__file__).resolve().parents[3]


def started(folder: Path, name: str, *arguments: str) -> subprocess.Popen[bytes]:
    module = "scheduler" if name == "scheduler" else "worker"
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "DASK_DISTRIBUTED__WORKER__DAEMON": "False"}
    # Into a file: a pipe that nobody reads would stop them when it is full.
    with open(folder / f"{name}.log", "wb") as log:
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{module}", *arguments],
            cwd=folder,
            env=environment,
            stdout=log,
            stderr=log,
        )


def said(path: Path, pattern: str) -> str:
    deadline = time.monotonic() + 120
    while (match := re.search(pattern, path.read_text())) is None:
        assert time.monotonic() < deadline, path.read_text()
        time.sleep(0.1)
    return match[0]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """Address of a scheduler without workers."""
    folder = tmp_path_factory.mktemp("cluster")
    process = started(folder, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    try:
        yield said(folder / "scheduler.log", r"tcp://127\.0\.0\.1:\d+"), folder
    finally:
        process.terminate()
        process.wait(timeout=30)


def test_cluster_without_workers_is_refused(scheduler: tuple[str, Path]) -> None:
    address, _ = scheduler
    with pytest.raises(InputError, match=f"{address}' has no worker; start some with `dask worker {address}`"):
        cluster(address).__enter__()


def test_two_workers_give_the_same_rows_bit_for_bit(scheduler: tuple[str, Path], tmp_path: Path) -> None:
    address, folder = scheduler
    names = ("worker1", "worker2")
    options = ("--nthreads", "2", "--no-nanny", "--no-dashboard")
    processes = [started(folder, name, address, *options, "--name", name) for name in names]
    try:
        for name in names:
            said(folder / f"{name}.log", "Registered to")
        for text in (None, HUMANOID):
            loaded = suite(tmp_path) if text is None else suite(tmp_path, text)
            with cluster(address) as workers:
                assert workers.count == 2
                run_sweep(loaded, tmp_path / f"far{text is None}", workers)
            run_sweep(loaded, tmp_path / f"near{text is None}", HERE)
            far, near = (read_results(tmp_path / f"{name}{text is None}") for name in ("far", "near"))
            assert lasting(far).equals(lasting(near))
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(timeout=30)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://", "127.0.0.1:x"])
def test_cluster_out_of_reach_is_refused_in_one_line(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.sweep.executors.CONNECT", 1.0)
    with pytest.raises(InputError) as caught:
        cluster(address).__enter__()
    assert str(caught.value).startswith(f"--cluster: no scheduler answers at {address!r}: ")
    assert "\n" not in str(caught.value)
