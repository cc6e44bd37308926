"""MuJoCo and placo read the same robot from the same file."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from controllers.whole_body.placo_model import PlacoModel
from models.arena import SIDES, build_arena
from models.robot import Robot, load_robot

# Both libraries compute in double precision on numbers of order 1.
SAME = 1e-9


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("utmu2")


@pytest.fixture(scope="module")
def placo_model(robot: Robot) -> PlacoModel:
    return PlacoModel(robot)


@pytest.fixture(scope="module")
def model(robot: Robot) -> mujoco.MjModel:
    return build_arena(robot.path).compile()


@pytest.mark.parametrize("seed", range(20))
def test_random_poses_agree(seed: int, robot: Robot, placo_model: PlacoModel, model: mujoco.MjModel) -> None:
    rng = np.random.default_rng(seed)
    data = mujoco.MjData(model)
    quaternion = rng.normal(size=4)
    data.qpos[:] = np.concatenate(
        [rng.normal(size=3), quaternion / np.linalg.norm(quaternion), rng.uniform(*robot.joint_range.T)]
    )
    data.qvel[:] = rng.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    placo_model.set_state(data.qpos, data.qvel)
    wrapper = placo_model.wrapper

    assert wrapper.total_mass() == pytest.approx(robot.mass, abs=SAME)
    assert wrapper.com_world() == pytest.approx(data.subtree_com[1], abs=SAME)
    for side in SIDES:
        pose = wrapper.get_T_world_frame(f"{side}_sole")
        assert pose[:3, 3] == pytest.approx(data.site(f"{side}_sole").xpos, abs=SAME)
        assert pose[:3, :3].ravel() == pytest.approx(data.site(f"{side}_sole").xmat, abs=SAME)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    assert wrapper.mass_matrix()[6:, 6:] == pytest.approx(mass[6:, 6:], abs=SAME)
    # The velocity is taken over in the right frame: so is the momentum's centre.
    velocity = wrapper.com_jacobian() @ wrapper.state.qd
    mujoco.mj_subtreeVel(model, data)
    assert velocity == pytest.approx(data.subtree_linvel[1], abs=SAME)
