"""One step after another: from a landing, in the air, and by another rule."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sim.episode.episode import EpisodeResult
from sim.record.outcome import Result
from tests.controllers.pushed import assert_zmp_was_inside, lift_offs, push, run


def test_after_a_landing_the_other_foot_steps() -> None:
    result = push(60, 1.5)
    steps = [d["plan"].split()[0] for d in lift_offs(result)]
    assert len(steps) >= 2
    assert all(one != following for one, following in pairwise(steps))


def landing(result: EpisodeResult, after: float) -> np.ndarray:
    """(3,) of time and place of the first landing after a time."""
    trace = result.trace
    for side in ("left", "right"):
        up = trace[f"{side}_stance"] == 0.0
        if up[trace.time < after].any():
            down = np.flatnonzero(~up & (trace.time >= after))[0]
            return np.array([trace.time[down], trace[f"{side}_x"][down], trace[f"{side}_y"][down]])
    raise AssertionError("no foot was in the air")


def test_a_second_push_during_the_swing_moves_the_foothold() -> None:
    """Unless footholds stay as they were at the lift-off."""
    first, second = (0.1, 0.0, 0.5, 0.05), (0.17, 40.0, 0.25, 0.02)
    moved = {}
    for replan in (True, False):
        alone, both = (
            run(*pushes, stepping={"replan": replan}, duration=5.0) for pushes in ((first,), (first, second))
        )
        lifted = next(d for d in alone.decisions if d["phase"] == "stepping")["time"]
        assert lifted < second[0]
        one, other = landing(alone, second[0]), landing(both, second[0])
        assert one[0] == other[0] > second[0] + second[3]
        moved[replan] = float(np.hypot(*(other - one)[1:]))
        if replan:
            assert both.outcome.result is Result.RECOVERED
            assert_zmp_was_inside(both)
    assert moved[True] > 0.01
    # Of a foot that comes down a tick or two from the end of its way.
    assert moved[False] < 1e-9


def test_a_push_after_the_recovery_is_answered_from_the_new_stance() -> None:
    result = run((0.1, 30, 0.8), (3.0, 200, 0.6))
    assert result.outcome.result is Result.RECOVERED
    assert [record.chosen for record in result.pushes] == ["stepping", "stepping"]
    # Each was predicted by the sets of the stance it found.
    assert all(record.in_tracking_set for record in result.pushes)


def test_with_one_step_at_most_no_second_follows() -> None:
    many, one = (run((0.1, 0, 1.5), stepping={"max_steps": n}) for n in (8, 1))
    assert many.outcome.result is Result.RECOVERED
    assert len(lift_offs(many)) >= 2
    assert len(lift_offs(one)) == 1
    assert one.outcome.result is not Result.RECOVERED


def test_the_polygon_rule_steps_without_sets() -> None:
    result = run((0.1, 0, 0.6), stepping={"rule": "polygon"})
    assert result.outcome.result is Result.RECOVERED
    assert result.outcome.steps_taken >= 1
    assert np.isnan(result.trace["tracking_slack"]).all()
    stepped = [d for d in result.decisions if d["phase"] == "stepping"]
    assert {d["tracking_slack"] for d in stepped} == {None}
    assert [c["name"].split()[0] for c in stepped[0]["candidates"]] == ["left", "right"]
