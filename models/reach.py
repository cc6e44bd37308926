"""How far a leg reaches, by kinematics."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import mujoco
import numpy as np

_SWEEPS = 60
_DIGITS = 9
_ALONG = 0.6
"""Part of an axis along x from which a hinge counts as one of roll; along y, as one that swings forward and back."""
_LIGHT = 0.2
"""A limb is lighter than this share of the body."""


def straight_leg(model: mujoco.MjModel, hinges: Sequence[int]) -> float:
    """The longest way from the leg's first hinge to its last one that their ranges allow.

    The square of that distance is a sinusoid of each angle, so that each hinge in turn is put where it is longest until
    nothing gets longer.

    Args:
        model: compiled.
        hinges: those of the leg, from the hip down.

    Returns:
        The length [m], to the nanometre.
    """
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)

    def square(at: int, angle: float) -> float:
        data.qpos[at] = angle
        mujoco.mj_kinematics(model, data)
        way = data.xanchor[hinges[0]] - data.xanchor[hinges[-1]]
        return float(way @ way)

    longest = 0.0
    for _ in range(_SWEEPS):
        for hinge in hinges:
            at = int(model.jnt_qposadr[hinge])
            low, high = model.jnt_range[hinge] if model.jnt_limited[hinge] else (-math.pi, math.pi)
            ahead, across, back = square(at, 0.0), square(at, math.pi / 2), square(at, math.pi)
            peak = math.atan2(across - (ahead + back) / 2, (ahead - back) / 2)
            turns = (peak, peak - math.tau, peak + math.tau, float(low), float(high))
            best = max((angle for angle in turns if low <= angle <= high), key=lambda angle: square(at, angle))
            now = square(at, best)
        if now <= longest * (1.0 + 1e-12):
            break
        longest = now
    return float(np.round(math.sqrt(max(longest, now)), _DIGITS))


def swinging_hinges(model: mujoco.MjModel, data: mujoco.MjData, hinges: Sequence[int], sole: str) -> list[int]:
    """Those hinges of a leg that carry its sole far: its lever about them is at least half of the longest.

    Args:
        model, data: of the robot in its stand, after `mj_forward`.
        hinges: of one leg.
        sole: its site.
    """
    place = data.site(sole).xpos
    levers = [float(np.linalg.norm(np.cross(data.xaxis[j], place - data.xanchor[j]))) for j in hinges]
    return [j for j, lever in zip(hinges, levers, strict=True) if lever >= 0.5 * max(levers)]


def inertia_about(model: mujoco.MjModel, data: mujoco.MjData, hinge: int) -> float:
    """Of all that hangs on a hinge, in the present pose, with the rotor [kg m^2]."""
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    dof = int(model.jnt_dofadr[hinge])
    return float(full[dof, dof])


def outward_roll(model: mujoco.MjModel, data: mujoco.MjData, hinges: Sequence[int]) -> float:
    """How much farther than in the stand a left leg can lean outward with its sole flat [rad].

    The hip's roll leans the leg, the ankle's turns the sole back; without one at the ankle the hip alone counts.

    Args:
        model, data: of the robot in its stand, after `mj_forward`.
        hinges: of the left leg, from the hip down.
    """
    rolls = [j for j in hinges if abs(data.xaxis[j][0]) > _ALONG]
    room = []
    for j, turn in ((rolls[0], 1.0), (rolls[-1], -1.0)) if len(rolls) > 1 else ((j, 1.0) for j in rolls):
        low, high = model.jnt_range[j] - data.qpos[model.jnt_qposadr[j]]
        room.append(float(high if turn * data.xaxis[j][0] > 0.0 else -low))
    return min(room, default=0.0)


def limb_swings(model: mujoco.MjModel, data: mujoco.MjData, legs: Collection[int]) -> list[int]:
    """The hinges that swing a limb which is no leg forward and back: of arms and head, not of the waist.

    Args:
        model, data: of the robot in its stand, after `mj_forward`.
        legs: bodies of the legs.
    """
    light = _LIGHT * model.body_subtreemass[1]
    return [
        joint
        for joint in range(1, model.njnt)
        if abs(data.xaxis[joint][1]) > _ALONG
        and model.body_subtreemass[model.jnt_bodyid[joint]] < light
        and model.jnt_bodyid[joint] not in legs
    ]
