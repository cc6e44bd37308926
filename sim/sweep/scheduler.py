"""What a sweep runs next: series side by side, some of which end early."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping

from sim.sweep.plan import PlannedEpisode, Series

_RECOVERED = "recovered"


class Scheduler:
    """What to run next: series side by side, and of each only episodes that are run however those before them end.

    A series that ends after n failures in a row has n such episodes after a recovery, so that several workers can be
    at it, and yet the same episodes are run as one after another.

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
        self._outcomes = dict(finished)
        self._handed_out: set[str] = set()
        # Of each series: how many episodes from its first on are finished, and how many of the last of these failed.
        self._at = dict.fromkeys(self._series, 0)
        self._straight = dict.fromkeys(self._series, 0)
        self._ready: deque[str] = deque()
        self._is_ready: set[str] = set()
        for name, one in self._series.items():
            self.done += sum(episode.name in finished for episode in one.episodes)
            self._go_on(name)

    @property
    def left(self) -> int:
        """Episodes that may still be run."""
        return self.planned - self.done - self.skipped

    def next(self) -> PlannedEpisode | None:
        """An episode to run now, or None if all that is left waits for another, or nothing is left."""
        if not self._ready:
            return None
        name = self._ready.popleft()
        self._is_ready.remove(name)
        episode = self._startable(name)
        assert episode is not None
        self._handed_out.add(episode.name)
        self._make_ready(name)
        return episode

    def finish(self, episode: PlannedEpisode, outcome: str) -> None:
        """An episode has ended."""
        self._handed_out.remove(episode.name)
        self._outcomes[episode.name] = outcome
        self.done += 1
        self._go_on(episode.series)

    def _go_on(self, name: str) -> None:
        """Count what is finished of a series up to its first gap, and what it does not need if that ended it."""
        episodes, stop_after = self._series[name].episodes, self._series[name].stop_after
        for episode in self._certain(name):
            if (outcome := self._outcomes.get(episode.name)) is None:
                break
            self._at[name] += 1
            self._straight[name] = 0 if outcome == _RECOVERED else self._straight[name] + 1
        if stop_after is not None and self._straight[name] >= stop_after:
            self.skipped += sum(one.name not in self._outcomes for one in episodes[self._at[name] :])
        else:
            self._make_ready(name)

    def _make_ready(self, name: str) -> None:
        if name not in self._is_ready and self._startable(name) is not None:
            self._ready.append(name)
            self._is_ready.add(name)

    def _startable(self, name: str) -> PlannedEpisode | None:
        """The first certain episode of a series that nobody has run or is at."""
        for episode in self._certain(name):
            if episode.name not in self._outcomes and episode.name not in self._handed_out:
                return episode
        return None

    def _certain(self, name: str) -> Iterator[PlannedEpisode]:
        """The episodes of a series from the first gap on that are run even if all those not finished fail."""
        one, straight = self._series[name], self._straight[name]
        for episode in one.episodes[self._at[name] :]:
            if one.stop_after is not None and straight >= one.stop_after:
                return
            yield episode
            straight = 0 if self._outcomes.get(episode.name) == _RECOVERED else straight + 1
