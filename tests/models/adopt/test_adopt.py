"""Adopted bipeds stand, are the same body for MuJoCo and placo, and are written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from controllers.whole_body.placo_model import PlacoModel
from models.adopt.adopt import adopt
from models.arena import SIDES, build_arena
from models.errors import InputError
from models.robot import Robot
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from tests.models.adopt.biped_files import (
    FOOT,
    TEXT,
    driven,
    feet_turned,
    hips_of_many_hinges,
    keyed,
    put,
    top,
    with_text,
    with_waist,
    write,
)

SAME = 1e-9


def adopted(folder: Path, text: str, hints: str = "") -> Robot:
    return adopt(put(folder / "in", text, hints=hints), folder / "out").robot


@pytest.mark.parametrize(
    "text",
    [TEXT, feet_turned(), with_waist(), hips_of_many_hinges(apart=True), top('<option gravity="0 0 -1.62"/>')],
    ids=["as it is", "feet turned", "waist", "hips of three hinges", "moon"],
)
def test_it_stands(text: str, tmp_path: Path) -> None:
    robot = adopted(tmp_path, text)
    fields = {"description": "nobody pushes", "world": "humanoid", "robot": str(robot.path), "duration": 1.5}
    outcome = run_episode(Scenario.model_validate(fields), polygons=False).outcome
    assert outcome.time_of_fall is None


@pytest.mark.parametrize(
    "text",
    [hips_of_many_hinges(apart=False), hips_of_many_hinges(apart=True), with_waist(), feet_turned()],
    ids=["hips of three hinges", "their axes apart", "waist", "feet turned"],
)
def test_mujoco_and_placo_agree(text: str, tmp_path: Path) -> None:
    robot = adopted(tmp_path, text)
    model, placo_model = build_arena(robot.path).compile(), PlacoModel(robot)
    data, wrapper, rng = mujoco.MjData(model), placo_model.wrapper, np.random.default_rng(3)
    for _ in range(5):
        quaternion = rng.normal(size=4)
        base = [*rng.normal(size=3), *(quaternion / np.linalg.norm(quaternion))]
        data.qpos[:], data.qvel[:] = [*base, *rng.uniform(*robot.joint_range.T)], rng.normal(size=model.nv)
        mujoco.mj_forward(model, data)
        placo_model.set_state(data.qpos, data.qvel)
        assert wrapper.total_mass() == pytest.approx(robot.mass, abs=SAME)
        assert wrapper.com_world() == pytest.approx(data.subtree_com[1], abs=SAME)
        for side in SIDES:
            assert wrapper.get_T_world_frame(f"{side}_sole")[:3, 3] == pytest.approx(
                data.site(f"{side}_sole").xpos, abs=SAME
            )
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        assert wrapper.mass_matrix()[6:, 6:] == pytest.approx(mass[6:, 6:], abs=SAME)
        mujoco.mj_subtreeVel(model, data)
        assert wrapper.com_jacobian() @ wrapper.state.qd == pytest.approx(data.subtree_linvel[1], abs=SAME)


def test_a_waist_that_both_legs_hang_on_is_a_posture_joint(tmp_path: Path) -> None:
    robot = adopted(tmp_path, with_waist())
    assert len(robot.leg_joints) == 12
    assert "waist" in set(robot.joint_names) - robot.leg_joints


def test_a_leg_is_measured_between_the_hinges_wherever_their_bodies_begin(tmp_path: Path) -> None:
    # The ankles turn 2 cm above where their bodies begin: the shins are that much longer, the soles as far below.
    moved = with_text(
        ('<joint name="left_ankle_pitch"', '<joint pos="0 0 0.02" name="left_ankle_pitch"'),
        ('<joint name="left_ankle_roll"', '<joint pos="0 0 0.02" name="left_ankle_roll"'),
        ('<body name="left_ankle" pos="0 0 -0.18">', '<body name="left_ankle" pos="0 0 -0.20">'),
        ('pos="0.01 0 -0.035"', 'pos="0.01 0 -0.015"'),
    ).replace('<body name="right_ankle" pos="0 0 -0.18">', '<body name="right_ankle" pos="0 0 -0.20">')
    assert adopted(tmp_path / "a", moved).leg_length == pytest.approx(adopted(tmp_path / "b", TEXT).leg_length)


@pytest.mark.parametrize(
    ("element", "hints", "torque", "speed", "gains"),
    [
        ('<motor joint="J" ctrlrange="-12 12"/>', "", 12, 20, (240, None)),
        ('<motor joint="J" gear="-50" ctrlrange="-0.5 0.5"/>', "", 25, 20, (500, None)),
        ('<motor joint="J" ctrlrange="-12 12"/>', "speed = 9", 12, 9, (240, None)),
        ('<motor jointinparent="J" ctrlrange="-12 12" forcerange="-8 8"/>', "", 8, 20, (160, None)),
        ('<position joint="J" kp="100" kv="3" forcerange="-9 9" gear="2"/>', 'servos = "file"', 18, 20, (400, 12)),
        (
            '<general joint="J" gainprm="50" biastype="affine" biasprm="0 -50" ctrlrange="-1 1" forcerange="-7 7"/>',
            "",
            7,
            20,
            (140, None),
        ),
        ('<velocity joint="J" kv="3" forcerange="-9 9"/>', "", 9, 20, (180, None)),
        (
            '<dcmotor joint="J" nominal="24 12 10" saturation="9" controller="200 0 2 0 0 24" input="pos vel ff"/>',
            'servos = "file"',
            9,
            10,
            (200, 2),
        ),
        (
            '<motor joint="J" ctrlrange="-12 12"/>',
            '[motors."*"]\ntorque = 5\nspeed = 7\n[motors."*_knee"]\nspeed = 8\nstiffness = 300\nservo_damping = 4',
            5,
            8,
            (300, 4),
        ),
    ],
)  # fmt: skip
def test_a_motor_is_what_the_file_and_the_hints_say(
    element: str, hints: str, torque: float, speed: float, gains: tuple[float, float | None], tmp_path: Path
) -> None:
    robot = adopted(tmp_path, driven(element), hints)
    knee = robot.joint_names.index("left_knee")
    # The file has six digits.
    assert robot.stall_torque[knee] == pytest.approx(torque, rel=1e-5)
    assert robot.no_load_speed[knee] == pytest.approx(speed, rel=1e-5)
    assert robot.servo_stiffness[knee] == pytest.approx(gains[0], rel=1e-5)
    if gains[1] is not None:
        assert robot.servo_damping[knee] == pytest.approx(gains[1], rel=1e-5)
    # What the file's own class says of motors does not cut what ours is told.
    assert not build_arena(robot.path).compile().actuator_ctrllimited.any()


def test_a_damping_that_eats_all_torque_is_back_emf_but_not_twice(tmp_path: Path) -> None:
    text = with_text(('damping="0.1"', 'damping="1.2"'))
    told, itself = adopted(tmp_path / "a", text, '[motors."*"]\ndamping = 1.2'), adopted(tmp_path / "b", text)
    assert (told.no_load_speed[0], told.joint_damping[0]) == pytest.approx((20.0, 1.2))
    assert (itself.no_load_speed[0], itself.joint_damping[0]) == pytest.approx((10.0, 0.0))


def test_the_stand_is_as_deep_as_asked_and_the_ranges_allow(tmp_path: Path) -> None:
    heights = [adopted(tmp_path / str(bend), TEXT, f"bend = {bend}").cog_height for bend in (0.75, 0.85)]
    assert heights == sorted(heights)
    stiff = with_text(("-80 60", "-25 60"))
    robot = adopt(put(tmp_path / "stiff", stiff), tmp_path / "out")
    assert "the ranges of the joints allow no stand at 0.85 of a straight leg; it is at 0." in robot.report
    names = [f"{side}_ankle_pitch" for side in SIDES]
    places = [7 + robot.robot.joint_names.index(name) for name in names]
    assert robot.robot.stand[places] == pytest.approx(np.radians([-25, -25]), abs=np.radians(5))


def test_hints_name_feet_and_keyframe(tmp_path: Path) -> None:
    # By its lowest geoms, this robot would stand on its hands.
    cane = with_text(('fromto="0 0 0 0 0 -0.15"', 'fromto="0 0 0 0 0 -0.7"'))
    with pytest.raises(InputError, match="the feet 'left_arm' and 'right_arm' have"):
        adopted(tmp_path / "a", cane)
    said = 'left_foot = "left_foot"\nright_foot = "right_foot"\nkeyframe = "up"\nname = "cane"'
    up = keyed("0 0 .5 1 0 0 0 0 0 -.4 .8 -.4 0 0 0 -.4 .8 -.4 0 -.78 -.78", "up")
    short = up.replace('fromto="0 0 0 0 0 -0.15"', 'fromto="0 0 0 0 0 -0.3"')
    assert adopted(tmp_path / "b", short, said).path.name == "cane.xml"


def test_legs_touch_each_other_unless_asked_not_to(tmp_path: Path) -> None:
    for hints, touch in (("", True), ("legs_collide = false", False)):
        model = build_arena(adopted(tmp_path / str(touch), TEXT, hints).path).compile()
        left, right = model.geom("left_sole"), model.geom("right_sole")
        assert bool(left.contype[0] & right.conaffinity[0]) is touch


def test_adopted_twice_is_the_same(tmp_path: Path) -> None:
    one, two = (adopted(tmp_path / each, TEXT).path for each in "ab")
    assert one.read_bytes() == two.read_bytes()


def test_an_adopted_robot_can_be_adopted(tmp_path: Path) -> None:
    one = adopted(tmp_path, TEXT)
    two = adopt(one.path, tmp_path / "again").robot
    assert two.leg_length == pytest.approx(one.leg_length)
    assert two.stall_torque == pytest.approx(one.stall_torque)
    assert two.no_load_speed == pytest.approx(one.no_load_speed)


@pytest.mark.parametrize("wrong", [KeyboardInterrupt, ZeroDivisionError])
def test_who_is_interrupted_leaves_nothing(wrong: type[BaseException], tmp_path: Path) -> None:
    path = write(tmp_path / "in")

    def trial(robot: Path) -> str:
        assert robot.is_file()
        raise wrong

    with pytest.raises(wrong):
        adopt(path, tmp_path / "deep" / "out", trial=trial)
    assert [each.name for each in tmp_path.iterdir()] == ["in"]


def test_a_folder_that_holds_something_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    adopt(write(tmp_path / "in"), tmp_path / "out")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match="exists and is not an empty folder"):
        adopt(tmp_path / "in" / "small.xml", tmp_path / "out")
    assert sorted(tmp_path.rglob("*")) == before
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="file"):
        adopt(tmp_path / "in" / "small.xml", tmp_path / "file" / "out")
    assert (tmp_path / "file").read_text() == "mine"


def test_progress_goes_from_nothing_to_all(tmp_path: Path) -> None:
    seen: list[float] = []
    adopt(write(tmp_path / "in", with_text((FOOT, FOOT))), tmp_path / "out", progress=seen.append)
    assert seen == sorted(seen)
    assert len(seen) > 10
    assert seen[0] < 0.5
    assert seen[-1] == 1.0
