"""Ctrl-C that waits for a safe moment: one that strikes inside a lock of a pool's queues leaves it locked for ever."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Self


class HeldInterrupt:
    """Holds the first Ctrl-C back until `check`; a second one strikes at once. A context manager.

    In other threads than the main one, which Python never interrupts, or where Ctrl-C is ignored or somebody else's,
    nothing is changed.
    """

    def __init__(self) -> None:
        """Hold nothing yet."""
        self._struck = self._holds = False

    def __enter__(self) -> Self:
        in_main = threading.current_thread() is threading.main_thread()
        if in_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._hold)
            self._holds = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        if self._holds:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if kind is None:
            self.check()

    def check(self) -> None:
        """Give way to a Ctrl-C.

        Raises:
            KeyboardInterrupt: if there was one.
        """
        if self._struck:
            self._struck = False
            raise KeyboardInterrupt

    def _hold(self, number: int, frame: FrameType | None) -> None:
        self._struck = True
        signal.signal(signal.SIGINT, signal.default_int_handler)
