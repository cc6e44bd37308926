"""Runs a suite: episodes side by side, each written down as it ends; goes on where it was stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from models.errors import InputError
from scenarios.suite_library import LoadedSuite
from sim.executors import Workers
from sim.sweep_crew import Crew
from sim.sweep_episode import Job
from sim.sweep_plan import Episode, Series, plan, scenario_of
from sim.sweep_progress import Progress
from sim.sweep_store import Store, describe, owned, prepare

_RECOVERED = "recovered"


class Agenda:
    """What to run next: series side by side, each episode of a series after the one before.

    Attributes:
        planned: episodes that the suite has at most.
        done: episodes that are finished, those of former runs included.
        skipped: episodes that an ended series did not need.
        adaptive: whether a series may end early.
    """

    def __init__(self, series: Iterable[Series], finished: Mapping[str, str]) -> None:
        """Take up the work.

        Args:
            series: all of the suite.
            finished: episode -> outcome of what has been run already.
        """
        self._series = {one.name: one for one in series}
        self.planned = sum(len(one.episodes) for one in self._series.values())
        self.adaptive = any(one.stop_after is not None for one in self._series.values())
        self.done = self.skipped = 0
        self._at: dict[str, int] = {}
        self._straight: dict[str, int] = {}
        self._ready: deque[str] = deque()
        for name, one in self._series.items():
            self._at[name] = self._straight[name] = 0
            while (episode := self._current(name)) is not None and episode.name in finished:
                self._count(name, finished[episode.name])
            if self._current(name) is not None:
                self._ready.append(name)
            self.skipped += 0 if self._current(name) is not None else len(one.episodes) - self._at[name]

    def next(self) -> Episode | None:
        """An episode to run now, or None if all that is left waits for another, or nothing is left."""
        return self._current(self._ready.popleft()) if self._ready else None

    def finish(self, episode: Episode, outcome: str) -> None:
        """An episode has ended."""
        name = episode.series
        self._count(name, outcome)
        if self._current(name) is not None:
            self._ready.append(name)
        else:
            self.skipped += len(self._series[name].episodes) - self._at[name]

    def _count(self, name: str, outcome: str) -> None:
        self._at[name] += 1
        self._straight[name] = 0 if outcome == _RECOVERED else self._straight[name] + 1
        self.done += 1

    def _current(self, name: str) -> Episode | None:
        one, at = self._series[name], self._at[name]
        ended = one.stop_after is not None and self._straight[name] >= one.stop_after
        return None if ended or at == len(one.episodes) else one.episodes[at]


def run_sweep(loaded: LoadedSuite, folder: Path, workers: Workers, *, progress: Progress | None = None) -> None:
    """Run what a suite's folder lacks.

    Args:
        loaded: the suite.
        folder: of the sweep; new, empty, or of the same suite.
        workers: who runs the episodes.
        progress: is told how it goes.

    Raises:
        InputError: if the suite is impossible, the folder is another suite's, a file in it is damaged, or the disk
            is full; what is finished is kept.
    """
    series = plan(loaded)
    with owned(folder):
        prepare(loaded, folder)
        store = Store(folder)
        strangers = store.outcomes.keys() - {episode.name for one in series for episode in one.episodes}
        if strangers:
            raise InputError(
                f"{str(folder)!r} holds {len(strangers)} episodes that are none of {loaded.name!r}; "
                "choose another folder with --out"
            )
        agenda = Agenda(series, store.outcomes)
        if progress is not None:
            progress.begin(agenda, store.outcomes.values())

        def finished(job: Job, row: dict[str, Any]) -> None:
            store.add(row)
            agenda.finish(job.episode, row["outcome"])
            if progress is not None:
                progress.tell(agenda, row["outcome"])

        def jobs() -> Iterator[Job]:
            while (episode := agenda.next()) is not None:
                yield Job(episode=episode, scenario=scenario_of(loaded, episode))

        Crew(workers, finished).work(jobs)
        store.finish()
        describe(loaded, folder, planned=agenda.planned, finished=len(store.outcomes))
