"""What a biped's file may say: the robot made of it is the same body."""

from __future__ import annotations

import io
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from models.adopt.adopt import Adopted, adopt
from models.arena import build_arena
from tests.models.adopt.biped_files import (
    BENT,
    COMPILER,
    FOOT,
    SHIN,
    TEXT,
    both,
    box_mesh,
    driven,
    feet_turned,
    hips_of_many_hinges,
    keyed,
    meshed,
    put,
    top,
    with_text,
    with_waist,
)

TORSO = 'mass="3"/>'
SOLE = (0.14, 0.08)
LEG = 0.455
SPHERES = "".join(
    f'<geom type="sphere" size="0.01" pos="{x} {y} -0.035" mass="0.075"/>' for x in (-0.05, 0.07) for y in (-0.03, 0.03)
)
CAPSULES = "".join(
    f'<geom type="capsule" size="0.01" fromto="-.05 {y} -.035 .07 {y} -.035" mass="0.1"/>' for y in (-0.03, 0, 0.03)
)
DEFAULTS = TEXT[TEXT.index("  <default>") : TEXT.index("  <worldbody>")]
MESH = {"m/f.stl": box_mesh((0.07, 0.04, 0.01), (0.01, 0, -0.035))}


def in_radians(text: str) -> str:
    def scaled(match: re.Match[str]) -> str:
        return f'range="{np.radians(float(match[1]))!r} {np.radians(float(match[2]))!r}"'.replace("np.float64", "")

    return re.sub(r'\brange="(\S+) (\S+)"', scaled, text).replace("(", "").replace(")", "")


def picture() -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (8, 8)).save(file, "png")
    return file.getvalue()


# text, files beside it, robot.toml, size of the soles, what the report says
TAKEN: dict[str, tuple[str, dict[str, bytes], str, tuple[float, float], str]] = {
    "as it is": (TEXT, {}, "", SOLE, "the world's own geoms, 1, were left out"),
    "feet of spheres": (with_text((FOOT, SPHERES)), {}, "", (0.12, 0.06), ""),
    "feet of capsules": (with_text((FOOT, CAPSULES)), {}, "", (0.12, 0.07), ""),
    "feet of cylinders": (
        with_text((FOOT, '<geom type="cylinder" size="0.05 0.01" pos="0.01 0 -0.035" mass="0.3"/>')),
        {},
        "",
        (0.067, 0.067),
        "",
    ),
    "feet of meshes": (meshed('meshdir="m"', '<mesh file="f.stl"/>'), MESH, "", SOLE, ""),
    "strippath": (meshed('meshdir="m" strippath="true"', '<mesh file="x/y/f.stl"/>'), MESH, "", SOLE, ""),
    "assetdir": (meshed('assetdir="m"', '<mesh name="f" file="f.stl" scale="1 1 1"/>'), MESH, "", SOLE, ""),
    "two meshes of one name": (
        meshed('meshdir="m"', '<mesh name="f" file="f.stl"/><mesh name="g" file="n/f.stl"/>').replace(
            SHIN, f'{SHIN}<geom type="mesh" mesh="g" contype="0" conaffinity="0" mass="0"/>'
        ),
        MESH | {"m/n/f.stl": box_mesh((0.01, 0.01, 0.01))},
        "",
        SOLE,
        "",
    ),
    "textures": (
        top(
            '<compiler texturedir="t"/><asset><texture name="t" type="2d" file="t.png"/>'
            '<material name="m" texture="t"/><texture name="cube" type="cube" fileright="t.png" fileleft="t.png" '
            'fileup="t.png" filedown="t.png" filefront="t.png" fileback="t.png"/></asset>'
        ).replace(TORSO, 'mass="3" material="m"/>'),
        {"t/t.png": picture()},
        "",
        SOLE,
        "",
    ),
    "a material called floor": (
        top(
            '<asset><texture name="floor" type="2d" builtin="checker" width="8" height="8"/>'
            '<texture name="sky" type="skybox" builtin="gradient" width="8" height="8"/>'
            '<material name="floor" texture="floor"/></asset>'
        ).replace(TORSO, 'mass="3" material="floor"/>'),
        {},
        "",
        SOLE,
        "",
    ),
    "feet whose axes are turned": (feet_turned(), {}, "", SOLE, ""),
    "feet tilted at home": (
        both('<body name="SIDE_foot">', '<body name="SIDE_foot" euler="0 12 0">'),
        {},
        "",
        SOLE,
        "",
    ),
    "feet of spheres tilted at home": (
        both('<body name="SIDE_foot">', '<body name="SIDE_foot" euler="0 -9 0">').replace(FOOT, SPHERES),
        {},
        "",
        (0.12, 0.06),
        "",
    ),
    "toes beside the sole": (
        with_text((FOOT, f'{FOOT}<geom type="box" size="0.03 0.03 0.01" pos="0.11 0 -0.035" mass="0"/>')),
        {},
        "",
        (0.2, 0.06),
        "",
    ),
    "a bead under the sole": (
        with_text((FOOT, f'{FOOT}<geom type="sphere" size="0.01" pos="0 0 -0.04" mass="0"/>')),
        {},
        "",
        SOLE,
        "5.0 cm below the foot's joint",
    ),
    "a soft skin": (with_text(("<default>", '<default><geom margin="0.01" priority="2"/>')), {}, "", SOLE, ""),
    "a keyframe": (keyed(BENT), {}, "", SOLE, ""),
    "a keyframe that lies": (keyed(BENT.replace("1 0 0 0", ".7 0 .7 0", 1)), {}, "", SOLE, ""),
    "a keyframe elsewhere": (keyed(BENT.replace("0 0", "3 2", 1)), {}, 'stand = "keyframe"', SOLE, "as at home"),
    "no free joint": (with_text(('<freejoint name="float"/>', "")), {}, "", SOLE, "was fixed to the world"),
    "no gravity": (top('<option gravity="0 0 0"/>'), {}, "", SOLE, "gravity was [0, 0, 0]"),
    "tilted gravity": (top('<option gravity="0 1 -9"/>'), {}, "", SOLE, "gravity was [0, 1, -9]"),
    "flags": (top('<option><flag contact="disable" sensor="disable"/></option>'), {}, "", SOLE, "flags of <option>"),
    "no ranges": (with_text(('range="-45 45" ', "")), {}, "", SOLE, "joints without a range got -pi to pi: left_yaw"),
    "radians": (in_radians(TEXT.replace("degree", "radian")), {}, "", SOLE, ""),
    "no compiler": (with_text((COMPILER, "")), {}, "", SOLE, ""),
    "three hinges in a body": (hips_of_many_hinges(apart=False), {}, "", SOLE, ""),
    "a waist above both legs": (with_waist(), {}, "", SOLE, "right_shoulder"),
    "a slide taken out": (
        both('name="SIDE_shoulder" axis', 'name="SIDE_shoulder" type="slide" axis'),
        {},
        'weld = ["*_shoulder"]',
        SOLE,
        "welded, as asked: left_shoulder, right_shoulder",
    ),
    "position servos": (driven('<position joint="J" kp="100" forcerange="-12 12"/>'), {}, "", SOLE, ""),
    "a motor of the root": (
        with_text(("</actuator>", '<motor joint="float" ctrlrange="0 1"/></actuator>')),
        {},
        "",
        SOLE,
        "actuator 14, which has no name, pushes the floating root",
    ),
    "names that are ours": (
        with_text(
            ('"left_arm"', '"trunk"'),
            ('"left_hip"', '"left_sole"'),
            ('"left_yaw"', '"left_sole"'),
            ('"right_yaw"', '"root_joint"'),
            ('"torso"', '"right_sole"'),
            (TORSO, 'mass="3" name="floor"/><site name="trunk"/><camera name="side"/><light name="sun"/>'),
        ),
        {},
        "",
        SOLE,
        "the joint 'root_joint' is called 'root_joint_of_file' now",
    ),
    "names of all sorts": (with_text(('"left_knee"', '"left knee|π &lt;x&gt;"')), {}, "", SOLE, "left knee\\|π <x>"),
    "no names": (
        re.sub(r'<(body|freejoint|joint) name="\w+"', r"<\1", driven("")),
        {},
        '[motors."*"]\ntorque = 12',
        SOLE,
        "",
    ),
    "includes": (
        TEXT.replace(DEFAULTS, '<include file="p/d.xml"/>'),
        {"p/d.xml": f"<mujoco>{DEFAULTS}</mujoco>".encode()},
        "",
        SOLE,
        "",
    ),
    "classes": (
        with_text(
            ("<default>", '<default><default class="leg"><joint armature="0.01" ref="10"/></default>'),
            ('<body name="left_hip"', '<body childclass="leg" name="left_hip"'),
        ),
        {},
        "",
        SOLE,
        "angles are counted from the drawn pose, not from ref: left_yaw",
    ),
    "inertia from geoms": (with_text(('"degree"', '"degree" inertiafromgeom="true"')), {}, "", SOLE, ""),
    "a given mass": (with_text(('"degree"', '"degree" settotalmass="20"')), {}, "", SOLE, "| mass | 20.00 kg |"),
    "frames without mass": (
        with_text((FOOT, f'{FOOT}<body pos="0 0 0.01"><site/></body>'), ('"degree"', '"degree" fusestatic="true"')),
        {},
        "",
        SOLE,
        "",
    ),
    "the sole in a body of its own": (with_text((FOOT, f'<body pos="0.01 0 0">{FOOT}</body>')), {}, "", SOLE, ""),
    "springs": (with_text(("<joint range", '<joint stiffness="1" range')), {}, "", SOLE, "springs were left in"),
    "weightless arm": (
        with_text(('<body name="left_arm"', '<body gravcomp="1" name="left_arm"')),
        {},
        "",
        SOLE,
        "gravcomp",
    ),
    "custom data": (
        top('<custom><tuple name="t"><element objtype="body" objname="torso"/></tuple></custom>'),
        {},
        "",
        SOLE,
        "",
    ),
    "a table": (
        with_text(("</worldbody>", '<body name="table" pos="1 0 0"><geom size="0.1"/></body></worldbody>')),
        {},
        "",
        SOLE,
        "the body 'table', which stands still, was left out",
    ),
    "nothing solid": (
        with_text(("<default>", '<default><geom contype="0" conaffinity="0"/>')),
        {},
        "",
        SOLE,
        "no geom can touch anything",
    ),
    "facing backward": (
        re.sub(r'(pos|axis)="(\S+) (\S+) (\S+)"', lambda m: f'{m[1]}="{-float(m[2])} {-float(m[3])} {m[4]}"', TEXT),
        {},
        "",
        SOLE,
        "does the robot face along x?",
    ),
}


def mass_matrix(model: mujoco.MjModel, root: int) -> np.ndarray:
    """Of all hinges, and the mass and the place of the COG, in some pose."""
    data = mujoco.MjData(model)
    hinges = model.nq - 7
    data.qpos[7:] = model.qpos0[7:] + 0.3 * np.sin(np.arange(hinges))
    data.qpos[:7] = [0, 0, 1, 1, 0, 0, 0]
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return np.concatenate([mass[6:, 6:].ravel(), [model.body_subtreemass[root]], data.subtree_com[root]])


@pytest.mark.parametrize("what", TAKEN)
def test_a_biped_is_taken_with_the_same_inertia(what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text, files, hints, sole, words = TAKEN[what]
    path = put(tmp_path / "in", text, files, hints)
    done: Adopted = adopt(path, tmp_path / "out")
    robot = done.robot
    assert (robot.sole_length, robot.sole_width) == pytest.approx(sole, abs=2e-3)
    lower = {"a bead under the sole": 0.005, "three hinges in a body": -0.03}
    assert robot.leg_length == pytest.approx(LEG + lower.get(what, 0.0), abs=2e-3)
    assert words in done.report
    assert done.report == (tmp_path / "out" / "ADOPTED.md").read_text(encoding="utf-8")
    assert robot.path == tmp_path / "out" / "small.xml"
    assert np.mean([robot.sole_stance[side][:2] for side in ("left", "right")], axis=0) == pytest.approx(
        [0, 0], abs=1e-3
    )
    # MuJoCo does not speak for itself.
    assert capfd.readouterr() == ("", "")
    if any(word in what for word in ("free joint", "slide", "given mass")):
        return
    before, after = mujoco.MjModel.from_xml_path(str(path)), build_arena(robot.path).compile()
    # The file has six digits.
    assert mass_matrix(after, 1) == pytest.approx(mass_matrix(before, 1), rel=1e-4, abs=1e-6)
