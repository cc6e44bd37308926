"""The kinematics that estimators use against MuJoCo's."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from controllers.whole_body.measured_body import MeasuredBody
from models.arena import SIDES, build_arena
from models.robot import TRUNK, load_robot

# Two libraries sum in different orders; what they compute is of the order of one.
ROUNDING = 1e-9


@pytest.fixture(scope="module")
def body() -> MeasuredBody:
    return MeasuredBody(load_robot("utmu2"))


def state(seed: int) -> tuple[mujoco.MjModel, mujoco.MjData, np.ndarray, np.ndarray]:
    robot = load_robot("utmu2")
    model = build_arena(robot.path).compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    data.qpos[:] = robot.stand
    data.qpos[:3] += rng.normal(size=3)
    data.qpos[3:7] = rng.normal(size=4)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qpos[7:] += rng.normal(0.0, 0.4, 20)
    data.qvel[:] = rng.normal(0.0, 2.0, 26)
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    return model, data, data.qpos.copy(), data.qvel.copy()


@pytest.mark.parametrize("seed", range(5))
def test_cog_momentum_and_soles(body: MeasuredBody, seed: int) -> None:
    model, data, configuration, velocity = state(seed)
    trunk = model.body(TRUNK).id
    body.place(configuration, velocity)
    np.testing.assert_allclose(body.cog, data.subtree_com[trunk], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(body.cog_velocity, data.subtree_linvel[trunk], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(body.angular_momentum, data.subtree_angmom[trunk], rtol=0, atol=ROUNDING)
    body.by_joints(configuration[7:], velocity[6:])  # which leaves what was placed as it is
    np.testing.assert_allclose(body.trunk_com, data.xipos[trunk], rtol=0, atol=ROUNDING)
    for i, side in enumerate(SIDES):
        site, sole = data.site(f"{side}_sole"), body.soles[i]
        np.testing.assert_allclose(body.sole_places[i], site.xpos, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(sole["R"].ravel(), site.xmat, rtol=0, atol=ROUNDING)
        assert_moves(model, data, f"{side}_sole", sole)
        assert body.yaw(i) == pytest.approx(np.arctan2(site.xmat[3], site.xmat[0]), abs=ROUNDING)


@pytest.mark.parametrize("seed", range(5))
def test_soles_as_the_joints_move_them(body: MeasuredBody, seed: int) -> None:
    model, data, configuration, velocity = state(seed)
    data.qpos[:7] = 0, 0, 0, 1, 0, 0, 0
    data.qvel[:6] = 0
    mujoco.mj_forward(model, data)
    soles = body.by_joints(configuration[7:], velocity[6:])
    for side, sole in zip(SIDES, soles, strict=True):
        site = data.site(f"{side}_sole")
        np.testing.assert_allclose(sole["p"], site.xpos, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(sole["R"].ravel(), site.xmat, rtol=0, atol=ROUNDING)
        assert_moves(model, data, f"{side}_sole", sole)


def assert_moves(model: mujoco.MjModel, data: mujoco.MjData, site: str, sole: np.ndarray) -> None:
    twist = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, data.site(site).id, twist, 0)
    np.testing.assert_allclose(sole["w"], twist[:3], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(sole["v"], twist[3:], rtol=0, atol=ROUNDING)
