"""Variations of the shipped robot's file, for tests of what a user's own file may say."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from models.robot import MODELS

TEXT = (MODELS / "utmu2.xml").read_text(encoding="utf-8")
SOLE = 'type="box" size="0.0495 0.036 0.006"'


def replaced(*pairs: tuple[str, str]) -> str:
    """The file with texts replaced, each of which it must hold."""
    text = TEXT
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


def optioned(option: str) -> str:
    return replaced(("<default>\n    <geom", f"{option}<default>\n    <geom"))


def feet_apart(half: float) -> str:
    left, right = 'name="left_hip_yaw_link" pos="0 {} 0"', 'name="right_hip_yaw_link" pos="0 {} 0"'
    return replaced((left.format("0.042"), left.format(half)), (right.format("-0.042"), right.format(-half)))


def sized(scale: float) -> str:
    """All lengths scaled, the masses as they are."""

    def scaled(match: re.Match[str]) -> str:
        return f'{match[1]}="{" ".join(repr(float(each) * scale) for each in match[2].split())}"'

    text = re.sub(r'\b(pos|size|fromto)="([^"]*)"', scaled, TEXT)
    return re.sub(
        r'(qpos)="\s*(\S+ \S+ \S+)', lambda match: scaled(re.match(r"(.*)=(.*)", f"{match[1]}={match[2]}"))[:-1], text
    )


def heavier(scale: float) -> str:
    return re.sub(r'mass="([\d.]+)"', lambda match: f'mass="{float(match[1]) * scale!r}"', TEXT)


def three_actuators() -> str:
    """A position, a velocity and a torque servo for each joint."""
    text = re.sub(r"\n *<dcmotor nominal.*", "", TEXT)
    three = r'<position name="\1_p" joint="\2"/><velocity name="\1_v" joint="\2"/><motor name="\1_m" joint="\2"/>'
    return re.sub(r'<dcmotor name="(\w+)" joint="(\w+)" class="\w+"/>', three, text)


def base_under_the_trunk() -> str:
    """The free joint and the legs are of another body than the trunk, which is fixed to it."""
    joint = '<freejoint name="root_joint"/>'
    base = f'<body name="base">{joint}<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>'
    return replaced(
        (f'<body name="trunk">\n      {joint}', f'{base}<body name="trunk">'),
        ('<body name="left_hip_yaw_link"', '</body><body name="left_hip_yaw_link"'),
    )


def with_includes(folder: Path, write: Callable[[Path, str], None]) -> Path:
    """The robot's file with its defaults in a file that it includes."""
    begin, end = TEXT.index("  <default>"), TEXT.index("  <worldbody>")
    write(folder / "parts" / "defaults.xml", f"<mujoco>\n{TEXT[begin:end]}</mujoco>\n")
    write(folder / "mine.xml", TEXT[:begin] + '  <include file="parts/defaults.xml"/>\n' + TEXT[end:])
    return folder / "mine.xml"
