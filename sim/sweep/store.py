"""The folder of a sweep: rows written as they come, each whole or not at all, and by one sweep at a time."""

from __future__ import annotations

import fcntl
import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from controllers.registry import CONTROLLERS
from models.errors import InputError
from scenarios.suite_catalogue import LoadedSuite
from sim.record.places import real_path
from sim.record.versions import commit, versions
from sim.results import table as results
from sim.results.push_size import robot_named
from sim.sweep.plan import robots, suite_hash

# So many files of one row are made into one file of many: few enough to read, many enough not to rewrite often.
BUNDLE = 256
_BUNDLE = "bundle-"
LOCK = ".lock"
"""Held while a sweep runs, and let go by the system however it ends."""


class Store:
    """The rows on disk: each written as it comes, whole or not at all.

    Attributes:
        outcomes: episode -> outcome of every row.
    """

    def __init__(self, folder: Path) -> None:
        """Read what there is.

        Raises:
            ResultsError: if a file is damaged.
        """
        self._folder, self._rows = folder, folder / results.ROWS
        self._rows.mkdir(exist_ok=True)
        for part in (*folder.glob(".*.part"), *self._rows.glob(".*.part")):
            part.unlink()
        self.outcomes: dict[str, str] = {}
        self._single: list[Path] = []
        single = [path for path in results.row_files(folder) if _is_single(path)]
        for path in (path for path in results.row_files(folder) if path not in single):
            self._note(path)
        for path in single:
            # One that was bundled just before a sweep was killed has not been deleted yet.
            if path.stem in self.outcomes:
                path.unlink()
            else:
                self._note(path)
                self._single.append(path)

    def add(self, row: Mapping[str, Any]) -> None:
        """Write a row down."""
        path = self._rows / f"{row['episode']}.parquet"
        results.write_table(results.as_table([row]), path)
        self.outcomes[row["episode"]] = row["outcome"]
        self._single.append(path)
        if len(self._single) >= BUNDLE:
            self._bundle()

    def finish(self) -> None:
        """Write all rows into one file beside them, from which they can be had if it is damaged."""
        self._bundle()
        results.write_table(results.read_results(self._folder), self._folder / results.RESULTS)

    def _note(self, path: Path) -> None:
        table = results.read_file(path)
        self.outcomes |= dict(zip(table["episode"].to_pylist(), table["outcome"].to_pylist(), strict=True))

    def _bundle(self) -> None:
        if len(self._single) < 2:
            return
        table = results.without_repeats(results.read_file(path) for path in self._single)
        name = hashlib.sha256("".join(table["episode"].to_pylist()).encode()).hexdigest()[:12]
        results.write_table(table, self._rows / f"{_BUNDLE}{name}.parquet")
        for path in self._single:
            path.unlink()
        self._single = []


def _is_single(path: Path) -> bool:
    return path.parent.name == results.ROWS and not path.name.startswith(_BUNDLE)


def prepare(loaded: LoadedSuite, folder: Path) -> None:
    """Make a sweep's folder, or check that it is this suite's.

    Raises:
        InputError: if it is something else's.
    """
    sweep = folder / results.SWEEP
    if sweep.exists():
        known = results.read_sweep(folder)
        if known["suite_hash"] != suite_hash(loaded):
            raise InputError(f"{str(folder)!r} holds {_other(known, loaded)}; choose another folder with --out")
        now = {name: one["source"] for name, one in _appearances(loaded).items()} | _robots(loaded) | loaded.sources()
        then = {name: one["source"] for name, one in known.get("controllers", {}).items()}
        then |= known.get("robots", {}) | known.get("files", {})
        if changed := [name for name in now if name in then and then[name] != now[name]]:
            raise InputError(
                f"{str(folder)!r} holds results of {changed[0]!r} as its file was then, and it has changed since; "
                "choose another folder with --out"
            )
        return
    results.write_bytes(loaded.text.encode(), folder / results.SUITE)
    describe(loaded, folder, planned=loaded.suite.episodes, finished=0)


def _appearances(loaded: LoadedSuite) -> dict[str, dict[str, str | None]]:
    """How each controller is shown, in the order of the suite, and the hash of its file."""
    return {name: CONTROLLERS.entry(full).appearance for name, full in loaded.classes("controller").items()}


def _robots(loaded: LoadedSuite) -> dict[str, str]:
    """Hash of each robot, by its name."""
    return {name: robot_named(full).sha256 for name, full in robots(loaded).items()}


def _libraries(loaded: LoadedSuite) -> list[str]:
    """What its controllers bring, each once."""
    names = loaded.classes("controller").values()
    return list(dict.fromkeys(library for full in names for library in CONTROLLERS.entry(full).libraries))


def _other(known: Mapping[str, Any], loaded: LoadedSuite) -> str:
    """What a folder holds that is another suite's, in words that tell the two apart."""
    then, now = known.get("name"), loaded.name
    if then != now:
        return f"results of the suite {then!r}, not of {now!r}"
    worlds = [
        "the worlds of its file" if one is None else f"the world {one} only"
        for one in (known.get("world"), loaded.only)
    ]
    if worlds[0] != worlds[1]:
        return f"results of the suite {now!r} in {worlds[0]}, not in {worlds[1]}"
    return f"results of the suite {now!r} as it was then, and its file or Okiagari's defaults have changed since"


def _check_foreign(folder: Path) -> None:
    """Refuse a folder that is not a sweep's, before a lock is left in it."""
    if not folder.is_dir() or (folder / results.SWEEP).exists():
        return
    ours = {results.SUITE, results.ROWS, results.RESULTS, LOCK}
    foreign = sorted(entry.name for entry in folder.iterdir() if entry.name not in ours and entry.suffix != ".part")
    if foreign:
        raise InputError(
            f"{str(folder)!r} holds {foreign[0]!r}, which no sweep writes; choose another folder with --out"
        )


def describe(loaded: LoadedSuite, folder: Path, *, planned: int, finished: int) -> None:
    """Write `sweep.json`: whose folder it is, with the versions that began it."""
    path, suite = folder / results.SWEEP, loaded.suite
    if path.exists():
        begun = results.read_sweep(folder)
    else:
        begun = {"versions": versions(_libraries(loaded)), "commit": commit()}
    content = {
        "name": loaded.name,
        "description": suite.description,
        "tuned_on": suite.tuned_on,
        "train": None if suite.train is None else suite.train.model_dump(),
        "first": None if suite.first is None else suite.first.model_dump(),
        "variants": suite.variants,
        "world": loaded.only,
        "options": list(loaded.options),
        "suite_hash": suite_hash(loaded),
        "seed": suite.seed,
        "rest": loaded.base.judge.rest,
        "controllers": _appearances(loaded),
        "robots": _robots(loaded),
        "files": loaded.sources(),
        "versions": begun["versions"],
        "commit": begun["commit"],
        "planned": planned,
        "finished": finished,
    }
    results.write_bytes((json.dumps(content, indent=2) + "\n").encode(), path)


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Make the folder and keep every other sweep out of it.

    Raises:
        InputError: if it cannot be written, holds what no sweep writes, or another sweep is at it.
    """
    real_path(folder, "--out")
    _check_foreign(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = open(folder / LOCK, "w")  # noqa: SIM115
    except OSError as error:
        raise InputError(f"--out: {str(folder)!r} cannot be written: {error.strerror}") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{str(folder)!r} is being written by another sweep; wait for its end") from None
        yield
