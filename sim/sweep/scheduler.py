"""What a sweep runs next: series side by side, some of which end early."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping

from sim.sweep.plan import PlannedEpisode, Series

_RECOVERED = "recovered"


class Scheduler:
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

    def next(self) -> PlannedEpisode | None:
        """An episode to run now, or None if all that is left waits for another, or nothing is left."""
        return self._current(self._ready.popleft()) if self._ready else None

    def finish(self, episode: PlannedEpisode, outcome: str) -> None:
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

    def _current(self, name: str) -> PlannedEpisode | None:
        one, at = self._series[name], self._at[name]
        ended = one.stop_after is not None and self._straight[name] >= one.stop_after
        return None if ended or at == len(one.episodes) else one.episodes[at]
