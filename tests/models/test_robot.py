"""The robot file: its facts, its conventions, and one description for two libraries."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from models.adopt.catalogue import KNOWN
from models.arena import SIDES, build_arena
from models.errors import InputError
from models.robot import Robot, load_robot, robot_path


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


@pytest.fixture(scope="module")
def model(robot: Robot) -> mujoco.MjModel:
    return build_arena(robot.path).compile()


def test_the_facts_of_the_sibling_robot(robot: Robot, model: mujoco.MjModel) -> None:
    masses = {model.body(i).name: float(model.body_mass[i]) for i in range(1, model.nbody)}
    legs = ("hip", "thigh", "shin", "ankle", "foot")
    assert robot.mass == pytest.approx(5.531)
    assert masses["trunk"] == pytest.approx(2.245)
    for side in SIDES:
        own = {name: mass for name, mass in masses.items() if name.startswith(side)}
        leg = sum(mass for name, mass in own.items() if any(part in name for part in legs))
        assert leg == pytest.approx(1.217)
        assert sum(own.values()) - leg == pytest.approx(0.426)
    assert len(robot.joint_names) == 20
    assert len(robot.leg_joints) == 12
    assert robot.stance_width == pytest.approx(0.084, abs=1e-6)
    assert robot.sole_vertices["left"].max(axis=0) - robot.sole_vertices["left"].min(axis=0) == pytest.approx(
        [0.099, 0.072]
    )
    assert robot.leg_length == pytest.approx(0.141 + 0.113 + 0.0577)
    assert robot.cog_height == pytest.approx(0.26, abs=1e-6)  # the keyframe is written with nine digits


def test_the_cog_is_where_the_sibling_has_it_with_straight_legs(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    height = data.subtree_com[model.body("trunk").id][2] - data.site("left_sole").xpos[2]
    # The trunk's COM is given in the file to a tenth of a millimetre.
    assert height == pytest.approx(0.293, abs=1e-4)


def test_the_stand_is_level_and_centred(robot: Robot, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    for side in SIDES:
        site = data.site(f"{side}_sole")
        assert site.xpos[2] == pytest.approx(0.0, abs=1e-6)
        assert site.xmat.reshape(3, 3)[2, 2] == pytest.approx(1.0)
    middle = 0.5 * (data.site("left_sole").xpos + data.site("right_sole").xpos)
    assert data.subtree_com[1][:2] == pytest.approx(middle[:2], abs=1e-6)


def test_every_part_is_named(model: mujoco.MjModel) -> None:
    for count, part in (
        (model.nbody, model.body),
        (model.njnt, model.joint),
        (model.nsite, model.site),
        (model.ngeom, model.geom),
        (model.nsensor, model.sensor),
        (model.nkey, model.key),
        (len(model.actuator_trnid), model.actuator),
    ):
        assert all(part(i).name for i in range(count))


def test_every_link_can_touch_the_floor_and_the_legs_each_other(model: mujoco.MjModel) -> None:
    def collide(a: int, b: int) -> bool:
        return bool(
            model.geom_contype[a] & model.geom_conaffinity[b] or model.geom_contype[b] & model.geom_conaffinity[a]
        )

    floor = model.geom("floor").id
    bodies = set(range(1, model.nbody))
    assert {int(model.geom_bodyid[g]) for g in range(model.ngeom) if collide(g, floor)} == bodies
    assert collide(model.geom("left_sole").id, model.geom("right_sole").id)
    assert collide(model.geom("left_shin").id, model.geom("right_thigh").id)
    assert not collide(model.geom("left_shin").id, model.geom("left_sole").id)


def test_motors_follow_their_torque_speed_line(robot: Robot, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    knee = robot.joint_names.index("left_knee")
    stall, top = robot.stall_torque[knee], robot.no_load_speed[knee]
    for share in (0.0, 0.25, 0.5, 0.9, 1.0):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.qvel[6 + knee] = share * top
        data.ctrl[3 * knee : 3 * knee + 3] = data.qpos[7 + knee], data.qvel[6 + knee], 100.0
        mujoco.mj_forward(model, data)
        assert data.actuator_force[knee] == pytest.approx((1.0 - share) * stall, abs=1e-9)
        data.ctrl[3 * knee + 2] = -100.0  # braking: all of the stall torque, and no more
        mujoco.mj_forward(model, data)
        assert data.actuator_force[knee] == pytest.approx(-stall)


def test_servo_gains_fit_the_reflected_inertia(model: mujoco.MjModel) -> None:
    for i in range(len(model.actuator_trnid)):
        kp, kd = model.actuator_gainprm[i, 4], model.actuator_gainprm[i, 6]
        armature = model.dof_armature[model.joint(int(model.actuator_trnid[i, 0])).dofadr[0]]
        damping_ratio = kd / (2.0 * np.sqrt(kp * armature))
        # 0.7 with the inertia of rotor and link; the rotor alone is a third to all of that.
        assert 0.7 <= damping_ratio <= 1.5


def test_arms_swing_forward_and_back_at_shoulder_and_elbow(robot: Robot) -> None:
    assert robot.limb_swings == {f"{side}_{joint}" for side in SIDES for joint in ("shoulder_pitch", "elbow")}


@pytest.mark.parametrize("name", ["utmu3", "nowhere.xml"])
def test_unknown_robots_are_refused_by_name(name: str) -> None:
    with pytest.raises(InputError, match=name):
        robot_path(name)


def test_a_robot_without_the_conventions_is_refused(tmp_path) -> None:
    path = tmp_path / "ball.xml"
    path.write_text(
        "<mujoco><worldbody><body name='trunk'><freejoint name='root_joint'/>"
        "<geom name='left_sole' size='.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(InputError, match=r"ball\.xml") as refusal:
        load_robot(str(path))
    assert "\n" not in str(refusal.value)


def test_the_imu_is_at_the_trunk_s_site_or_at_its_origin(robot: Robot, tmp_path) -> None:
    np.testing.assert_array_equal(robot.imu, [0.0, 0.0, 0.03])
    lines = robot.path.read_text(encoding="utf-8").splitlines()
    bare = [line for line in lines if 'name="imu"' not in line and 'site="imu"' not in line]
    assert len(bare) == len(lines) - 3
    path = tmp_path / "bare.xml"
    path.write_text("\n".join(bare), encoding="utf-8")
    np.testing.assert_array_equal(load_robot(str(path)).imu, np.zeros(3))


def test_names_are_told_when_one_is_wrong() -> None:
    with pytest.raises(InputError, match="did you mean 'op3'") as refusal:
        robot_path("op4")
    assert all(name in str(refusal.value) for name in KNOWN)
