"""Kinematics and momentum of a tree of bodies: what pinocchio computes, in one compiled call."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.geometry.rotation import from_quaternion

Array = NDArray[np.float64]
Records = NDArray[np.void]
Record = Any

BODY = np.dtype(
    [
        ("parent", np.int64),
        ("place", np.float64, 3),
        ("turned", np.float64, (3, 3)),
        ("axis", np.float64, 3),
        ("mass", np.float64),
        ("com", np.float64, 3),
        ("inertia", np.float64, (3, 3)),
    ]
)
"""A body of a tree, which hangs on its parent by a hinge; the first one floats, and each comes after its parent.

parent: index of the body that it hangs on.
place: (3,) of the hinge in the parent's frame [m].
turned: (3, 3) of the body's frame, which turns with the hinge, at angle 0.
axis: (3,) of the hinge, in the body's frame.
mass: [kg].
com: (3,) in the body's frame [m].
inertia: (3, 3) about the COM in the body's frame [kg m^2]."""

SOLE = np.dtype([("body", np.int64), ("place", np.float64, 3), ("turned", np.float64, (3, 3))])
"""A sole: the index of its body, and its frame in that body's."""

MOTION = np.dtype([("R", np.float64, (3, 3)), ("p", np.float64, 3), ("w", np.float64, 3), ("v", np.float64, 3)])
"""How a frame moves: its axes (3, 3) and origin [m], its angular velocity [rad/s], and that of its origin [m/s]."""


@compiled
def move(bodies: Records, configuration: Array, velocity: Array, motions: Records) -> None:
    """Where all bodies are and how they move, in the world.

    Args:
        bodies: (b,) of `BODY`.
        configuration, velocity: (7 + n,) and (6 + n,) as in `Observation`; joint i moves body i + 1.
        motions: (b,) of `MOTION`; written.
    """
    base = motions[0]
    base.R[:] = from_quaternion(configuration[3:7])
    for k in range(3):
        base.p[k] = configuration[k]
        base.v[k] = velocity[k]
        base.w[k] = base.R[k, 0] * velocity[3] + base.R[k, 1] * velocity[4] + base.R[k, 2] * velocity[5]
    rest = np.empty((3, 3))
    for i in range(1, len(bodies)):
        body, moved = bodies[i], motions[i]
        on = motions[body.parent]
        _product(on.R, body.turned, rest)
        axis = body.axis
        _turn_about(rest, axis, configuration[6 + i], moved.R)
        _ride(on, body.place, moved.p, moved.v)
        for k in range(3):
            along = moved.R[k, 0] * axis[0] + moved.R[k, 1] * axis[1] + moved.R[k, 2] * axis[2]
            moved.w[k] = on.w[k] + velocity[5 + i] * along


@compiled
def hang(
    bodies: Records, soles: Records, configuration: Array, velocity: Array, motions: Records, found: Records
) -> None:
    """Move the bodies and the soles on them.

    Args:
        bodies: (b,) of `BODY`.
        soles: (2,) of `SOLE`.
        configuration, velocity: as of `move`.
        motions: (b,) of `MOTION` of the bodies; written.
        found: (2,) of `MOTION` of the soles; written.
    """
    move(bodies, configuration, velocity, motions)
    for side in range(len(soles)):
        sole, motion = soles[side], found[side]
        on = motions[sole.body]
        _product(on.R, sole.turned, motion.R)
        _ride(on, sole.place, motion.p, motion.v)
        motion.w[:] = on.w


@compiled
def momentum(bodies: Records, motions: Records, found: Array) -> None:
    """COG [m], its velocity [m/s], and angular momentum about it [N m s]: rows of `found` (3, 3), written.

    Args:
        bodies: (b,) of `BODY`.
        motions: (b,) of `MOTION`, by `move`.
        found: written.
    """
    count = len(bodies)
    at, moves = np.empty((count, 3)), np.empty((count, 3))
    found[:] = 0.0
    total = 0.0
    for i in range(count):
        _ride(motions[i], bodies[i].com, at[i], moves[i])
        mass = bodies[i].mass
        total += mass
        for k in range(3):
            found[0, k] += mass * at[i, k]
            found[1, k] += mass * moves[i, k]
    for k in range(3):
        found[0, k] /= total
        found[1, k] /= total
    own, spin = np.empty(3), np.empty(3)
    for i in range(count):
        mass, I, R, w = bodies[i].mass, bodies[i].inertia, motions[i].R, motions[i].w  # noqa: E741 - as in the books
        x, y, z = at[i, 0] - found[0, 0], at[i, 1] - found[0, 1], at[i, 2] - found[0, 2]
        vx, vy, vz = moves[i, 0] - found[1, 0], moves[i, 1] - found[1, 1], moves[i, 2] - found[1, 2]
        for k in range(3):
            own[k] = R[0, k] * w[0] + R[1, k] * w[1] + R[2, k] * w[2]
        for k in range(3):
            spin[k] = I[k, 0] * own[0] + I[k, 1] * own[1] + I[k, 2] * own[2]
        found[2, 0] += mass * (y * vz - z * vy) + R[0, 0] * spin[0] + R[0, 1] * spin[1] + R[0, 2] * spin[2]
        found[2, 1] += mass * (z * vx - x * vz) + R[1, 0] * spin[0] + R[1, 1] * spin[1] + R[1, 2] * spin[2]
        found[2, 2] += mass * (x * vy - y * vx) + R[2, 0] * spin[0] + R[2, 1] * spin[1] + R[2, 2] * spin[2]


@compiled
def _product(A: Array, B: Array, found: Array) -> None:
    """Write A @ B, all (3, 3)."""
    for i in range(3):
        for j in range(3):
            found[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled
def _turn_about(rest: Array, axis: Array, angle: float, turned: Array) -> None:
    """Write a frame (3, 3) turned about an axis (3,) of its own by an angle [rad]."""
    x, y, z = axis[0], axis[1], axis[2]
    s, c = math.sin(angle), math.cos(angle)
    d = 1.0 - c
    r00, r01, r02 = c + d * x * x, d * x * y - s * z, d * x * z + s * y
    r10, r11, r12 = d * x * y + s * z, c + d * y * y, d * y * z - s * x
    r20, r21, r22 = d * x * z - s * y, d * y * z + s * x, c + d * z * z
    for a in range(3):
        f, g, h = rest[a, 0], rest[a, 1], rest[a, 2]
        turned[a, 0] = f * r00 + g * r10 + h * r20
        turned[a, 1] = f * r01 + g * r11 + h * r21
        turned[a, 2] = f * r02 + g * r12 + h * r22


@compiled
def _ride(frame: Record, arm: Array, at: Array, moves: Array) -> None:
    """Write place [m] and velocity [m/s], (3,) each, of a point that is `arm` (3,) from the origin of a frame."""
    R, p, w, v = frame.R, frame.p, frame.w, frame.v
    x = R[0, 0] * arm[0] + R[0, 1] * arm[1] + R[0, 2] * arm[2]
    y = R[1, 0] * arm[0] + R[1, 1] * arm[1] + R[1, 2] * arm[2]
    z = R[2, 0] * arm[0] + R[2, 1] * arm[1] + R[2, 2] * arm[2]
    at[0], at[1], at[2] = p[0] + x, p[1] + y, p[2] + z
    moves[0] = v[0] + w[1] * z - w[2] * y
    moves[1] = v[1] + w[2] * x - w[0] * z
    moves[2] = v[2] + w[0] * y - w[1] * x
