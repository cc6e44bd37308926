"""What the tasks ask of a motion of the whole body, as normal equations of its accelerations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import from_quaternion
from controllers.multibody.sole_terms import rotation_vector
from controllers.multibody.torque_kernel import Weights

Array = NDArray[np.float64]

REGULARISATION = 1e-6
"""Weight of a joint's acceleration, so that a straight leg has a finite one."""


@compiled
def asked(
    local: Array,
    missing: Array,
    base: Array,
    bias: Array,
    q: Array,
    qd: Array,
    chains: NDArray[np.int64],
    joints: Array,
    acceleration: tuple[float, float, float],
    feet: Array,
    weights: Weights,
) -> tuple[Array, Array]:
    """Upper triangle of H (6 + n, 6 + n), and f (6 + n,), of the least squares  min 1/2 x'Hx + f'x.

    Args:
        local: (2, 6, 6 + n) Jacobians of the soles in their frames.
        missing: (2, 6) accelerations of the soles at x = 0, less those that are asked for.
        base: (6, 6 + n) rows of the base of the mass matrix.
        bias, q, qd, chains: see `BodyTerms`.
        joints: (n, JOINT) figures of the joints.
        acceleration: that the COG is to have [m/s^2].
        feet: (2, FOOT) what the soles are to do.
        weights: of all this.
    """
    n, chain = len(joints), 6 + chains.shape[1]
    size = 6 + n
    hessian, linear = np.zeros((size, size)), np.zeros(size)
    # soles: of the base and their own leg
    at = np.empty(chain, dtype=np.int64)
    packed = np.empty((6, chain))
    for side in range(2):
        for c in range(chain):
            at[c] = c if c < 6 else chains[side, c - 6]
            for k in range(6):
                packed[k, c] = local[side, k, at[c]]
        place, turning = feet[side, 2], weights.orientation
        for a in range(chain):
            i, into = at[a], hessian[at[a]]
            p, r, s = place * packed[0, a], place * packed[1, a], place * packed[2, a]
            t, u, v = turning * packed[3, a], turning * packed[4, a], turning * packed[5, a]
            lack = missing[side]
            linear[i] += p * lack[0] + r * lack[1] + s * lack[2] + t * lack[3] + u * lack[4] + v * lack[5]
            for b in range(a, chain):
                into[at[b]] += (
                    p * packed[0, b]
                    + r * packed[1, b]
                    + s * packed[2, b]
                    + t * packed[3, b]
                    + u * packed[4, b]
                    + v * packed[5, b]
                )
    # COG: force by mass, in the base's frame
    attitude = from_quaternion(np.array([q[6], q[3], q[4], q[5]]))
    by_mass = weights.cog / (weights.mass * weights.mass)
    lack = np.empty(3)
    for k in range(3):
        wanted = 0.0
        for i in range(3):
            wanted += attitude[i, k] * (acceleration[i] + (weights.gravity if i == 2 else 0.0))
        lack[k] = by_mass * (bias[k] - weights.mass * wanted)
    first, second, third = base[0], base[1], base[2]
    for i in range(size):
        into = hessian[i]
        linear[i] += first[i] * lack[0] + second[i] * lack[1] + third[i] * lack[2]
        p, r, s = by_mass * first[i], by_mass * second[i], by_mass * third[i]
        for j in range(i, size):
            into[j] += p * first[j] + r * second[j] + s * third[j]
    # upright trunk, in its own frame
    ex, ey, ez = rotation_vector(attitude.T)
    for k in range(3):
        pull = attitude[0, k] * ex + attitude[1, k] * ey + attitude[2, k] * ez
        hessian[3 + k, 3 + k] += weights.trunk
        linear[3 + k] -= weights.trunk * (weights.trunk_stiffness * pull - weights.trunk_damping * qd[3 + k])
    for j in range(n):
        if joints[j, 1] > 0.0:
            pull = weights.posture_stiffness * (joints[j, 0] - q[7 + j]) - weights.posture_damping * qd[6 + j]
            hessian[6 + j, 6 + j] += weights.posture * joints[j, 1]
            linear[6 + j] -= weights.posture * joints[j, 1] * pull
        hessian[6 + j, 6 + j] += REGULARISATION
    return hessian, linear
