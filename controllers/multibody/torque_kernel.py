"""The weighted QP of the inverse dynamics, assembled from the terms of the equation of motion.

The unknowns x are the joints' accelerations (n,) and, of each sole that stands, force and moment in the sole's frame.
The base's acceleration follows from them, for no torque acts there:

    M_bb qdd_b + M_bj qdd_j + h_b = sum of J_b' f.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import from_quaternion
from controllers.multibody.elimination import divide_by_base, normal_equations, solved
from controllers.multibody.sole_terms import rotation_vector, sole_terms

Array = NDArray[np.float64]

# Numbers that tell of a foot: whether it stands, yaw, weight, stiffness and damping of its place and of its attitude;
# position, velocity and acceleration.
FOOT = 16
# Numbers that tell of a joint: stand [rad], share of the posture's weight, most torque [N m], damping [N m s] and dry
# friction [N m].
JOINT = 5
FRICTION_SPEED = 0.05
"""Speed at which three quarters of a joint's dry friction are made up for [rad/s]."""
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
        cog, orientation, trunk, posture, torque, force, tangential, moment, yaw_moment: weights of the squares of
            accelerations of the COG [m/s^2], of the soles' and the trunk's turning [rad/s^2] and of the joints beside
            the legs [rad/s^2]; of the joints' torques [N m]; of a sole's force, of its part along y and z [N], of its
            moments, and on top of it of that about the vertical of a sole that stands alone [N m].
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
    yaw_moment: float
    half_length: float
    half_width: float
    friction: float


@compiled
def weights_of(figures: Array) -> Weights:
    """Name figures (18,): they are handed over as an array, which costs 2 us less than a tuple."""
    a = figures
    return Weights(
        a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13], a[14], a[15], a[16],
        a[17],
    )  # fmt: skip


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
    figures: Array,
) -> tuple[bool, Array, Array, Array, Array, Array, Array, Array]:
    """Assemble the QP  min 1/2 x'Hx + f'x,  lower <= A x <= upper; if both feet stand, solve it without its limits.

    Args:
        mass, jacobian, bias, q, qd, soles, chains: see `BodyTerms`.
        left_rotation, left_position, right_rotation, right_position: its `ankles`.
        joints: (n, JOINT) figures of the joints.
        acceleration: (3,) that the COG is to have [m/s^2].
        feet: (2, FOOT) what the soles are to do.
        figures: `Weights` of all this.

    Returns:
        Whether that optimum keeps the limits (False without one), its torques (n,), H, f, A, lower, upper, and the
        torques (n,) at x = 0; the first n rows of A are those of the torques.
    """
    weights = weights_of(figures)
    n = len(joints)
    standing = int(feet[0, 0] + feet[1, 0])
    size, limits = n + 6 * standing, n + _SOLE_ROWS * standing
    # limits, then tasks: soles, trunk, COG; padded to a multiple of four for `normal_equations`
    count = (limits + 12 + 3 + 3 + 3) // 4 * 4
    rows, constant, weight = np.zeros((count, size)), np.zeros(count), np.zeros(count)
    lower, upper = np.zeros(limits), np.full(limits, _NO_BOUND)

    # soles: Jacobian (6, 6 + n) in the sole's frame, its frame, and what is missing from the acceleration asked for
    local = np.zeros((2, 6, 6 + n))
    rotation, missing = np.empty((2, 3, 3)), np.empty((2, 6))
    for side in range(2):
        ankle, place = (left_rotation, left_position) if side == 0 else (right_rotation, right_position)
        sole_terms(side, jacobian, qd, ankle, place, soles[side], chains[side], feet[side], local, rotation, missing)

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
    divide_by_base(mass, base, base0)

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
    attitude = from_quaternion(np.array([q[6], q[3], q[4], q[5]]))
    ex, ey, ez = rotation_vector(attitude.T)
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

    hessian, linear = normal_equations(rows, constant, weight, n, limits)
    for j in range(n):
        if joints[j, 1] > 0.0:
            pull = weights.posture_stiffness * (joints[j, 0] - q[7 + j]) - weights.posture_damping * qd[6 + j]
            hessian[j, j] += weights.posture * joints[j, 1]
            linear[j] -= weights.posture * joints[j, 1] * pull
    for column in range(n, size, 6):
        for k in range(3):
            # what placo takes for the part along the sole is y and z
            hessian[column + k, column + k] += weights.force + (weights.tangential if k > 0 else 0.0)
            hessian[column + 3 + k, column + 3 + k] += weights.moment
    if standing == 1:
        hessian[n + 5, n + 5] += weights.yaw_moment
    for i in range(size):
        hessian[i, i] += _REGULARISATION
        for j in range(i):
            hessian[i, j] = hessian[j, i]

    torque, free = np.empty(n), standing == 2
    if not free:
        # with a foot in the air some limit nearly always counts
        return free, torque, hessian, linear, rows[:limits], lower, upper, constant[:n]
    optimum = solved(hessian, linear)
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
