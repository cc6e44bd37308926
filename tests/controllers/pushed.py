"""Pushes of the pendulum and what is asked of the record: what the tests of the supervisor share."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from controllers.stepping.contact_state import EDGE
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode


def scenario(*pushes: tuple[float, ...], controller: str = "supervisor", **fields: Any) -> Scenario:
    """Pushes of (start, direction, delta_v) that last 0.1 s on the pendulum, or as long as a fourth entry says."""
    given = {
        "description": "pushes of the pendulum",
        "world": "pendulum",
        "controller": controller,
        "duration": pushes[-1][0] + 5.0,
        "variation": {"pose": 0.0},
        "pushes": [
            dict(zip(("start", "direction", "delta_v", "duration"), map(float, push), strict=False)) for push in pushes
        ],
    }
    return Scenario.model_validate(given | fields)


def run(*pushes: Any, **fields: Any) -> EpisodeResult:
    return run_episode(scenario(*pushes, **fields), polygons=False)


@cache
def push(direction: float, delta_v: float, controller: str = "supervisor") -> EpisodeResult:
    return run((0.1, direction, delta_v), controller=controller)


def lift_offs(result: EpisodeResult) -> list[dict[str, Any]]:
    """Decisions to step because of a push; a step that only closes the feet has no candidates."""
    return [d for d in result.decisions if d["candidates"]]


def assert_zmp_was_inside(result: EpisodeResult) -> None:
    trace = result.trace
    # The corners of a polygon and its edge lines are rounded separately.
    assert trace["support_slack"].min() >= EDGE - 1e-12
    # Nothing had to be clamped by the world: command and what was held are the same.
    commanded = np.column_stack([trace["zmp_cmd_x"], trace["zmp_cmd_y"]])[:-1]
    assert np.column_stack([trace["zmp_x"], trace["zmp_y"]])[1:] == pytest.approx(commanded, abs=1e-12)
