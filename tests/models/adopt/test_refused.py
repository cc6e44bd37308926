"""What cannot be adopted is refused in one line that names the part, and nothing is written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from models.adopt.adopt import adopt
from models.errors import InputError
from tests.models.adopt.biped_files import BENT, FOOT, TEXT, both, driven, keyed, meshed, put, top, with_text

TORSO = 'mass="3"/>'
RIGHT_LEG = TEXT[TEXT.index('\n      <body name="right_hip"') : TEXT.index('\n      <body name="left_arm"')]


def in_millimetres(match: re.Match[str]) -> str:
    return f'{match[1]}="{" ".join(str(1000 * float(each)) for each in match[2].split())}"'


HINTS = {
    "unknown field": ("colour = 3", "robot.toml: colour: Extra inputs are not permitted, not 3; the fields are name, "),
    "unknown field of a motor": ('[motors."*"]\ntork = 1', "motors.*.tork: Extra inputs are not permitted, not 1; the"),
    "no TOML": ("= 3", "robot.toml: not a TOML file: "),
    "a name with a blank": ('name = "a b"', "robot.toml: name: "),
    "a hidden name": ('name = "."', "robot.toml: name: "),
    "no such stand": ('stand = "lie"', "stand: Input should be 'bent' or 'keyframe', not 'lie'"),
    "too deep": ("bend = 0.3", "bend: Input should be greater than or equal to 0.5, not 0.3"),
    "no speed": ("speed = nan", "speed: Input should be a finite number, not nan"),
    "no torque": ('[motors."*"]\ntorque = 0', "motors.*.torque: Input should be greater than 0, not 0"),
    "no such keyframe": ('keyframe = "gone"', "keyframe: 'gone' is none of []"),
    "no such foot": (
        'left_foot = "gone"',
        "left_foot: 'gone' is none of the moving bodies with geoms, torso, left_hip",
    ),
    "one foot": ('left_foot = "right_foot"', "'right_foot' is named as both feet"),
    "feet crossed": (
        'left_foot = "right_foot"\nright_foot = "left_foot"',
        "the left foot 'right_foot' is to the right of the right one",
    ),
    "shin for a foot": ('left_foot = "left_shin"', "each needs as many as the other, and at least 3"),
    "nothing to weld": ('weld = ["neck*"]', "weld: 'neck*' matches none of the joints left_yaw, left_roll"),
    "no such motor": ('[motors."neck*"]\ntorque = 1', "motors: 'neck*' matches none of the joints left_yaw, left_roll"),
    "no gains to take": ('servos = "file"', "the joint 'left_yaw' has no position servo whose gains to take"),
}
REFUSED: dict[str, tuple[str, dict[str, bytes], str, str]] = {
    **{f"hints: {what}": (TEXT, {}, hints, words) for what, (hints, words) in HINTS.items()},
    "nothing": ("", {}, "", "small.xml: not a readable MJCF robot: "),
    "no XML": ("hello", {}, "", "small.xml: not a readable MJCF robot: "),
    "no robot": ("<mujoco/>", {}, "", "has 0 bodies at its root, []; one is needed"),
    "two robots": (
        with_text(("</worldbody>", "<body><freejoint/><geom size='.1'/></body></worldbody>")),
        {},
        "",
        "has 2 bodies at its root, ['torso', '']",
    ),
    "lost mesh": (meshed('meshdir="m"', '<mesh name="f" file="gone.stl"/>'), {}, "", "m/gone.stl'"),
    "broken mesh": (meshed("", '<mesh name="f" file="f.stl"/>'), {"f.stl": b"hello"}, "", "invalid header in STL file"),
    "broken picture": (
        top('<asset><texture name="t" type="2d" file="t.png"/></asset>'),
        {"t.png": b"hi"},
        "",
        "t.png'",
    ),
    "slide": (
        both('name="SIDE_shoulder" axis', 'name="SIDE_shoulder" type="slide" axis'),
        {},
        "",
        "the joint 'left_shoulder' is a slide joint, no hinge; weld = [\"left_shoulder\"] in robot.toml takes it out",
    ),
    "ball": (
        both('name="SIDE_shoulder" axis="0 1 0"', 'name="SIDE_shoulder" type="ball"'),
        {},
        "",
        "the joint 'left_shoulder' is a ball joint, no hinge",
    ),
    "rails": (
        with_text(('<freejoint name="float"/>', '<joint type="slide" axis="1 0 0"/>')),
        {},
        "",
        "the root body 'torso' has a joint without a name to the world",
    ),
    "no number": (
        with_text(('<body name="left_shin" pos="0 0 -0.2">', '<body name="left_shin" pos="0 0 nan">')),
        {},
        "",
        "the body 'left_shin' has a number that is not finite",
    ),
    "two free joints": (
        with_text(('<freejoint name="float"/>', '<freejoint name="float"/><joint name="lift" type="slide"/>')),
        {},
        "",
        "the root body 'torso' has 2 joints; one, the free one, is allowed",
    ),
    "loop": (
        top('<equality><weld name="grip" body1="left_arm" body2="right_arm"/></equality>'),
        {},
        "",
        "has the equality constraint 'grip'; only trees",
    ),
    "loop without a name": (
        top('<equality><joint joint1="left_knee" joint2="right_knee"/></equality>'),
        {},
        "",
        "has an equality constraint; only trees",
    ),
    "tendon": (
        top('<tendon><fixed name="cord"><joint joint="left_knee" coef="1"/></fixed></tendon>'),
        {},
        "",
        "has the tendon 'cord'; only trees",
    ),
    "loose knee": (
        with_text(('<motor name="left_knee" joint="left_knee"/>', "")),
        {},
        "",
        "the joint 'left_knee' has no motor; say it in robot.toml, [motors.left_knee] torque = ..., or take the joint",
    ),
    "motors without a limit": (
        driven('<position joint="J" kp="100"/>'),
        {},
        "",
        "the joint 'left_yaw' has no limit of its torque; say it in robot.toml",
    ),
    "glue": (
        with_text(("</actuator>", '<adhesion body="left_foot" ctrlrange="0 1"/></actuator>')),
        {},
        "",
        "actuator 14, which has no name, drives no joint",
    ),
    "velocity servos, gains of the file": (
        driven('<velocity joint="J" kv="3" forcerange="-12 12"/>'),
        {},
        'servos = "file"',
        "the joint 'left_yaw' has no position servo whose gains to take",
    ),
    "a keyframe of no numbers": (keyed(BENT.replace("0 0", "nan 0", 1)), {}, "", "the keyframe 'home' is not finite"),
    "facing y": (
        re.sub(r'(pos|axis)="(\S+) (\S+) (\S+)"', lambda m: f'{m[1]}="{-float(m[3])} {m[2]} {m[4]}"', TEXT).replace(
            "0.07 0.04 0.01", "0.04 0.07 0.01"
        ),
        {},
        "",
        "nothing on the left reaches the ground; what does is beside each other along x: does the robot face y?",
    ),
    "one leg": (
        re.sub(r'<motor name="right_(?!shoulder).*', "", with_text((RIGHT_LEG, ""))),
        {},
        "",
        "no right foot found: in the pose with all joints at 0",
    ),
    "point feet": (
        with_text((FOOT, '<geom type="sphere" size="0.02" pos="0 0 -0.035" mass="0.3"/>')),
        {},
        "",
        "what the left foot 'left_foot' stands on in the pose with all joints at 0 has no area to speak of",
    ),
    "a tail on the floor": (
        with_text((TORSO, f'{TORSO}<geom type="capsule" fromto="-.1 0 0 -.1 0 -.49" size="0.01" mass="0.01"/>')),
        {},
        "",
        "does not become a robot that can be used: in 'stand' a capsule of the body 'trunk' touches the floor",
    ),
    "stiff knees": (
        re.sub(r'<motor name="\w+_knee.*', "", re.sub(r'<joint name="\w+_knee".*', "", TEXT)),
        {},
        "",
        "no stand found with flat soles under the COG and the hip at 0.85 of a straight leg's height",
    ),
    "millimetres": (
        re.sub(r"\b(pos|size|fromto)=\"([^\"]*)\"", in_millimetres, TEXT),
        {},
        "",
        "a straight leg is 455 m long; it must be at most 5 m: are its lengths in metres?",
    ),
    "heavy": (
        with_text((TORSO, 'mass="30000"/>')),
        {},
        "",
        "does not become a robot that can be used: the mass is 3e+04",
    ),
    "slivers": (with_text(("0.07 0.04 0.01", "0.07 0.001 0.01")), {}, "", "the left sole is 0.14 x 0.002 m, too thin"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_adopted_is_refused_in_one_line_and_leaves_nothing(
    what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text, files, hints, words = REFUSED[what]
    path = put(tmp_path / "in", text, files, hints)
    with pytest.raises(InputError) as refusal:
        adopt(path, tmp_path / "deep" / "out")
    line = str(refusal.value)
    assert words in line
    assert "\n" not in line
    assert line.startswith(str(tmp_path / "in"))
    assert ".adopting" not in line
    assert [each.name for each in tmp_path.iterdir()] == ["in"]
    assert capfd.readouterr() == ("", "")


def test_a_name_that_is_not_utf_8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "small.xml"
    path.write_bytes(TEXT.replace("left_knee", "l\xe9ft").encode("latin-1"))
    with pytest.raises(InputError, match=r"small\.xml: holds a name that is not UTF-8"):
        adopt(path, tmp_path / "out")
    assert list(tmp_path.iterdir()) == [path]
