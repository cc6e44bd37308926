"""Torques and speeds become shares of what a motor has, and times at its limit."""

from __future__ import annotations

import numpy as np
import pytest

from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.episode import run_episode
from sim.record.motors import MotorLog, MotorUse

ROBOT = load_robot("utmu2")
STALL, FREE = ROBOT.stall_torque, ROBOT.no_load_speed
JOINTS = ROBOT.joint_names
PERIOD = 0.002


def log(*ticks: dict[int, tuple[float, float]]) -> MotorLog:
    """Each tick: joint -> torque and speed as shares of what its motor has; the others rest."""
    made = MotorLog(ROBOT, len(ticks) + 3)  # an episode may end before its time
    for tick in ticks:
        torque, speed = np.zeros(len(JOINTS)), np.zeros(len(JOINTS))
        for joint, (effort, share) in tick.items():
            torque[joint], speed[joint] = effort * STALL[joint], share * FREE[joint]
        made.add(torque, speed)
    return made


def use(*ticks: dict[int, tuple[float, float]]) -> MotorUse:
    found = log(*ticks).use(PERIOD)
    assert found is not None
    return found


def test_peaks_are_of_the_joint_that_used_most_of_its_motor() -> None:
    strong, weak = int(STALL.argmax()), int(STALL.argmin())
    assert STALL[strong] * 0.4 > STALL[weak] * 0.6
    found = use({strong: (-0.4, 0.1), weak: (0.6, 0.0)}, {strong: (0.2, -0.7)})
    assert (found.peak_torque_joint, found.peak_speed_joint) == (JOINTS[weak], JOINTS[strong])
    # A product and a division each: rounding only.
    assert found.peak_torque == pytest.approx(0.6 * STALL[weak], rel=1e-12)
    assert found.peak_torque_use == pytest.approx(0.6, rel=1e-12)
    assert found.peak_speed == pytest.approx(0.7 * FREE[strong], rel=1e-12)
    assert found.peak_speed_use == pytest.approx(0.7, rel=1e-12)


@pytest.mark.parametrize(
    ("effort", "share", "limited"),
    [
        (0.5, 0.5, True),  # on the line
        (0.5, 0.49, False),
        (-0.3, -0.7, True),
        (0.5, -0.9, False),  # it brakes, and has all of its torque
        (1.0, -0.9, True),
        (1.0, 0.0, True),
        (0.01, 1.2, True),  # driven faster than it can turn
    ],
)
def test_saturated_is_at_the_torque_speed_line(effort: float, share: float, limited: bool) -> None:
    found = use({3: (effort, share)}, {})
    assert found.saturated_time == pytest.approx(PERIOD * limited)
    assert found.saturated_joint == (JOINTS[3] if limited else None)


def test_time_is_of_any_motor_and_the_joint_is_the_longest_there() -> None:
    found = use({1: (1.0, 0.0)}, {1: (1.0, 0.0), 2: (1.0, 0.0)}, {2: (1.0, 0.0)}, {2: (1.0, 0.0)}, {})
    assert found.saturated_time == pytest.approx(4 * PERIOD)
    assert found.saturated_joint == JOINTS[2]


def test_channels_are_the_peaks_of_each_tick() -> None:
    made = log({1: (0.2, 0.1), 2: (-0.3, 0.0)}, {1: (1.0, 0.0), 2: (0.5, 0.5)}).channels()
    np.testing.assert_allclose(made["torque_use"], [0.3, 1.0], rtol=1e-12)
    np.testing.assert_allclose(made["speed_use"], [0.1, 0.5], rtol=1e-12)
    np.testing.assert_array_equal(made["saturated"], [0, 2])


def test_episode_agrees_with_its_trace() -> None:
    push = {"start": 0.1, "direction": 0.0, "delta_v": 0.3}
    result = run_episode(load("quiet", {"duration": 0.5, "pushes": [push]}), polygons=False)
    motors, trace = result.motors, result.trace
    assert motors is not None
    there = np.isfinite(trace["torque_use"])
    assert motors.peak_torque_use == trace["torque_use"][there].max() > 0.1
    assert motors.peak_speed_use == trace["speed_use"][there].max() > 0.0
    assert motors.saturated_time == pytest.approx(PERIOD * np.count_nonzero(trace["saturated"][there]))
    joint = JOINTS.index(motors.peak_torque_joint)
    assert motors.peak_torque == pytest.approx(motors.peak_torque_use * STALL[joint])


def test_pendulum_has_none() -> None:
    assert run_episode(load("quiet", {"duration": 0.05, "world": "pendulum"}), polygons=False).motors is None
