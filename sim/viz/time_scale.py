"""A time axis that gives the moments that matter room: quiet time is drawn narrower, and marked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter
from numpy.typing import NDArray

from controllers.interface import Phase
from sim.viz.playback import Playback

Array = NDArray[np.float64]

BEFORE, AFTER = 0.2, 0.8
"""Time before a push, and after it or a step, that is not quiet [s]."""
NARROWER = 8.0
"""How much narrower quiet time is."""
_LEAST = 1.5  # [s] of quiet that is worth narrowing
_CLOSE = 0.045  # of the axis, that two ticks need between them


@dataclass(frozen=True, kw_only=True)
class TimeScale:
    """A scale that bends at some times.

    Attributes:
        knots: (k,) times where it bends, ascending [s].
        places: (k,) where they are drawn.
        quiet: the intervals that are narrower [s].
    """

    knots: Array
    places: Array
    quiet: tuple[tuple[float, float], ...]

    def apply(self, axes: Axes) -> None:
        """Scale the x axis, put its ticks where they have room, and shade what is narrower."""
        first, last = float(self.knots[0]), float(self.knots[-1])
        axes.set_xscale("function", functions=(self._place, self._time))
        axes.set_xlim(first, last)
        axes.xaxis.set_major_locator(FixedLocator(self._ticks().tolist()))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda time, _: f"{time:g}"))

    def shade(self, axes: Axes) -> None:
        """Mark the quiet time."""
        for start, end in self.quiet:
            axes.axvspan(start, end, facecolor="#f4f4f4", edgecolor="#dcdcdc", hatch="///", linewidth=0, zorder=-1)

    def share(self, start: float, end: float) -> float:
        """Share of the axis between two times [s]."""
        a, b = self._place(np.array([start, end]))
        return float((b - a) / (self.places[-1] - self.places[0]))

    def middle(self, start: float, end: float) -> float:
        """The time that is drawn in the middle of two others [s]."""
        return float(self._time(self._place(np.array([start, end])).mean(keepdims=True))[0])

    def _place(self, time: Array) -> Array:
        return _line(np.asarray(time, dtype=float), self.knots, self.places)

    def _time(self, place: Array) -> Array:
        return _line(np.asarray(place, dtype=float), self.places, self.knots)

    def _ticks(self) -> Array:
        first, last = float(self.knots[0]), float(self.knots[-1])
        step = 0.25 if last - first < 3.0 else 0.5
        kept: list[float] = []
        # Whole seconds first, so that they are the ones that stay.
        candidates = np.arange(np.ceil(first / step), np.floor(last / step) + 1) * step
        for time in sorted(candidates.tolist(), key=lambda t: (t % 5 != 0, t % 1 != 0, t)):
            if all(self.share(*sorted((time, other))) > _CLOSE for other in kept):
                kept.append(time)
        return np.array(sorted(kept))


def time_scale(playback: Playback) -> TimeScale:
    """The scale of an episode: even if there is no push, or hardly any quiet time."""
    first, last = float(playback.time[0]), max(float(playback.time[-1]), float(playback.time[0]) + 1e-3)
    busy = [(push.start - BEFORE, push.end + AFTER) for push in playback.pushes if push.start <= last]
    if busy:
        busy += [(start, end + AFTER) for start, end, phase in playback.phases() if phase is Phase.STEPPING]
    quiet = tuple(gap for gap in _gaps(sorted(busy), first, last) if gap[1] - gap[0] >= _LEAST) if busy else ()
    knots = np.unique([first, *(time for gap in quiet for time in gap), last])
    widths = np.diff(knots)
    narrow = np.array([any(a <= start < b for a, b in quiet) for start in knots[:-1]])
    places = np.concatenate(([0.0], np.cumsum(np.where(narrow, widths / NARROWER, widths))))
    return TimeScale(knots=knots, places=places, quiet=quiet)


def _gaps(busy: list[tuple[float, float]], first: float, last: float) -> list[tuple[float, float]]:
    """What no busy interval covers."""
    found, at = [], first
    for start, end in busy:
        if start > at:
            found.append((at, min(start, last)))
        at = max(at, end)
    return [*found, (at, last)] if at < last else found


def _line(values: Array, known: Array, drawn: Array) -> Array:
    """Piecewise linear, going on at its ends."""
    inner: Array = np.interp(values, known, drawn)
    below, above = values < known[0], values > known[-1]
    slopes = (drawn[1] - drawn[0]) / (known[1] - known[0]), (drawn[-1] - drawn[-2]) / (known[-1] - known[-2])
    inner = np.where(below, drawn[0] + (values - known[0]) * slopes[0], inner)
    result: Array = np.where(above, drawn[-1] + (values - known[-1]) * slopes[1], inner)
    return result
