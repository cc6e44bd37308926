"""Accelerations of the whole body in closed form: weighted least squares, with what would pass a limit held at it.

The unknowns x are the accelerations (6 + n,) of the base and of the joints. What the base needs to move so is the
floor's to give; the soles that stand share it (`sharing`), so that torques, centres of pressure and friction follow
from x, too. Where one of them would pass its limit, it is held there and the motion is solved for again.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.multibody.elimination import factored, substitute, substitute_back
from controllers.multibody.holding import EXCHANGES, KEPT, hold
from controllers.multibody.motion_tasks import asked
from controllers.multibody.sharing import by_base, share_of_left, shared, wrench
from controllers.multibody.sole_terms import sole_terms
from controllers.multibody.torque_kernel import FRICTION_SPEED, weights_of

Array = NDArray[np.float64]

ROUNDS = 5
"""How often the motion is solved for again because a limit is passed."""
_SOLE_ROWS = 8


@compiled
def feed_forward(
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
    acceleration: tuple[float, float, float],
    zmp: tuple[float, float],
    feet: Array,
    figures: Array,
) -> tuple[bool, Array]:
    """Whether there is an answer, and torques (n,) that move the joints so against their friction [N m].

    See `moved`, which has the same arguments.
    """
    found, _, _, torque, _ = moved(
        mass,
        jacobian,
        bias,
        q,
        qd,
        left_rotation,
        left_position,
        right_rotation,
        right_position,
        soles,
        chains,
        joints,
        acceleration,
        zmp,
        feet,
        figures,
        ROUNDS,
        EXCHANGES,
    )
    # as `placo_model.friction_torque`; the tanh of compiled code differs from numpy's in the last bit of every fourth
    # number, so one of the two in the other's place would change the bits of a layer
    for j in range(len(joints)):
        torque[j] += joints[j, 3] * qd[6 + j] + joints[j, 4] * math.tanh(qd[6 + j] / FRICTION_SPEED)
    return found, torque


@compiled
def moved(
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
    acceleration: tuple[float, float, float],
    zmp: tuple[float, float],
    feet: Array,
    figures: Array,
    rounds: int,
    exchanges: int,
) -> tuple[bool, Array, Array, Array, Array]:
    """Solve for the motion.

    Args:
        mass, jacobian, bias, q, qd, soles, chains: see `BodyTerms`.
        left_rotation, left_position, right_rotation, right_position: its `ankles`.
        joints: (n, JOINT) figures of the joints.
        acceleration: that the COG is to have [m/s^2].
        zmp: command [m], by which the soles share the load.
        feet: (2, FOOT) what the soles are to do.
        figures: `Weights` of the tasks; those of torques and forces do not count here.
        rounds: how often limits may be held.
        exchanges: how often what is held may be exchanged in each, see `hold`.

    Returns:
        Whether there is an answer: finite numbers, and what to hold was found; accelerations (6 + n,) of the base and
        the joints, in pinocchio's order; wrenches (2, 6) of the soles in their frames [N, N m], inside their limits;
        joint torques (n,) within theirs [N m]; shares (2,) of the soles.
    """
    weights = weights_of(figures)
    n = len(joints)
    size = 6 + n

    local = np.zeros((2, 6, size))
    rotation, missing = np.empty((2, 3, 3)), np.empty((2, 6))
    sole_terms(0, jacobian, qd, left_rotation, left_position, soles[0], chains[0], feet[0], local, rotation, missing)
    sole_terms(1, jacobian, qd, right_rotation, right_position, soles[1], chains[1], feet[1], local, rotation, missing)

    shares = np.array([feet[0, 0], feet[1, 0]])
    if shares[0] == 1.0 and shares[1] == 1.0:
        left, right = left_position + left_rotation @ soles[0, 9:], right_position + right_rotation @ soles[1, 9:]
        shares[0] = share_of_left(left, right, rotation[0], rotation[1], zmp, weights.half_length, weights.half_width)
        shares[1] = 1.0 - shares[0]
    stands, spring = shares[0] + shares[1] > 0.0, shared(local, shares)

    # the base's rows of the equation of motion: what the floor has to give
    base = np.empty((6, size))
    for j in range(size):
        for i in range(6):
            base[i, j] = mass[i, j] if i <= j else mass[j, i]

    hessian, linear = asked(local, missing, base, bias, q, qd, chains, joints, acceleration, feet, weights)
    U = factored(hessian)
    free = -linear
    substitute(U, free)

    limits = 2 * (n + _SOLE_ROWS)
    # What is held: rows of limits behind U'^-1, and by how much the free motion misses each.
    rows, lack = np.empty((6 + limits, size)), np.empty(6 + limits)
    held, active, count = np.zeros(limits, dtype=np.bool_), np.ones(6 + limits, dtype=np.bool_), 0
    if not stands:
        # in the air the floor gives nothing
        for k in range(6):
            rows[k] = base[k]
            substitute(U, rows[k])
            lack[k] = -bias[k] - (rows[k] * free).sum()
            count += 1
    fixed = count

    x, torque, wrenches, need = np.empty(size), np.empty(n), np.zeros((2, 6)), np.empty(6)
    # parts of a sole's wrench that the force upwards limits, and by how much of it
    parts = (0, 1, 3, 4)
    half = np.array([weights.friction, weights.friction, 0.0, weights.half_width, weights.half_length])
    found = True
    for solve in range(rounds + 1):
        x[:] = free
        if count > 0:
            found = hold(rows, lack, count, fixed, active, x, exchanges)
        substitute_back(U, x)
        for i in range(6):
            total = bias[i]
            for j in range(size):
                total += base[i, j] * x[j]
            need[i] = total
        if stands:
            wrench(local, shares, spring, need, wrenches)
        torques(mass, bias, local, shares, wrenches, x, torque)
        if solve == rounds or not found:
            break

        before = count
        for j in range(n):
            # either side on its own: holding others may drive a torque past the other side
            which = j if torque[j] > 0.0 else n + j
            if abs(torque[j]) > joints[j, 2] + KEPT and not held[which]:
                held[which] = True
                row, sign = rows[count], math.copysign(1.0, torque[j])
                over = torque_row(j, mass, bias, base, local, shares, spring, row)
                for k in range(size):
                    row[k] *= -sign
                substitute(U, row)
                lack[count] = -joints[j, 2] + sign * over - (row * free).sum()
                count += 1
        for side in range(2):
            if shares[side] == 0.0:
                continue
            for limit in range(_SOLE_ROWS):
                part, sign = parts[limit // 2], -1.0 if limit % 2 == 0 else 1.0
                slack = half[part] * wrenches[side, 2] + sign * wrenches[side, part]
                which = 2 * n + side * _SOLE_ROWS + limit
                if slack < -KEPT and not held[which]:
                    held[which] = True
                    row, limited = rows[count], np.zeros((2, 6))
                    limited[side, 2], limited[side, part] = half[part], sign
                    row[:] = 0.0
                    over = wrench_row(limited, bias, base, local, shares, spring, row)
                    substitute(U, row)
                    lack[count] = -over - (row * free).sum()
                    count += 1
        if count == before:
            break

    if count > 0:
        # what is held gives way a little; the rest is cut off
        cut(wrenches, half)
        torques(mass, bias, local, shares, wrenches, x, torque)
    for j in range(n):
        most = joints[j, 2]
        # so that NaN is not taken for an answer
        if not abs(torque[j]) <= most:
            found = found and abs(torque[j]) < math.inf
            torque[j] = math.copysign(most, torque[j])
    return found, x, wrenches, torque, shares


@compiled
def torque_row(
    joint: int, mass: Array, bias: Array, base: Array, local: Array, shares: Array, spring: Array, row: Array
) -> float:
    """Write by what row (6 + n,) a joint's torque follows from the motion; returns the torque without motion [N m]."""
    for k in range(len(row)):
        row[k] = mass[6 + joint, k] if 6 + joint <= k else mass[k, 6 + joint]
    over = bias[6 + joint]
    if shares[0] + shares[1] > 0.0:
        parts = -local[:, :, 6 + joint]
        over += wrench_row(parts, bias, base, local, shares, spring, row)
    return over


@compiled
def wrench_row(parts: Array, bias: Array, base: Array, local: Array, shares: Array, spring: Array, row: Array) -> float:
    """Add to a row (6 + n,) how parts (2, 6) times the soles' wrenches follow; returns their sum without motion."""
    u, over = by_base(local, shares, spring, parts), 0.0
    for i in range(6):
        over += u[i] * bias[i]
        for k in range(len(row)):
            row[k] += u[i] * base[i, k]
    return over


@compiled
def cut(wrenches: Array, half: Array) -> None:
    """Cut what is beyond friction and the soles' edges off their wrenches (2, 6)."""
    for side in range(2):
        force = max(wrenches[side, 2], 0.0) if wrenches[side, 2] == wrenches[side, 2] else wrenches[side, 2]
        wrenches[side, 2] = force
        for part in (0, 1, 3, 4):
            most = half[part] * force
            value = wrenches[side, part]
            if value > most:
                wrenches[side, part] = most
            elif value < -most:
                wrenches[side, part] = -most


@compiled
def torques(mass: Array, bias: Array, local: Array, shares: Array, wrenches: Array, x: Array, torque: Array) -> None:
    """Write the joint torques (n,) of a motion (6 + n,) under the soles' wrenches: M x + h - J'F."""
    n = len(torque)
    for j in range(n):
        torque[j] = bias[6 + j]
    for j in range(n):
        total, known = 0.0, x[6 + j]
        for k in range(6 + j):
            total += mass[k, 6 + j] * x[k]
        for k in range(j):
            torque[k] += mass[6 + k, 6 + j] * known
        torque[j] += total + mass[6 + j, 6 + j] * known
    for side in range(2):
        if shares[side] > 0.0:
            for k in range(6):
                for j in range(n):
                    torque[j] -= local[side, k, 6 + j] * wrenches[side, k]
