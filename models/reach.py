"""How far a leg reaches, by kinematics."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

_SWEEPS = 60
_DIGITS = 9


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
