"""A few frames of an episode, evenly over a part of it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray

from sim.record.trace import Trace
from sim.viz.video import render_episode

Frame = NDArray[np.uint8]

FRAMES = 6
_SIZE = (320, 240)  # [px]


def part_of(trace: Trace, begin: float, end: float) -> Trace:
    """The rows of a trace from one time to another [s]."""
    first, last = np.searchsorted(trace.time, [begin, min(end, float(trace.time[-1]))])
    return Trace(values=trace.values[first : last + 1], units=trace.units, metadata=trace.metadata)


def strip_frames(shown: Trace) -> list[tuple[float, Frame]]:
    """`FRAMES` pictures (height, width, 3) of a trace, each with its time [s].

    Raises:
        InputError: if the robot's file is gone.
        RuntimeError: ffmpeg failed.
    """
    rate = (FRAMES - 1) / float(shown.time[-1] - shown.time[0])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "strip.mp4"
        # Slow motion gives the moments; the rate of the film itself does not matter.
        render_episode(shown, path, size=_SIZE, fps=10.0, slow=rate / 10.0, hold=0.0, explained_once=True)
        # Not mediapy, whose way to ask ffmpeg for the size fails since ffmpeg 8.
        film = imageio_ffmpeg.read_frames(str(path))
        next(film)  # what the file says of itself
        pictures = [np.frombuffer(picture, dtype=np.uint8).reshape(*_SIZE[::-1], 3) for picture in film]
    times = [float(shown.time[0]) + i / rate for i in range(len(pictures))]
    return list(zip(times, pictures, strict=True))
