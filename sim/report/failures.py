"""The failures that ask for an explanation, run again and shown as strips of frames."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

from models.errors import OkiagariError
from sim.analysis.check import describe, replay_command
from sim.analysis.frame import crashed, records, recovered
from sim.analysis.prediction_score import SETS, predicted_safe, signed_slack
from sim.episode.episode import run_episode
from sim.record.outcome import last_push_end
from sim.record.trace import Trace
from sim.sweep.replay import scenario_of_row
from sim.viz.film_strip import Frame, part_of, strip_frames
from sim.viz.video import missing_renderer

_BEFORE, _AFTER = 0.1, 0.15  # [s] shown before the push and after the fall
_LONGEST = 4.0  # [s] shown after a push that nobody fell from
_QUALITY = 82


@dataclass(frozen=True, kw_only=True)
class Failure:
    """An episode that was not recovered, as the page shows it.

    Attributes:
        row: of the sweep's table; what is missing is None.
        why: what is remarkable about it.
    """

    row: Mapping[str, Any]
    why: str

    @property
    def title(self) -> str:
        """Which one it is."""
        return describe(self.row).removeprefix("episode ")

    @property
    def reason(self) -> str:
        """How it ended."""
        row = self.row
        when = "" if row["time_of_fall"] is None else f" at {row['time_of_fall']:.2f} s"
        return f"{str(row['outcome']).replace('_', ' ')}{when}: {row['reason']}"

    @property
    def sets(self) -> str:
        """What the controller's sets said of the state at the end of the push."""
        parts = []
        for name in SETS:
            slack = self.row[f"{name}_slack_end"]
            if slack is not None and self.row[f"in_{name}_set_end"] is not None:
                where = "no step within reach" if not np.isfinite(slack) else f"{1e3 * slack:+.1f} mm"
                parts.append(f"{name} set {where}")
        return ", ".join(parts) or "no set was asked"

    def command(self, folder: Path) -> str:
        """What to type to see it."""
        return replay_command(folder, self.row)


@dataclass(frozen=True, kw_only=True)
class Strip:
    """Frames of an episode.

    Attributes:
        frames: (time since the start of the push [s], data URI of a JPEG), in order; empty if there are none.
        note: why there are none, or that the episode ended otherwise this time.
    """

    frames: tuple[tuple[float, str], ...]
    note: str | None


def worst_failures(pushes: pd.DataFrame, count: int) -> list[Failure]:
    """The failures that should least have happened.

    First what crashed; then in turn the weakest pushes, relative to the no-step limit, and those that were called safe
    with the greatest probability, or the most slack, and lost all the same; no two of the same direction and size.

    Args:
        pushes: of one controller, each with its `probability` of recovery if any is told.
        count: how many at most.
    """
    relative = pushes["delta_v_over_omega_d"]
    told = pushes["probability"] if "probability" in pushes else pd.Series(np.nan, pushes.index)
    ranked = pushes.assign(
        relative=relative.fillna(pushes["delta_v"]), slack=signed_slack(pushes).fillna(0.0), probability=told
    )
    fallen = ranked[~recovered(pushes) & ~crashed(pushes)]
    safe = fallen[predicted_safe(fallen).fillna(False).astype(bool)]
    queues = [
        [Failure(row=row, why="It crashed") for row in records(ranked[crashed(pushes)])],
        [
            Failure(row=row, why=f"The weakest push that was not recovered, {_size(row)}")
            for row in records(fallen.sort_values(["relative", "episode"]))
        ],
        [
            Failure(row=row, why=f"Predicted safe, {_why_safe(row)}, and lost")
            for row in records(
                # What the sets alone called safe first: nothing is left out of them.
                safe.sort_values(
                    ["probability", "slack", "episode"], ascending=[False, False, True], na_position="first"
                )
            )
        ],
    ]
    taken: dict[tuple[Any, Any], Failure] = {}
    while any(queues) and len(taken) < count:
        for queue in queues:
            while queue:
                failure = queue.pop(0)
                key = (failure.row["direction_deg"], failure.row["delta_v"])
                if key not in taken and len(taken) < count:
                    taken[key] = failure
                    break
    return list(taken.values())


def _why_safe(row: Mapping[str, Any]) -> str:
    """By what a push was called safe."""
    if row["probability"] is None:
        return f"with {1e3 * row['slack']:.1f} mm of slack"
    return f"recovery told to be {100 * row['probability']:.0f} % likely"


def _size(row: Mapping[str, Any]) -> str:
    size = row["delta_v_over_omega_d"]
    return f"{row['delta_v']:.2f} m/s" if size is None else f"Δv/(ωd) = {size:.2f}"


def film_strip(row: Mapping[str, Any]) -> Strip:
    """Run an episode of a sweep's table again and take frames of it from its pushes to the fall.

    Args:
        row: of the table, or of one push of a train (see `each_push`).
    """
    note = missing_renderer()
    if note is not None:
        return Strip(frames=(), note=note)
    if row["outcome"] == "crashed":
        return Strip(frames=(), note="it crashed, so there is nothing to see")
    scenario = scenario_of_row(row)
    try:
        result = run_episode(scenario, polygons=False)
        # Of a train, the push that the row is of; else also the push before the one that was asked for.
        train, pushes = row["train"] is not None, scenario.pushes
        start = float(row["push_start"]) if train else pushes[-1].start
        frames = _frames(result.trace, start, start if train else pushes[0].start, result.outcome.time_of_fall)
    except OkiagariError as error:
        return Strip(frames=(), note=str(error))
    outcome = result.outcome.result.value
    same = outcome == row["outcome"]
    words = f"run again for this picture, with these versions, it ended otherwise: {outcome.replace('_', ' ')}"
    return Strip(frames=tuple(frames), note=None if same else words)


def _frames(trace: Trace, start: float, begin: float, fall: float | None) -> list[tuple[float, str]]:
    end = last_push_end(trace.metadata["scenario"]) + _LONGEST if fall is None else fall + _AFTER
    frames = strip_frames(part_of(trace, begin - _BEFORE, end))
    return [(moment - start, _jpeg(frame)) for moment, frame in frames]


def _jpeg(picture: Frame) -> str:
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, format="JPEG", quality=_QUALITY, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()
