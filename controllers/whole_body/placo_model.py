"""The robot in placo: the same body as in MuJoCo, and the differences between the two libraries."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import placo
from numpy.typing import NDArray

from controllers.compiled import compiled
from controllers.multibody.torque_kernel import FRICTION_SPEED
from models.robot import Robot

Array = NDArray[np.float64]


class PlacoModel:
    """The compiled robot in placo, kept at the measured state.

    MuJoCo and placo (pinocchio) differ in the order of the quaternion and in the frame of the base's linear
    velocity; only this class knows.
    """

    def __init__(self, robot: Robot) -> None:
        # placo reads MJCF from files only, and stumbles over what a robot's own file may do, such as <include>.
        with _quiet_stdout(), TemporaryDirectory() as folder:
            path = Path(folder) / "flat.xml"
            path.write_text(robot.flat, encoding="utf-8")
            self.wrapper = placo.RobotWrapper(str(path), placo.Flags.mjcf + placo.Flags.ignore_collisions)
        names = list(self.wrapper.joint_names())
        if tuple(names) != robot.joint_names:
            raise AssertionError("placo and MuJoCo must list the joints in the same order")
        self._q = self.wrapper.state.q.copy()
        self._qd = self.wrapper.state.qd.copy()

    def set_state(self, configuration: Array, velocity: Array) -> None:
        """Take over a configuration and velocity in MuJoCo's order (see `Observation`)."""
        in_placo_order(configuration, velocity, self._q, self._qd)
        state = self.wrapper.state
        state.q, state.qd = self._q, self._qd
        self.wrapper.update_kinematics()


@compiled
def in_placo_order(configuration: Array, velocity: Array, q: Array, qd: Array) -> None:
    """Write a configuration (7 + n,) and velocity (6 + n,) of MuJoCo into those of placo and pinocchio, q and qd."""
    w, x, y, z = configuration[3], configuration[4], configuration[5], configuration[6]
    q[:] = configuration
    q[3], q[4], q[5], q[6] = x, y, z, w
    qd[:] = velocity
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    # columns of the rotation matrix of (w, x, y, z): world velocity seen in the base
    qd[0] = (1 - 2 * (y * y + z * z)) * vx + 2 * (x * y + w * z) * vy + 2 * (x * z - w * y) * vz
    qd[1] = 2 * (x * y - w * z) * vx + (1 - 2 * (x * x + z * z)) * vy + 2 * (y * z + w * x) * vz
    qd[2] = 2 * (x * z + w * y) * vx + 2 * (y * z - w * x) * vy + (1 - 2 * (x * x + y * y)) * vz


@dataclass(frozen=True, kw_only=True)
class BodyTasks:
    """What is asked of a body beside its feet: where its COG is, an upright trunk, and the pose of arms and head."""

    cog: Any
    trunk: Any
    posture: tuple[Any, ...]


def body_tasks(solver: Any, robot: Robot, *, cog: float, trunk: float, posture: Mapping[str, float]) -> BodyTasks:
    """Add the tasks to a solver of placo, with these weights, that of the posture by joint; 0 for joints without."""
    where = solver.add_com_task(np.zeros(3))
    where.configure("cog", "soft", cog)
    upright = solver.add_orientation_task("trunk", np.eye(3))
    upright.configure("trunk", "soft", trunk)
    stand = dict(zip(robot.joint_names, robot.stand[7:].tolist(), strict=True))
    poses = []
    for weight in sorted(set(posture.values()) - {0.0}):
        pose = solver.add_joints_task()
        pose.set_joints({name: stand[name] for name, own in posture.items() if own == weight})
        pose.configure(f"posture {weight}", "soft", weight)
        poses.append(pose)
    return BodyTasks(cog=where, trunk=upright, posture=tuple(poses))


def friction_torque(robot: Robot, speed: Array) -> Array:
    """Torque (n,) that overcomes the joints' friction at a speed (n,) [rad/s]; dry friction fades in with it."""
    # `motion_kernel.feed_forward` has its own copy, and says why
    torque: Array = robot.joint_damping * speed + robot.joint_friction * np.tanh(speed / FRICTION_SPEED)
    return torque


@contextlib.contextmanager
def _quiet_stdout() -> Iterator[None]:
    """placo announces each file on the process's standard output; keep that out of ours."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "wb") as sink:
        os.dup2(sink.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)
