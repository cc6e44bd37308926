"""`python -m tests.fuzz --seed N --count M`: mutated scenarios, suites, robots and command lines, which may do no harm.

Harm is a traceback, a crash, 10 s without an answer, an answer of more than a line or without the file's name, or a
folder that is half written. Each offender is printed with its seed and number; `--only NUMBER` runs it alone and keeps
its files. Exit code 1 if there are any.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from multiprocessing import connection, get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "agg")

from tests.fuzz.cases import CASES

HOUSE = Path(__file__).resolve().parents[2]
PATIENCE = 10.0
"""So long a case may take [s]."""


def run_case(seed: int, number: int, folder: Path) -> str:
    """Run a case in an empty folder; what is wrong, or nothing."""
    rng = random.Random(f"{seed}/{number}")
    case = CASES[number % len(CASES)]
    try:
        return case(rng, folder)
    except Exception as error:  # noqa: BLE001 -- whatever it is, it is what is looked for
        frames = [each for each in traceback.extract_tb(error.__traceback__) if str(HOUSE) in each.filename]
        frames = [each for each in frames if "site-packages" not in each.filename]
        where, what = frames[-1], " ".join(f"{type(error).__name__}: {error}".split())[:200]
        return f"traceback: {Path(where.filename).relative_to(HOUSE)}:{where.lineno} {where.name}: {what}"


def _spoken(path: Path) -> str:
    """What was said on stderr; more than a line, or one that does not begin as it should, is wrong."""
    lines = path.read_text(errors="replace").splitlines()
    return "" if len(lines) <= 1 else f"{len(lines)} lines on stderr: {lines[0][:100]!r}"


def _work(pipe: Any, seed: int, numbers: range, scratch: Path) -> None:
    """Run cases one after another, and tell of each when it begins and how it ended."""
    said = scratch.with_suffix(".stderr")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT | os.O_APPEND), 2)
    for number in numbers:
        scratch.mkdir()
        os.chdir(scratch)
        os.truncate(said, 0)
        pipe.send((number, None))
        wrong = run_case(seed, number, scratch)
        sys.stderr.flush()
        sys.stdout.flush()
        pipe.send((number, wrong or _spoken(said)))
        shutil.rmtree(scratch)
    pipe.send(None)


class _Worker:
    """A process that runs every n-th case, begun anew after one that killed it."""

    def __init__(self, seed: int, numbers: range, scratch: Path) -> None:
        self._seed, self._numbers, self._scratch = seed, numbers, scratch
        self.done = False
        self._begin(numbers)

    def _begin(self, numbers: range) -> None:
        shutil.rmtree(self._scratch, ignore_errors=True)
        self.pipe, theirs = get_context("fork").Pipe()
        arguments = (theirs, self._seed, numbers, self._scratch)
        self._process = get_context("fork").Process(target=_work, args=arguments, daemon=True)
        self._process.start()
        theirs.close()
        self._number, self._since = numbers.start, time.monotonic()

    def listen(self) -> tuple[int, str] | None:
        """The number of a case that has ended and what was wrong with it, if one has."""
        found = None
        try:
            while self.pipe.poll() and found is None:
                message = self.pipe.recv()
                if message is None:
                    self.done = True
                    return None
                self._number, wrong = message
                self._since = time.monotonic()
                if wrong is not None:
                    found = self._number, wrong
        except EOFError:
            self._process.join()
            found = self._number, f"crash: exit code {self._process.exitcode}"
            self._go_on()
        if found is None and time.monotonic() - self._since > PATIENCE:
            self._process.kill()
            self._process.join()
            found = self._number, f"hang: no answer within {PATIENCE:g} s"
            self._go_on()
        return found

    def _go_on(self) -> None:
        rest = range(self._number + self._numbers.step, self._numbers.stop, self._numbers.step)
        if rest:
            self._begin(rest)
        else:
            self.done = True


def fuzz(seed: int, count: int) -> list[tuple[int, str]]:
    """Run the cases 0 to `count`; the offenders' numbers and what was wrong."""
    scratch = Path(tempfile.mkdtemp(prefix="okiagari-fuzz-"))
    each = min(len(os.sched_getaffinity(0)), count)
    workers = [_Worker(seed, range(first, count, each), scratch / f"w{first}") for first in range(each)]
    offenders: list[tuple[int, str]] = []
    while running := [worker for worker in workers if not worker.done]:
        connection.wait([worker.pipe for worker in running], timeout=0.5)
        for worker in running:
            found = worker.listen()
            if found is not None and found[1]:
                offenders.append(found)
                case = CASES[found[0] % len(CASES)].__name__
                print(f"--seed {seed} --only {found[0]}  {case}: {found[1]}", flush=True)
    shutil.rmtree(scratch, ignore_errors=True)
    return sorted(offenders)


def main() -> int:
    """Parse the command line and fuzz."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--only", type=int, help="run this case alone, and keep its files")
    asked = parser.parse_args()
    if asked.only is not None:
        folder = Path(tempfile.mkdtemp(prefix="okiagari-fuzz-"))
        os.chdir(folder)
        wrong = run_case(asked.seed, asked.only, folder)
        print(f"{folder}: {wrong or 'nothing wrong'}")
        return 1 if wrong else 0
    begin = time.monotonic()
    offenders = fuzz(asked.seed, asked.count)
    kinds = Counter(wrong.split(":")[0] for _, wrong in offenders)
    told = ", ".join(f"{count} {kind}" for kind, count in kinds.items()) or "no offender"
    print(f"{asked.count} cases of seed {asked.seed} in {time.monotonic() - begin:.0f} s: {told}")
    return 1 if offenders else 0


if __name__ == "__main__":
    sys.exit(main())
