"""One episode: the worlds of pendulum and humanoid, pushes, senses, the tick, its recording, and the run's folder."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.episode.episode import Episode, EpisodeResult, run_episode

__all__ = ["Episode", "EpisodeResult", "run_episode"]


def __getattr__(name: str) -> Any:
    # The physics takes a second to import, and those who ask for a run's folder only do without.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from sim.episode import episode

    return getattr(episode, name)
