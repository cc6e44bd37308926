"""What a sole adds to what `dynamics` and `ik` solve: its Jacobian, and the acceleration that it lacks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]


@compiled
def sole_terms(
    side: int,
    jacobian: Array,
    qd: Array,
    ankle: Array,
    place: Array,
    sole: Array,
    chain: NDArray[np.int64],
    foot: Array,
    local: Array,
    rotation: Array,
    missing: Array,
) -> None:
    """Write of one sole the Jacobian, the frame, and the acceleration at qdd = 0 less the one that is asked for."""
    R = rotation[side]
    for i in range(3):
        for j in range(3):
            R[i, j] = ankle[i, 0] * sole[j] + ankle[i, 1] * sole[3 + j] + ankle[i, 2] * sole[6 + j]
    px = place[0] + ankle[0, 0] * sole[9] + ankle[0, 1] * sole[10] + ankle[0, 2] * sole[11]
    py = place[1] + ankle[1, 0] * sole[9] + ankle[1, 1] * sole[10] + ankle[1, 2] * sole[11]
    pz = place[2] + ankle[2, 0] * sole[9] + ankle[2, 1] * sole[10] + ankle[2, 2] * sole[11]

    # spatial velocity at the world's origin, and acceleration: each joint's axis is carried along by what is before it
    vx = vy = vz = wx = wy = wz = 0.0
    ax = ay = az = bx = by = bz = 0.0
    for c in range(6 + len(chain)):
        k = c if c < 6 else chain[c - 6]
        lx, ly, lz = jacobian[0, k], jacobian[1, k], jacobian[2, k]
        tx, ty, tz = jacobian[3, k], jacobian[4, k], jacobian[5, k]
        u = qd[k]
        if c >= 6:
            ax += u * (wy * lz - wz * ly + vy * tz - vz * ty)
            ay += u * (wz * lx - wx * lz + vz * tx - vx * tz)
            az += u * (wx * ly - wy * lx + vx * ty - vy * tx)
            bx += u * (wy * tz - wz * ty)
            by += u * (wz * tx - wx * tz)
            bz += u * (wx * ty - wy * tx)
        vx, vy, vz = vx + u * lx, vy + u * ly, vz + u * lz
        wx, wy, wz = wx + u * tx, wy + u * ty, wz + u * tz
        mx, my, mz = lx + ty * pz - tz * py, ly + tz * px - tx * pz, lz + tx * py - ty * px
        for i in range(3):
            local[side, i, k] = R[0, i] * mx + R[1, i] * my + R[2, i] * mz
            local[side, 3 + i, k] = R[0, i] * tx + R[1, i] * ty + R[2, i] * tz
    # at the sole's middle
    sx, sy, sz = vx + wy * pz - wz * py, vy + wz * px - wx * pz, vz + wx * py - wy * px
    ax += by * pz - bz * py + wy * sz - wz * sy
    ay += bz * px - bx * pz + wz * sx - wx * sz
    az += bx * py - by * px + wx * sy - wy * sx

    stiffness, damping = foot[3], foot[4]
    ax -= stiffness * (foot[7] - px) + damping * (foot[10] - sx) + foot[13]
    ay -= stiffness * (foot[8] - py) + damping * (foot[11] - sy) + foot[14]
    az -= stiffness * (foot[9] - pz) + damping * (foot[12] - sz) + foot[15]
    cos, sin = math.cos(foot[1]), math.sin(foot[1])
    turn = np.empty((3, 3))
    for j in range(3):
        turn[0, j] = cos * R[j, 0] - sin * R[j, 1]
        turn[1, j] = sin * R[j, 0] + cos * R[j, 1]
        turn[2, j] = R[j, 2]
    ex, ey, ez = rotation_vector(turn)
    stiffness, damping = foot[5], foot[6]
    bx -= stiffness * ex - damping * wx
    by -= stiffness * ey - damping * wy
    bz -= stiffness * ez - damping * wz
    for i in range(3):
        missing[side, i] = R[0, i] * ax + R[1, i] * ay + R[2, i] * az
        missing[side, 3 + i] = R[0, i] * bx + R[1, i] * by + R[2, i] * bz


@compiled
def rotation_vector(R: Array) -> tuple[float, float, float]:
    """Rotation vector [rad] of a rotation matrix; the axis of a half turn is not told apart."""
    x, y, z = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return 0.0, 0.0, 0.0
    angle = math.atan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0))
    factor = angle / sine
    return factor * x, factor * y, factor * z
