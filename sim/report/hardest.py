"""The hardest push that is recovered again and again, of each direction of a sweep, run again and filmed."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

from controllers.interface import Phase
from models.errors import InputError
from sim.analysis.frame import groups, records, recovered
from sim.analysis.summary import summarise
from sim.presenter.threshold_section import holed_thresholds
from sim.presenter.who import by_controller
from sim.record.trace import Trace
from sim.report.envelope import chosen_case
from sim.results.table import write_bytes
from sim.sweep.replay import replay
from sim.viz.film_strip import part_of, strip_frames
from sim.viz.video import render_episode

INDEX = "hardest.json"
"""Which episode each film is of, and whether every bit of it came back."""
_BEFORE, _AFTER = 0.5, 1.0  # [s] filmed before the push and after it came to rest
_STRIP_BEFORE, _STRIP_AFTER = 0.02, 0.25  # [s] of the strip, before the push and after the steps that answer it


@dataclass(frozen=True, kw_only=True)
class Hardest:
    """What is filmed.

    Attributes:
        threshold: of the direction, an entry of `robust` of a summary.
        row: the first replica that is recovered at that level.
        hole: whether some push to that side of less than 75 % of the threshold was lost.
    """

    threshold: Mapping[str, Any]
    row: Mapping[str, Any]
    hole: bool = False

    @property
    def name(self) -> str:
        """Of its files, without their ending: "hardest_090"."""
        way = float(self.threshold["direction_deg"])
        return f"hardest_{way:03.0f}" if way.is_integer() else f"hardest_{way:05.1f}"

    @property
    def words(self) -> str:
        """The push, in words."""
        one = self.threshold
        scaled = "" if one["over_omega_d"] is None else f", {one['over_omega_d']:.2f} ωd"
        above = ", above a hole" if self.hole else ""
        return f"{one['direction_deg']:g}°: {one['delta_v']:g} m/s{scaled}{above}"

    @property
    def entry(self) -> dict[str, Any]:
        """What the index says of it."""
        of_threshold, of_row = (
            ("direction_deg", "delta_v", "over_omega_d", "controller"),
            ("episode", "replica", "trace_hash"),
        )
        return {name: self.threshold[name] for name in of_threshold} | {name: self.row[name] for name in of_row}


def hardest_pushes(
    rows: pd.DataFrame, sweep: dict[str, Any], controller: str | None = None, case: str | None = None
) -> list[Hardest]:
    """The hardest robust push of each direction of which there is one.

    Args:
        rows: of a sweep.
        sweep: what `sweep.json` says of it.
        controller: who answers; None for the first that is shown.
        case: which case, if there are several.

    Raises:
        InputError: if there are no thresholds, or not such ones.
    """
    summary = summarise(rows, sweep)
    what = chosen_case(summary, case)
    robust = by_controller(summary, (one for one in summary["robust"] if one.get("case", {}) == what))
    if controller is not None and controller not in robust:
        raise InputError(f"--controller: {controller!r} is none of the sweep's; choose one of {', '.join(robust)}")
    name = controller or next(iter(robust))
    tries = dict(groups(rows[recovered(rows)], ["controller", "direction_deg", "delta_v", *what]))
    found, holed = [], holed_thresholds(summary, what)
    for one in robust[name]:
        if one["delta_v"]:
            same = tries[(name, one["direction_deg"], one["delta_v"], *what.values())]
            row, hole = records(same.sort_values("replica").head(1))[0], (name, one["direction_deg"]) in holed
            found.append(Hardest(threshold=one, row=row, hole=hole))
    return found


def film_hardest(
    folder: Path, target: Path, pushes: Sequence[Hardest], progress: Callable[[float], None] | None = None
) -> Iterator[tuple[Hardest, str]]:
    """Film what is not filmed yet, one after another: a video, and a strip of a few frames.

    Args:
        folder: of the sweep.
        target: folder to write; one that holds films of the same pushes is gone on with.
        pushes: to film.
        progress: called now and then with the number that is done.

    Yields:
        Each push, with what became of it in words.

    Raises:
        InputError: if the target cannot be written.
    """
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out: {str(target)!r} cannot be made: {error.strerror}") from None
    index = _read_index(target)
    for i, push in enumerate(pushes):
        video, strip = target / f"{push.name}.mp4", target / f"{push.name}.png"
        known = index.get(push.name, {})
        if push.entry.items() <= known.items() and video.exists() and strip.exists():
            yield push, f"is filmed already; {known['replay']}"
        else:
            again = replay(folder, push.row["episode"])
            trace, start = again.result.trace, again.result.pushes[-1].start
            settled = again.result.outcome.settled_at
            end = float(trace.time[-1]) if settled is None else max(settled, start) + _AFTER
            begin = again.result.pushes[0].start - _BEFORE

            def filmed(share: float, done: int = i) -> None:
                if progress is not None:
                    progress(done + share)

            render_episode(part_of(trace, begin, end), video, progress=filmed)
            write_bytes(_strip(trace, start), strip)
            index[push.name] = {**push.entry, "replay": again.words()}
            write_bytes((json.dumps(index, indent=1) + "\n").encode(), target / INDEX)
            yield push, again.words()
        if progress is not None:
            progress(i + 1)


def _strip(trace: Trace, start: float) -> bytes:
    """Frames side by side, from the push to the end of the steps that answer it, as PNG."""
    frames = strip_frames(part_of(trace, start - _STRIP_BEFORE, answered(trace, start) + _STRIP_AFTER))
    stream = io.BytesIO()
    Image.fromarray(np.concatenate([frame for _, frame in frames], axis=1)).save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def answered(trace: Trace, start: float) -> float:
    """When the steps that answer a push have ended [s]; those that restore the stance later are no part of them.

    Args:
        trace: of the episode.
        start: of the push [s], which is returned if no step follows.
    """
    stepping = trace.time[(trace["phase"] == Phase.STEPPING.value) & (trace.time >= start)]
    if not stepping.size:
        return start
    pauses = np.flatnonzero(np.diff(stepping) > _STRIP_AFTER)
    return float(stepping[pauses[0] if pauses.size else -1])


def _read_index(target: Path) -> dict[str, Any]:
    try:
        found = json.loads((target / INDEX).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}  # nothing filmed that could be relied on
    return found if isinstance(found, dict) else {}
