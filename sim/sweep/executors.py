"""Where the episodes of a sweep run: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait

from models.errors import InputError, one_line

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
CONNECT = 10.0
"""Longest wait for a cluster's scheduler [s]."""


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Who runs the episodes.

    Attributes:
        count: how many run at a time.
        make: makes the executor; anew if it broke.
        share_code: whether they are other processes of this machine, which load the code that this one compiled.
    """

    count: int
    make: Callable[[], Executor]
    share_code: bool = False


@contextmanager
def local(count: int) -> Iterator[Workers]:
    """Processes of this machine, each with one thread.

    Args:
        count: how many.
    """
    kept = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    # A fresh interpreter: a forked one would inherit this one's threads' locks.
    context = multiprocessing.get_context("spawn")

    def make() -> Executor:
        pool = ProcessPoolExecutor(count, mp_context=context, initializer=_be_a_worker)
        # Each process starts with its first task: these let them import while this one prepares the first episodes.
        for _ in range(count):
            pool.submit(_nothing)
        return pool

    try:
        yield Workers(count=count, make=make, share_code=True)
    finally:
        for name, value in kept.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def cluster(address: str) -> Iterator[Workers]:
    """The workers of a Dask cluster, which must have Okiagari installed.

    Args:
        address: of its scheduler, for instance `tcp://127.0.0.1:8786`.

    Raises:
        InputError: if `distributed` is not installed, or the cluster cannot be reached or has no worker.
    """
    try:
        from distributed import Client
        from distributed.comm.addressing import resolve_address
    except ImportError:
        raise InputError("--cluster: needs dask.distributed; pip install 'okiagari[cluster]'") from None
    # It logs pages about a lost connection, of which one line is told below or by whoever waits for a result.
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        resolve_address(address)  # a client of an address that is none makes trouble even when it is thrown away
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        why = one_line(error) or type(error).__name__
        raise InputError(f"--cluster: no scheduler answers at {address!r}: {why}") from None
    try:
        count = len(client.scheduler_info(n_workers=-1)["workers"])
        if not count:
            raise InputError(f"--cluster: {address!r} has no worker; start some with `dask worker {address}`")
        yield Workers(count=count, make=client.get_executor)
    finally:
        client.close()


def _be_a_worker() -> None:
    """Leave Ctrl-C to the parent, do not outlive it, and import what episodes take."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    importlib.import_module("sim.sweep.worker")


def _nothing() -> None:
    """A task that only starts a process."""


def _end_with_parent() -> None:
    # A pool's worker holds both ends of its queues, so it would wait for ever for a parent that was killed.
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
