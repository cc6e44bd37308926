"""A small biped that keeps none of our conventions, for tests of what somebody else's file may say."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np

FOOT = '<geom type="box" size="0.07 0.04 0.01" pos="0.01 0 -0.035" mass="0.3"/>'
"""The geoms of a foot, 14 x 8 cm and 4.5 cm below the ankle."""
SHIN = '<geom type="capsule" fromto="0 0 -0.03 0 0 -0.15" size="0.02" mass="0.4"/>'

COMPILER = '<compiler angle="degree"/>'
BENT = "0 0 .48 1 0 0 0 0 0 -.4 .8 -.4 0 0 0 -.4 .8 -.4 0 0 0"

_LEG = f"""
      <body name="SIDE_hip" pos="0 YY -0.05">
        <joint name="SIDE_yaw" axis="0 0 1"/>
        <geom type="sphere" size="0.02" mass="0.3"/>
        <body name="SIDE_pelvis" pos="0 0 -0.03">
          <joint name="SIDE_roll" axis="1 0 0"/>
          <geom type="sphere" size="0.02" mass="0.2"/>
          <body name="SIDE_thigh">
            <joint name="SIDE_pitch" axis="0 1 0" range="-100 60"/>
            <geom type="capsule" fromto="0 0 -0.03 0 0 -0.17" size="0.022" mass="0.6"/>
            <body name="SIDE_shin" pos="0 0 -0.2">
              <joint name="SIDE_knee" axis="0 1 0" range="-5 140"/>
              {SHIN}
              <body name="SIDE_ankle" pos="0 0 -0.18">
                <joint name="SIDE_ankle_pitch" axis="0 1 0" range="-80 60"/>
                <geom type="sphere" size="0.015" mass="0.1"/>
                <body name="SIDE_foot">
                  <joint name="SIDE_ankle_roll" axis="1 0 0"/>
                  {FOOT}
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>"""

_ARM = """
      <body name="SIDE_arm" pos="0 YY 0.15">
        <joint name="SIDE_shoulder" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.15" size="0.015" mass="0.2"/>
      </body>"""

_JOINTS = ("yaw", "roll", "pitch", "knee", "ankle_pitch", "ankle_roll", "shoulder")

_WHOLE = """<mujoco model="small">
  <compiler angle="degree"/>
  <default>
    <joint range="-45 45" damping="0.1" armature="0.005"/>
    <motor ctrlrange="-12 12"/>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="torso" pos="0 0 0.505">
      <freejoint name="float"/>
      <geom type="box" size="0.06 0.09 0.1" pos="0 0 0.1" mass="3"/>LIMBS
    </body>
  </worldbody>
  <actuator>
    MOTORS
  </actuator>
</mujoco>
"""


def _mirrored(text: str, left: str, right: str) -> str:
    return "".join(text.replace("SIDE", side).replace("YY", y) for side, y in (("left", left), ("right", right)))


TEXT = _WHOLE.replace("LIMBS", _mirrored(_LEG, "0.07", "-0.07") + _mirrored(_ARM, "0.12", "-0.12")).replace(
    "MOTORS",
    "\n    ".join(f'<motor name="{side}_{j}" joint="{side}_{j}"/>' for side in ("left", "right") for j in _JOINTS),
)


def with_text(*pairs: tuple[str, str]) -> str:
    """The file with texts replaced, each of which it must hold."""
    text = TEXT
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


def top(element: str) -> str:
    """The file with one more element at its top level."""
    return with_text(("<worldbody>\n    <geom", f"{element}\n  <worldbody>\n    <geom"))


def both(old: str, new: str) -> str:
    """The file with a text replaced on either side; SIDE in it is left and right."""
    return with_text(*{(old.replace("SIDE", side), new.replace("SIDE", side)): 0 for side in ("left", "right")})


def write(folder: Path, text: str = TEXT) -> Path:
    """The path of a file that holds the text."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "small.xml"
    path.write_text(text, encoding="utf-8")
    return path


def box_mesh(half: tuple[float, float, float], centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> bytes:
    """A box as a binary STL file."""
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    places = np.array(centre) + np.array(half) * np.array(corners, dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(a, b, c) for a, b, c, _ in faces] + [(a, c, d) for a, _, c, d in faces]
    packed = (struct.pack("<12fH", 0, 0, 0, *places[list(each)].ravel(), 0) for each in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(packed)


def meshed(compiler: str, asset: str, geom: str = '<geom type="mesh" mesh="f" mass="0.3"/>') -> str:
    return with_text((FOOT, geom), (COMPILER, f'<compiler angle="degree" {compiler}/><asset>{asset}</asset>'))


def keyed(qpos: str, name: str = "home") -> str:
    return top(f'<keyframe><key name="{name}" qpos="{qpos}"/></keyframe>')


def driven(element: str) -> str:
    """With another actuator for each joint J."""
    return re.sub(r'<motor name="\w+" joint="(\w+)"/>', lambda match: element.replace("J", match[1]), TEXT)


def hips_of_many_hinges(apart: bool) -> str:
    """Yaw, roll and pitch of either hip in one body, with their axes through one point or apart."""
    text = TEXT
    for side in ("left", "right"):
        text = text.replace(f'<joint name="{side}_yaw" axis="0 0 1"/>', "")
        text = text.replace(f'<joint name="{side}_roll" axis="1 0 0"/>', "")
        yaw, roll = ('pos="0.01 0 0.08"', 'pos="0 0.01 0.05"') if apart else ("", "")
        three = f'<joint name="{side}_yaw" axis="0 0 1" {yaw}/><joint name="{side}_roll" axis="1 0 0" {roll}/>'
        text = text.replace(f'<joint name="{side}_pitch"', f'{three}<joint name="{side}_pitch"')
    return text


def with_waist() -> str:
    """Both legs hang on a waist that turns."""
    body = '<body name="waist"><joint name="waist" axis="0 0 1"/><geom type="sphere" size="0.03" mass="0.3"/>'
    return with_text(
        ('      <body name="left_hip"', f'{body}<body name="left_hip"'),
        ('\n      <body name="left_arm"', '</body><body name="left_arm"'),
        ("<actuator>", '<actuator><motor joint="waist"/>'),
    )


def feet_turned() -> str:
    """The foot's z axis is forward, and its x axis down."""
    joint = '<joint name="SIDE_ankle_roll" axis="1 0 0"/>'
    blank = 18 * " "
    return both(
        f'<body name="SIDE_foot">\n{blank}{joint}\n{blank}{FOOT}',
        '<body name="SIDE_foot" euler="0 90 0"><joint name="SIDE_ankle_roll" axis="0 0 1"/>'
        '<geom type="box" size="0.01 0.04 0.07" pos="0.035 0 0.01" mass="0.3"/>',
    )


def put(folder: Path, text: str, files: dict[str, bytes] | None = None, hints: str = "") -> Path:
    path = write(folder, text)
    for name, content in (files or {}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    if hints:
        (folder / "robot.toml").write_text(hints)
    return path
