"""A robot's file that nobody can stand in is refused in one line that names it, and says what is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from models.errors import InputError
from models.robot import load_robot
from tests.models.robot_files import (
    SOLE,
    TEXT,
    base_under_the_trunk,
    feet_apart,
    heavier,
    optioned,
    replaced,
    sized,
    three_actuators,
)

NAMED_HEEL = 'name="heel" '
HEEL = f'<geom {NAMED_HEEL}type="sphere" size="0.01" pos="-0.02 0 -0.0477"/>'
THICK = '<geom type="sphere" size="0.08"/>'

WRONG = {
    "no gravity": (optioned('<option gravity="0 0 0"/>'), "gravity is [0.0, 0.0, 0.0]; it must be straight down"),
    "gravity upward": (optioned('<option gravity="0 0 9.81"/>'), "gravity is [0.0, 0.0, 9.81]; it must be"),
    "gravity tilted": (optioned('<option gravity="1 0 -9.81"/>'), "gravity is [1.0, 0.0, -9.81]; it must be"),
    "gravity off": (optioned('<option><flag gravity="disable"/></option>'), '<flag gravity="disable"/> is not allowed'),
    "motors off": (optioned('<option><flag actuation="disable"/></option>'), '<flag actuation="disable"/> is not'),
    "feet that overlap": (feet_apart(0.02), "the soles touch or overlap: the left one is 0.04 m to the left"),
    "feet that touch": (feet_apart(0.036), "the soles touch or overlap: the left one is 0.072 m to the left"),
    "feet that graze": (feet_apart(0.037), "they are 0.072 m wide, and need 0.004 m to pass each other"),
    "crossed legs": (feet_apart(-0.042), "the soles touch or overlap: the left one is -0.084 m to the left"),
    "soles turned": (
        replaced((SOLE, f'{SOLE} euler="0 0 1.5708"')),
        "the geom and the site 'left_sole' are not turned alike",
    ),
    "slivers": (replaced((SOLE, 'type="box" size="0.0495 0.0001 0.006"')), "left sole is 0.099 x 0.0002 m, too thin"),
    "capsules": (replaced((SOLE, 'type="capsule" size="0.01 0.036"')), "the geom 'left_sole' is no box"),
    "one long foot": (TEXT.replace(SOLE, 'type="box" size="0.06 0.036 0.006"', 1), "the soles differ, [0.06, 0.036]"),
    "site beside its sole": (
        replaced(('site name="left_sole" pos="0.0069', 'site name="left_sole" pos="0.03')),
        "the site 'left_sole' is not in the middle of the sole's lower face, [0.0069, 0.0, -0.0577]",
    ),
    "soles that sink": (replaced(('geom contype="3"', 'geom contype="2"')), "'left_sole' cannot touch the floor"),
    "three servos": (three_actuators(), "the actuator 'left_shoulder_pitch_p' is not of the kind <dcmotor"),
    "two inputs": (replaced(('input="pos vel ff"', 'input="pos vel"')), "is not of the kind <dcmotor"),
    "gears": (
        replaced(('<dcmotor name="left_knee"', '<dcmotor name="left_knee" gear="50"')),
        "the actuator 'left_knee' must have no gear",
    ),
    "loose knee": (re.sub(r'<dcmotor name="left_knee".*/>', "", TEXT), "the joint 'left_knee' has 0 actuators"),
    "slide": (
        replaced(('<joint name="left_elbow"', '<joint type="slide" name="left_elbow"')),
        "the joint 'left_elbow' is no hinge",
    ),
    "endless joint": (
        replaced(('axis="0 1 0" range="-2.4 0.1"', 'axis="0 1 0" limited="false"')),
        "the joint 'left_elbow' has no range",
    ),
    "short keyframe": (
        replaced((' -0.654134099 0"/>', ' -0.654134099"/>')),
        "'stand' has 26 numbers in qpos; it must have 27",
    ),
    "keyframe of no numbers": (
        replaced((' -0.654134099 0"/>', ' -0.654134099 nan"/>')),
        "the keyframe 'stand' is not finite",
    ),
    "keyframe out of range": (replaced(("0.15 0.2 0 -0.5", "0.15 0.2 0 0.5")), "the joint 'left_elbow' is outside of"),
    "keyframe on its side": (replaced(("0.269258737  1 0 0 0", "0.269258737  0.9 0.1 0 0")), "sole is not level"),
    "on one leg": (replaced(("-0.526779118 1.18091322 -0.654134099 0\n", "-0.9 1.8 -0.9 0\n")), "not at one height"),
    "a twentieth of the size": (sized(0.05), "in 'stand' the COG is 0.013 m over the soles; it must be from 0.05 to 5"),
    "a gnat": (heavier(1e-3), "the mass is 0.00553 kg; it must be from 0.05 to 5000"),
    "root that is not the trunk": (base_under_the_trunk(), "'root_joint' is not the free joint of the body 'trunk'"),
    "a ball beside it": (
        replaced(("<worldbody>", '<worldbody><body name="ball"><geom name="ball" size="0.1"/></body>')),
        "the root bodies are ['ball', 'trunk']; 'trunk' must be the only one",
    ),
    "a floor of its own": (
        replaced(("<worldbody>", '<worldbody><geom name="ground" type="plane" size="1 1 1"/>')),
        "the world has geoms of its own",
    ),
    "a part called floor": (replaced(('name="visor"', 'name="floor"')), "repeated name 'floor' in geom"),
    "nameless": (replaced(('<body name="left_shin" ', "<body ")), "body 13 has no name"),
    "two of one name": (
        replaced(('<body name="left_foot">', '<body name="left_sole">')),
        "'left_sole' is the name of several bodies, joints and sites",
    ),
    "no sensors, and no sole": (
        TEXT.replace('geom name="left_sole"', 'geom name="left_foot_box"'),
        "the robot has no geom named 'left_sole'; models/utmu2.xml lists the conventions",
    ),
    "no trunk": (TEXT.replace('<body name="trunk"', '<body name="body"'), "the robot has no body named 'trunk'"),
    "no stand": (TEXT.replace('key name="stand"', 'key name="home"'), "the robot has no keyframe named 'stand'"),
    "a heel beside the sole": (
        replaced((f'<geom name="left_sole" {SOLE}', f'{HEEL}<geom name="left_sole" {SOLE}')),
        "in 'stand' the geom 'heel' of the body 'left_foot' touches the floor; only the geoms of the soles may",
    ),
    "a nameless heel": (
        replaced((f'<geom name="left_sole" {SOLE}', f'{HEEL.replace(NAMED_HEEL, "")}<geom name="left_sole" {SOLE}')),
        "in 'stand' a sphere of the body 'left_foot' touches the floor",
    ),
    "a heel a hair above": (
        replaced(
            (f'<geom name="left_sole" {SOLE}', f'{HEEL.replace("-0.0477", "-0.0469")}<geom name="left_sole" {SOLE}')
        ),
        "the geom 'heel' of the body 'left_foot' touches the floor",
    ),
    "thighs in each other": (
        replaced(('<body name="left_thigh"', f'{THICK}<body name="left_thigh"')),
        "in 'stand' a sphere of the body 'left_hip_roll_link' is inside of ",
    ),
    "a soft sole": (replaced((SOLE, f'margin="0.01" {SOLE}')), "'left_sole' has a margin, gap or priority"),
    "a sole of its own friction": (replaced((SOLE, f'priority="2" {SOLE}')), "'left_sole' has a margin, gap or prior"),
    "a ref": (
        replaced(('<joint name="left_elbow"', '<joint ref="0.1" name="left_elbow"')),
        "the joint 'left_elbow' has a ref; it must be 0",
    ),
    "controls that are cut": (
        replaced(('<dcmotor name="left_knee"', '<dcmotor ctrllimited="true" ctrlrange="-1 1" name="left_knee"')),
        "the actuator 'left_knee' has a range of its controls",
    ),
    "a loop": (
        replaced(("</worldbody>", '</worldbody><equality><joint joint1="left_elbow"/></equality>')),
        "it has equality constraints; only trees of links with a motor a joint are allowed",
    ),
    "a cord": (
        replaced(("</worldbody>", '</worldbody><tendon><fixed><joint joint="left_elbow" coef="1"/></fixed></tendon>')),
        "it has tendons; only trees",
    ),
    "contact of its own": (
        optioned('<option><flag override="enable"/></option>'),
        '<flag override="enable"/> is not allowed',
    ),
    "nothing": ("", "not a readable MJCF robot"),
    "half": (TEXT[:4000], "not a readable MJCF robot"),
    "bottomless": ("<mujoco>" + "<worldbody>" * 3000 + "</worldbody>" * 3000 + "</mujoco>", "not a readable MJCF"),
    "lost mesh": (optioned('<asset><mesh name="m" file="gone.stl"/></asset>'), "gone.stl"),
    "lost include": (optioned('<include file="gone.xml"/>'), "gone.xml"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_robot_that_cannot_be_used_is_refused_in_one_line(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text, words = WRONG[what]
    path = tmp_path / "mine.xml"
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        load_robot(str(path))
    line = str(refusal.value)
    assert line.startswith(f"{path}: ")
    assert words in line
    assert "\n" not in line
    # MuJoCo neither speaks for itself nor leaves its log.
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "text",
    [sized(2.0), heavier(0.5), optioned('<option gravity="0 0 -1.62"/>'), feet_apart(0.06)],
    ids=["twice the size", "light", "on the Moon", "wide"],
)
def test_a_robot_of_another_build_is_read(text: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(text)
    assert len(load_robot(str(path)).joint_names) == 20
