"""What is read off a hand-written robot of another build is right, or as it is of the shipped one."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from controllers.stepping.step_policy import step_limits
from models.arena import build_arena, drawn_size
from models.robot import MODELS, load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode import EpisodeResult
from sim.episode.episode import run_episode
from tests.models.robot_files import TEXT, feet_apart, replaced, sized


def quiet_episode(path: Path, duration: float) -> EpisodeResult:
    push = {"start": 0.2, "direction": 0.0, "delta_v": 0.15}
    fields = load("quiet").as_dict() | {"duration": duration, "robot": str(path), "pushes": [push]}
    return run_episode(Scenario.model_validate(fields), polygons=False)


def test_a_file_without_sensors_gives_the_same_bits(tmp_path: Path) -> None:
    without = tmp_path / "mine.xml"
    without.write_text(re.sub(r"<sensor>.*</sensor>", "", TEXT, flags=re.S))
    assert "subtree" not in without.read_text()
    own, shipped = quiet_episode(without, 0.6), quiet_episode(MODELS / "utmu2.xml", 0.6)
    assert np.abs(own.trace["cog_vx"]).max() > 0.05
    np.testing.assert_array_equal(own.trace.values, shipped.trace.values)


def test_soles_as_near_to_each_other_as_allowed_are_stood_on(tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(feet_apart(0.0381))
    assert quiet_episode(path, 0.4).outcome.time_of_fall is None


def test_a_slow_neck_does_not_slow_the_legs_down(tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    slow = '<dcmotor nominal="24 1.3 9.95"'
    path.write_text(replaced((slow, slow.replace("9.95", "1"))))
    own, shipped = load_robot(str(path)), load_robot("utmu2")
    assert own.no_load_speed.min() == pytest.approx(1.0)
    assert step_limits(own, 0.2) == step_limits(shipped, 0.2)
    path.write_text(replaced(('nominal="24 6.0 9.95"', 'nominal="24 6.0 5"')))
    assert step_limits(load_robot(str(path)), 0.2).swing_speed < 0.6 * step_limits(shipped, 0.2).swing_speed


def test_a_foot_may_have_axes_of_its_own(tmp_path: Path) -> None:
    # The foot's x axis is down and its z axis forward; the sole is where it was.
    path, shipped = tmp_path / "mine.xml", load_robot("utmu2")
    spec = mujoco.MjSpec.from_file(str(MODELS / "utmu2.xml"))
    turn, quat = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]), np.zeros(4)
    mujoco.mju_mat2Quat(quat, turn.ravel())
    back = quat * [1, -1, -1, -1]
    foot = spec.body("left_foot")
    foot.quat = quat
    for part in (*foot.geoms, *foot.sites):
        part.pos, part.quat = turn.T @ part.pos, back
    for joint in foot.joints:
        joint.pos, joint.axis = turn.T @ joint.pos, turn.T @ joint.axis
    foot.ipos, foot.iquat = turn.T @ foot.ipos, back
    spec.compile()
    path.write_text(spec.to_xml())
    own = load_robot(str(path))
    assert own.sole_vertices["left"] == pytest.approx(shipped.sole_vertices["left"], abs=1e-6)
    assert own.sole_stance["left"] == pytest.approx(shipped.sole_stance["left"], abs=1e-6)
    assert own.leg_length == pytest.approx(shipped.leg_length, abs=1e-6)
    assert own.hip_reach == pytest.approx(shipped.hip_reach, abs=1e-6)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_cameras_stand_where_the_whole_robot_is_seen(scale: float, tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(sized(scale))
    model = build_arena(path, size=drawn_size(load_robot(str(path)).cog_height)).compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("stand").id)
    mujoco.mj_forward(model, data)
    places = data.geom_xpos[[i for i in range(model.ngeom) if model.geom(i).name != "floor"]]
    for name in ("three_quarter", "side", "front"):
        camera = model.camera(name).id
        seen = (places - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
        assert (np.abs(seen[:, 1] / seen[:, 2]) < np.tan(np.radians(model.cam_fovy[camera] / 2))).all()
