"""What is seen in 3-D is what the video shows."""

from __future__ import annotations

import numpy as np
import pytest

from sim.record.trace import Trace
from sim.viewer.moment import Moment, Observer
from sim.viewer.page import _acting
from sim.viz.playback import Playback
from sim.viz.push_shapes import FADE
from tests.sim.still_traces import ROBOT, during, scenario, still_trace

RUN = scenario(duration=1.2, pushes=[{"start": 0.1, "duration": 0.1, "direction": 90.0, "impulse": 3.0}])


def watched(trace: Trace) -> list[Moment]:
    observer, playback = Observer(trace.channels, trace.metadata["robot"]), Playback(trace)
    acting, moments = _acting(playback), []
    for tick, row in enumerate(trace.values):
        observer.see(row, acting.get(tick, {}), playback.scenario.pushes)
        moments.append(observer.moment(row))
    return moments


def test_marks_are_those_of_the_video() -> None:
    lifted = 1.0 - during(RUN, 0.5, 1.0, 1.0)
    weight = ROBOT.mass * ROBOT.gravity
    trace = still_trace(RUN, cog_x=0.01, cog_vx=0.3, zmp_y=0.02, left_force=lifted * weight, right_yaw=0.2)
    play = Playback(trace)
    for tick, moment in enumerate(watched(trace)):
        assert moment.time == play.time[tick]
        np.testing.assert_array_equal(moment.cog, play.cog[tick])
        np.testing.assert_array_equal(moment.dcm, play.dcm[tick])
        np.testing.assert_array_equal(moment.zmp, play.zmp[tick])
        np.testing.assert_array_equal(moment.zmp_command, play.zmp_command[tick])
        np.testing.assert_array_equal(moment.support, play.support(tick))
        np.testing.assert_array_equal(moment.pose, ROBOT.stand)


def test_the_ghost_is_that_of_the_video() -> None:
    trace = still_trace(RUN, cog_x=0.01, cog_vx=0.3, seen_cog_vx=0.32, dcm_error_x=0.007, dcm_error_y=-0.002)
    seen = Playback(trace).seen
    assert seen is not None
    assert seen.cog[0, :2] == pytest.approx([0.01 + 0.007 - 0.02 / ROBOT.omega, -0.002])
    for tick, moment in enumerate(watched(trace)):
        np.testing.assert_allclose(moment.seen_cog, seen.cog[tick], rtol=0.0, atol=1e-12)  # sums in another order


def test_who_sees_the_truth_has_no_ghost() -> None:
    assert np.isnan(watched(still_trace(RUN))[0].seen_cog).all()


def test_nothing_supports_one_who_flies() -> None:
    moment = watched(still_trace(RUN, left_force=0.0, right_force=0.0, zmp_x=np.nan, zmp_y=np.nan))[0]
    assert moment.support is None
    assert np.isnan(moment.zmp).all()


def test_arrow_points_at_the_push_and_stays_a_moment() -> None:
    trace = still_trace(RUN, push_fy=during(RUN, 0.1, 0.2, 30.0), push_x=0.02, push_z=0.35)
    moments = watched(trace)
    shown = [moment.time for moment in moments if len(moment.arrows)]
    assert shown[0] == pytest.approx(0.1)
    assert shown[-1] == pytest.approx(0.198 + FADE)
    for moment in moments[60:200:20]:
        (tail, tip), *others = moment.arrows
        assert not others
        assert not len(moment.arcs)
        np.testing.assert_allclose(tip, [0.02, 0.0, 0.35])
        assert (tail - tip)[[0, 2]] == pytest.approx(0.0)
        assert tail[1] < -0.1


def test_a_torque_is_an_arc_and_what_is_over_gives_way() -> None:
    turn = {"start": 0.1, "duration": 0.1, "torque": [0.0, 0.0, 2.0]}
    both = scenario(duration=1.2, pushes=[turn, {"start": 0.15, "direction": 0.0, "impulse": 1.0}])
    observer = Observer(still_trace(both).channels, still_trace(both).metadata["robot"])
    row, point, seen = still_trace(both).values[0].copy(), np.array([0.0, 0.0, 0.3]), {}
    for time in (0.1, 0.15, 0.2, 0.26, 0.3):
        row[0] = time
        acting = {0: (np.array([0.0, 0.0, 2.0]), point)} if time < 0.2 else {}
        acting |= {1: (np.array([10.0, 0.0, 0.0]), point)} if 0.15 <= time < 0.25 else {}
        observer.see(row, acting, both.pushes)
        seen[time] = observer.moment(row)
    assert [len(seen[time].arrows) for time in (0.1, 0.15, 0.2, 0.26)] == [1, 2, 2, 2]
    around = seen[0.1].arcs.reshape(-1, 3)
    np.testing.assert_allclose(around[:, 2], 0.3, atol=1e-12)
    np.testing.assert_allclose(np.hypot(around[:, 0], around[:, 1]), np.hypot(*around[0, :2]))
    row[0] = 0.4
    observer.see(row, {2: (np.array([0.0, 9.0, 0.0]), point)}, (*both.pushes, both.pushes[1]))
    after = observer.moment(row)
    assert len(after.arrows) == 1
    assert not len(after.arcs)
