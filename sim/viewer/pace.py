"""Real time: holds a simulation back to the clock on the wall, and says when it cannot keep up."""

from __future__ import annotations

import time

_LEAST_WAIT = 0.004  # [s]; the system cannot wait for less with any precision
_MOST_BEHIND = 0.25  # [s] that are caught up with; more is given up
_MEASURED = 1.0  # [s] of the wall clock over which the speed is measured
_KEEPS_UP = 0.9


class Pace:
    """Paces a simulation whose time starts anywhere.

    Attributes:
        factor: simulated time / wall time of late.
    """

    def __init__(self) -> None:
        """Begin at the next `wait`."""
        self.factor = 1.0
        self._start: float | None = None
        self._measured_from = 0.0, 0.0

    @property
    def words(self) -> str:
        """The factor, and whether that is slower than real time."""
        slow = "; this machine is too slow for real time" if self.factor < _KEEPS_UP else ""
        return f"{self.factor:.2f} × real time{slow}"

    def rest(self) -> None:
        """The simulation stands still until the next `wait`."""
        self._start = None

    def wait(self, simulated: float) -> None:
        """Wait until the wall clock has come to a simulated time [s]."""
        now = time.perf_counter()
        if self._start is None:
            self._start, self._measured_from = now - simulated, (now, simulated)
        ahead = self._start + simulated - now
        if ahead > _LEAST_WAIT:
            time.sleep(ahead)
        elif ahead < -_MOST_BEHIND:
            self._start -= ahead
        since, then = self._measured_from
        if now - since > _MEASURED:
            self.factor = (simulated - then) / (now - since)
            self._measured_from = now, simulated
