"""Geoms become the triangles that MuJoCo draws."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from models.arena import FLOOR, build_arena
from models.robot import load_robot
from sim.viewer.geoms import body_meshes
from tests.sim.viewer.browser import needs_viser

pytestmark = needs_viser

SHAPES = {
    "sphere": 'type="sphere" size=".1"',
    "ellipsoid": 'type="ellipsoid" size=".1 .2 .3"',
    "capsule": 'type="capsule" size=".1 .2"',
    "cylinder": 'type="cylinder" size=".1 .2"',
    "box": 'type="box" size=".1 .2 .3"',
    "mesh": 'type="mesh" mesh="wedge"',
}
WORLD = """<mujoco><asset><material name="red" rgba="1 0 0 1"/>
<mesh name="wedge" vertex="0 0 0  .3 0 0  0 .2 0  0 0 .1"/></asset><worldbody>
<body name="part" pos="1 2 3">{geoms}</body></worldbody></mujoco>"""


def compiled(*geoms: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(WORLD.format(geoms="".join(f"<geom {geom}/>" for geom in geoms)))


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_where_mujoco_has_it(shape: str) -> None:
    model = compiled(f'{SHAPES[shape]} pos="1 0 0" euler="0 0 90"')
    (mesh,) = body_meshes(model)
    assert model.body(mesh.body).name == "part"
    assert mesh.faces.max() < len(mesh.vertices)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[0])
    own = (mesh.vertices - model.geom_pos[0]) @ turn.reshape(3, 3)
    middle, half = model.geom_aabb[0, :3], model.geom_aabb[0, 3:]
    # What is round has its corners on the surface, so that its faces lie a little inside of it.
    np.testing.assert_allclose(own.min(axis=0), middle - half, atol=0.02 * half.max())
    np.testing.assert_allclose(own.max(axis=0), middle + half, atol=0.02 * half.max())


def test_what_mujoco_hides_is_hidden_and_colours_are_its_own() -> None:
    meshes = body_meshes(
        compiled(
            'type="box" size=".1 .1 .1" group="3"',
            'type="box" size=".1 .1 .1" rgba="0 0 0 0"',
            'type="box" size=".1 .1 .1" material="red" group="2"',
            'type="box" size=".1 .1 .1" material="red" rgba="0 1 0 .25"',
            'type="sphere" size=".1" material="red"',
        )
    )
    assert sorted(mesh.rgba for mesh in meshes) == [(0, 1, 0, 0.25), (1, 0, 0, 1), (1, 0, 0, 1)]


def test_robot_is_whole_and_the_floor_is_not_part_of_it() -> None:
    model = build_arena(load_robot("utmu2").path).compile()
    drawn = {mesh.body for mesh in body_meshes(model)}
    shown = model.geom_group < 3
    shown[model.geom(FLOOR).id] = False
    assert drawn == set(model.geom_bodyid[shown].tolist())
