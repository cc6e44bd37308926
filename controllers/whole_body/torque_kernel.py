"""The weighted QP of the inverse dynamics, assembled from the terms of the equation of motion.

The unknowns x are the joints' accelerations (n,) and, of each sole that stands, force and moment in the sole's frame.
The base's acceleration follows from them, for no torque acts there:

    M_bb qdd_b + M_bj qdd_j + h_b = sum of J_b' f.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled

Array = NDArray[np.float64]

# Numbers that tell of a foot: whether it stands, yaw, weight, stiffness and damping of its place and of its attitude;
# position, velocity and acceleration.
FOOT = 16
# Rows of limits of a sole that stands: each a bound from one side.
_SOLE_ROWS = 8
# Every unknown is kept small by this, as in placo, so that the optimum is one.
_REGULARISATION = 1e-8
# Greater than any bound.
_NO_BOUND = 1e30
# A limit is kept if it is not exceeded by more [N m, N].
_KEPT = 1e-9


class Weights(NamedTuple):
    """Figures of the QP that do not change.

    Attributes:
        mass: of the body [kg].
        gravity: [m/s^2].
        cog, orientation, trunk, posture, torque, force, tangential, moment: weights of the squares of accelerations of
            the COG [m/s^2], of the soles' and the trunk's turning [rad/s^2] and of the joints beside the legs
            [rad/s^2]; of the joints' torques [N m]; of a sole's force, of its part along the sole [N] and of its
            moments [N m].
        trunk_stiffness, trunk_damping, posture_stiffness, posture_damping: [1/s^2] and [1/s].
        half_length, half_width: of a sole [m].
        friction: coefficient.
    """

    mass: float
    gravity: float
    cog: float
    orientation: float
    trunk: float
    trunk_stiffness: float
    trunk_damping: float
    posture: float
    posture_stiffness: float
    posture_damping: float
    torque: float
    force: float
    tangential: float
    moment: float
    half_length: float
    half_width: float
    friction: float


@compiled
def assembled(
    mass: Array,
    jacobian: Array,
    bias: Array,
    q: Array,
    qd: Array,
    left_rotation: Array,
    left_position: Array,
    right_rotation: Array,
    right_position: Array,
    soles: Array,
    chains: NDArray[np.int64],
    joints: Array,
    acceleration: Array,
    feet: Array,
    weights: Weights,
) -> tuple[bool, Array, Array, Array, Array, Array, Array, Array]:
    """Assemble the QP  min 1/2 x'Hx + f'x,  lower <= A x <= upper,  and solve it without its limits.

    Args:
        mass, jacobian, bias, q, qd, soles, chains: see `BodyTerms`.
        left_rotation, left_position, right_rotation, right_position: its `ankles`.
        joints: (n, 3) stand [rad], 1 where the posture counts, most torque [N m].
        acceleration: (3,) that the COG is to have [m/s^2].
        feet: (2, FOOT) what the soles are to do.
        weights: of all this.

    Returns:
        Whether that optimum keeps the limits, its torques (n,), H, f, A, lower, upper, and the torques (n,) at x = 0;
        the first n rows of A are those of the torques.
    """
    n = len(joints)
    standing = int(feet[0, 0] + feet[1, 0])
    size, limits = n + 6 * standing, n + _SOLE_ROWS * standing
    # limits, then tasks: soles, trunk, COG; padded to a multiple of four for `_normal`
    count = (limits + 12 + 3 + 3 + 3) // 4 * 4
    rows, constant, weight = np.zeros((count, size)), np.zeros(count), np.zeros(count)
    lower, upper = np.zeros(limits), np.full(limits, _NO_BOUND)

    # soles: Jacobian (6, 6 + n) in the sole's frame, its frame, and what is missing from the acceleration asked for
    local = np.zeros((2, 6, 6 + n))
    rotation, missing = np.empty((2, 3, 3)), np.empty((2, 6))
    for side in range(2):
        ankle, place = (left_rotation, left_position) if side == 0 else (right_rotation, right_position)
        _sole(side, jacobian, qd, ankle, place, soles[side], chains[side], feet[side], local, rotation, missing)

    # base: qdd_b = base x + base0
    base, base0 = np.zeros((6, size)), np.empty(6)
    for i in range(6):
        base0[i] = -bias[i]
        for j in range(n):
            base[i, j] = -mass[i, 6 + j]
    column = n
    for side in range(2):
        if feet[side, 0] == 1.0:
            for i in range(6):
                for k in range(6):
                    base[i, column + k] = local[side, k, i]
            column += 6
    _divide(mass, base, base0)

    # torques, within what the motors have
    for j in range(n):
        row = rows[j]
        total = bias[6 + j]
        for k in range(n):
            row[k] = mass[6 + j, 6 + k] if j <= k else mass[6 + k, 6 + j]
        for i in range(6):
            factor = mass[i, 6 + j]
            total += factor * base0[i]
            for k in range(size):
                row[k] += factor * base[i, k]
        column = n
        for side in range(2):
            if feet[side, 0] == 1.0:
                for k in range(6):
                    row[column + k] -= local[side, k, 6 + j]
                column += 6
        constant[j], weight[j] = total, weights.torque
        lower[j], upper[j] = -joints[j, 2] - total, joints[j, 2] - total

    # soles' centres of pressure and friction
    at, column = n, n
    for side in range(2):
        if feet[side, 0] == 1.0:
            for part, most in (
                (0, weights.friction),
                (1, weights.friction),
                (3, weights.half_width),
                (4, weights.half_length),
            ):
                for sign in (-1.0, 1.0):
                    rows[at, column + 2] = most
                    rows[at, column + part] = sign
                    at += 1
            column += 6

    # soles' way
    for side in range(2):
        for k in range(6):
            row = rows[at]
            total = missing[side, k]
            for j in range(n):
                row[j] = local[side, k, 6 + j]
            for i in range(6):
                factor = local[side, k, i]
                total += factor * base0[i]
                for j in range(size):
                    row[j] += factor * base[i, j]
            constant[at] = total
            weight[at] = feet[side, 2] if k < 3 else weights.orientation
            at += 1

    # upright trunk, in its own frame
    attitude = _matrix(q[3], q[4], q[5], q[6])
    ex, ey, ez = _log(attitude.T)
    for k in range(3):
        pull = attitude[0, k] * ex + attitude[1, k] * ey + attitude[2, k] * ez
        wanted = weights.trunk_stiffness * pull - weights.trunk_damping * qd[3 + k]
        rows[at, :] = base[3 + k]
        constant[at], weight[at] = base0[3 + k] - wanted, weights.trunk
        at += 1

    # COG: forces by mass
    for k in range(3):
        column = n
        for side in range(2):
            if feet[side, 0] == 1.0:
                for i in range(3):
                    rows[at, column + i] = rotation[side, k, i] / weights.mass
                column += 6
        constant[at] = -acceleration[k] - (weights.gravity if k == 2 else 0.0)
        weight[at] = weights.cog
        at += 1

    hessian, linear = _normal(rows, constant, weight, n, limits)
    for j in range(n):
        if joints[j, 1] == 1.0:
            pull = weights.posture_stiffness * (joints[j, 0] - q[7 + j]) - weights.posture_damping * qd[6 + j]
            hessian[j, j] += weights.posture
            linear[j] -= weights.posture * pull
    for column in range(n, size, 6):
        for k in range(3):
            hessian[column + k, column + k] += weights.force + (weights.tangential if k > 0 else 0.0)
            hessian[column + 3 + k, column + 3 + k] += weights.moment
    for i in range(size):
        hessian[i, i] += _REGULARISATION
        for j in range(i):
            hessian[i, j] = hessian[j, i]

    optimum = _solved(hessian, linear)
    torque, free = np.empty(n), True
    for r in range(limits):
        value = 0.0
        for j in range(size):
            value += rows[r, j] * optimum[j]
        # so that NaN is not taken for an answer
        if not (lower[r] - _KEPT <= value <= upper[r] + _KEPT):
            free = False
        if r < n:
            torque[r] = value + constant[r]
    return free, torque, hessian, linear, rows[:limits], lower, upper, constant[:n]


@compiled
def _sole(
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
    ex, ey, ez = _log(turn)
    stiffness, damping = foot[5], foot[6]
    bx -= stiffness * ex - damping * wx
    by -= stiffness * ey - damping * wy
    bz -= stiffness * ez - damping * wz
    for i in range(3):
        missing[side, i] = R[0, i] * ax + R[1, i] * ay + R[2, i] * az
        missing[side, 3 + i] = R[0, i] * bx + R[1, i] * by + R[2, i] * bz


@compiled
def _normal(rows: Array, constant: Array, weight: Array, torques: int, limits: int) -> tuple[Array, Array]:
    """Upper triangle of A'WA, and A'Wc, of the rows of torques and of those behind the limits."""
    count, size = rows.shape
    hessian, linear = np.zeros((size, size)), np.zeros(size)
    for i in range(size):
        h = hessian[i]
        for r in range(0, count, 4):
            if torques <= r and r + 4 <= limits:
                continue
            a, b, c, d = rows[r, i], rows[r + 1, i], rows[r + 2, i], rows[r + 3, i]
            a, b, c, d = weight[r] * a, weight[r + 1] * b, weight[r + 2] * c, weight[r + 3] * d
            linear[i] += a * constant[r] + b * constant[r + 1] + c * constant[r + 2] + d * constant[r + 3]
            for j in range(i, size):
                h[j] += a * rows[r, j] + b * rows[r + 1, j] + c * rows[r + 2, j] + d * rows[r + 3, j]
    return hessian, linear


@compiled
def _divide(mass: Array, base: Array, base0: Array) -> None:
    """Multiply `base` (6, m) and `base0` (6,) in place by the inverse of the base's part of the mass matrix."""
    L = np.zeros((6, 6))
    for i in range(6):
        for j in range(i + 1):
            total = mass[j, i]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(total) if i == j else total / L[j, j]
    size = base.shape[1]
    for i in range(6):
        for k in range(i):
            base0[i] -= L[i, k] * base0[k]
            for j in range(size):
                base[i, j] -= L[i, k] * base[k, j]
        base0[i] /= L[i, i]
        for j in range(size):
            base[i, j] /= L[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            base0[i] -= L[k, i] * base0[k]
            for j in range(size):
                base[i, j] -= L[k, i] * base[k, j]
        base0[i] /= L[i, i]
        for j in range(size):
            base[i, j] /= L[i, i]


@compiled
def _solved(hessian: Array, linear: Array) -> Array:
    """-H^-1 f by Cholesky's decomposition U'U; `hessian` is left as it is."""
    size = len(linear)
    U, x = hessian.copy(), -linear
    for k in range(size):
        pivot = 1.0 / math.sqrt(U[k, k])
        for j in range(k, size):
            U[k, j] *= pivot
        x[k] *= pivot
        for i in range(k + 1, size):
            factor = U[k, i]
            x[i] -= factor * x[k]
            for j in range(i, size):
                U[i, j] -= factor * U[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            x[k] -= U[k, j] * x[j]
        x[k] /= U[k, k]
    return x


@compiled
def _matrix(x: float, y: float, z: float, w: float) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion."""
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return R


@compiled
def _log(R: Array) -> tuple[float, float, float]:
    """Rotation vector [rad] of a rotation matrix; the axis of a half turn is not told apart."""
    x, y, z = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return 0.0, 0.0, 0.0
    angle = math.atan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0))
    factor = angle / sine
    return factor * x, factor * y, factor * z
