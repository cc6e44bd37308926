"""The controller `onnx`: sizes, targets, gains, gait, and what it refuses, on networks of one layer."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controllers.interface import Observation, Setting
from controllers.learned.onnx_policy import OnnxPolicy
from models.errors import InputError
from models.robot import Robot, load_robot
from tests.controllers.learned.tiny_network import TAKES, write_network, write_recurrent
from tests.controllers.sight import seen

pytest.importorskip("onnxruntime", reason=TAKES)
pytest.importorskip("onnx", reason=TAKES)

COUNT = 20


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


def policy(robot: Robot, path: Path, **options: Any) -> OnnxPolicy:
    given = {"policy": str(path), "observation": ["command"]} | options
    return OnnxPolicy(Setting(robot=robot, dt=0.002), OnnxPolicy.Options.model_validate(given))


def standing(robot: Robot) -> Observation:
    view = seen((0.0, 0.05), (0.0, -0.05))
    return Observation(
        time=0.0, feet=view.feet, cog=view.cog, cog_velocity=view.cog_velocity, zmp=view.zmp,
        angular_momentum=view.angular_momentum, configuration=robot.stand, velocity=np.zeros(6 + COUNT),
    )  # fmt: skip


def test_the_target_is_the_pose_and_the_scaled_answer(robot: Robot, tmp_path: Path) -> None:
    # Answers (vx, 2 vx) to a command.
    path = write_network(tmp_path / "p.onnx", [[1, 0, 0], [2, 0, 0]])
    joints = [robot.joint_names[5], robot.joint_names[2]]
    one = policy(
        robot, path, command=[0.1, 0.0, 0.0], action_joints=joints, action_scale=[0.5, -1.0],
        default_pose={joints[0]: 0.25},
    )  # fmt: skip
    targets = one.targets(standing(robot))
    expected = robot.stand[7:].copy()
    expected[5] = 0.25 + 0.5 * 0.1
    expected[2] -= 0.2
    assert targets.position == pytest.approx(expected, abs=1e-7)  # of a float32
    assert not targets.velocity.any()
    assert not targets.torque.any()
    assert targets.stiffness is targets.damping is None
    assert one.last_action == pytest.approx([0.1, 0.2])
    assert policy(robot, path, command=[0.9, 0, 0], action_joints=joints, action_clip=1.0).targets(
        standing(robot)
    ).position[[5, 2]] == pytest.approx(robot.stand[7:][[5, 2]] + [0.9, 1.0])


def test_the_network_may_take_vectors_or_any_batch(robot: Robot, tmp_path: Path) -> None:
    for i, batch in enumerate((None, "n", 1)):
        path = write_network(tmp_path / f"{i}.onnx", np.ones((COUNT, 3)), batch=batch)
        targets = policy(robot, path, command=[0.1, 0.2, 0.3]).targets(standing(robot))
        assert targets.position - robot.stand[7:] == pytest.approx(np.full(COUNT, 0.6))


def test_gains_by_number_list_and_pattern(robot: Robot, tmp_path: Path) -> None:
    path, names = write_network(tmp_path / "p.onnx", np.zeros((COUNT, 3))), robot.joint_names
    knees = [i for i, name in enumerate(names) if "knee" in name]
    assert len(knees) == 2
    one = policy(robot, path, stiffness={"*knee*": 30, names[knees[1]]: 31}, damping=2.0)
    gains = one.targets(standing(robot))
    assert gains.stiffness is not None
    assert gains.stiffness[knees].tolist() == [30.0, 31.0]
    rest = np.delete(np.arange(COUNT), knees)
    assert np.array_equal(gains.stiffness[rest], robot.servo_stiffness[rest])
    assert gains.damping is not None
    assert gains.damping.tolist() == [2.0] * COUNT
    listed = policy(robot, path, action_joints=list(names[::-1]), stiffness=list(range(COUNT)))
    assert listed.targets(standing(robot)).stiffness == pytest.approx(np.arange(COUNT)[::-1])


def test_the_gait_runs_with_the_questions_and_may_be_held(robot: Robot, tmp_path: Path) -> None:
    path = write_network(tmp_path / "p.onnx", np.zeros((COUNT, 4)))
    gait: dict[str, Any] = {"frequency": 2.5, "offsets": [0.0, 1.0]}

    def inputs(**options: Any) -> list[np.ndarray]:
        one = policy(robot, path, observation=["phase"], period=0.1, **options)
        return [one.last_input for _ in range(3) if one.targets(standing(robot)) is not None]

    def angles(*pairs: tuple[float, float]) -> list[Any]:
        return [pytest.approx([*map(math.cos, pair), *map(math.sin, pair)], abs=1e-12) for pair in pairs]

    step = 2 * math.pi * 2.5 * 0.1
    running = angles((0, 1), (step, 1 + step), (2 * step, 1 + 2 * step))
    assert inputs(gait=gait) == running
    assert inputs(gait=gait | {"standing": 3.0}) == angles((3, 3), (3, 3), (3, 3))
    assert inputs(gait=gait | {"standing": 3.0}, command=[0.1, 0, 0]) == running


def test_a_reset_forgets_all(robot: Robot, tmp_path: Path) -> None:
    path = write_network(tmp_path / "p.onnx", np.eye(COUNT), 1.0)
    one = policy(robot, path, observation=[{"name": "last_action"}], action_scale=0.1)
    first = [one.targets(standing(robot)).position for _ in range(3)]
    assert first[2] - robot.stand[7:] == pytest.approx(np.full(COUNT, 0.3))
    one.reset(5)
    assert all(np.array_equal(a, one.targets(standing(robot)).position) for a in first)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"observation": ["command", "phase"], "gait": {"frequency": 1.0}},
         r"observation: the terms are 7 numbers, and 'p.onnx' takes 3: command 3, phase 4"),
        ({"observation": [{"name": "command", "history": 2}]}, r"takes 3: command 3 x 2"),
        ({"action_joints": ["left_kne"]}, r"action_joints: 'left_kne' is no joint of the robot; did you mean"),
        ({"default_pose": [0.0]}, r"default_pose: has 1 numbers; the action is of 20 joints"),
        ({"action_scale": {"left*": 1.0}}, "action_scale: gives none for"),
        ({"stiffness": -1.0}, r"stiffness: -1 is not allowed"),
        ({"stiffness": [1.0, 2.0]}, r"stiffness: has 2 numbers; the action is of 20 joints"),
        ({"stiffness": {"elbow": 1.0}}, r"stiffness: 'elbow' is no joint of the robot, nor a pattern of any"),
        ({"damping": {"left*": 1.0, "*knee*": 2.0}}, r"damping: both .* are patterns of"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_one_line(options: dict[str, Any], words: str, robot: Robot, tmp_path: Path) -> None:
    path = write_network(tmp_path / "p.onnx", np.zeros((COUNT, 3)))
    with pytest.raises(InputError, match=words) as caught:
        policy(robot, path, **options)
    assert "\n" not in str(caught.value)


def test_an_answer_of_another_size_is_one_line(robot: Robot, tmp_path: Path) -> None:
    path = write_network(tmp_path / "p.onnx", np.zeros((7, 3)))
    with pytest.raises(InputError, match=r"action_joints: are 20, and 'p.onnx' answers 7 numbers to 3: command 3"):
        policy(robot, path)


def test_without_the_extra_one_line_says_which(robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_network(tmp_path / "p.onnx", np.zeros((COUNT, 3)))
    monkeypatch.setitem(sys.modules, "onnxruntime", None)  # as Python has what cannot be imported
    with pytest.raises(InputError, match=r"controller.policy: needs onnxruntime; pip install 'okiagari\[onnx\]'"):
        policy(robot, path)


def test_files_that_are_no_such_network_are_one_line(robot: Robot, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'r.onnx' has 2 inputs, 'obs', 'state'; .* recurrent networks"):
        policy(robot, write_recurrent(tmp_path / "r.onnx"))
    broken = tmp_path / "broken.onnx"
    broken.write_text("no network")
    with pytest.raises(InputError, match=r"'broken.onnx' is no network that can be run: .+") as caught:
        policy(robot, broken)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="of shape"):
        policy(robot, write_network(tmp_path / "batch.onnx", np.zeros((COUNT, 3)), batch=4))
