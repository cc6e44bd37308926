"""The controller `onnx`: a trained policy from an ONNX file that moves the joints itself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from controllers.fields import File, NotNegative, Strict, Vector, conflict
from controllers.geometry.rotation import from_quaternion
from controllers.interface import JointTargets, Observation, Setting
from controllers.learned.joint_values import JointValues, index_of, per_joint
from controllers.learned.network import Network
from controllers.learned.observation_terms import PHASES, Joints, Limits, ObservationVector, Terms, View
from models.errors import InputError

Array = NDArray[np.float64]

_MOST_PHASES = 8


class Gait(Strict):
    """Clock of a gait.

    Attributes:
        frequency: of a cycle [Hz].
        offsets: phases at the beginning [rad], for instance one for each foot.
        standing: what all phases are while the command is zero [rad]; None lets them run.
    """

    frequency: NotNegative
    offsets: Annotated[tuple[float, ...], Field(strict=False, min_length=1, max_length=_MOST_PHASES)] = (0.0, math.pi)
    standing: float | None = None

    def phase(self, time: float, *, still: bool) -> Array:
        """(p,) phases at a time since the beginning [s]; `still` while the command is zero [rad]."""
        if still and self.standing is not None:
            return np.full(len(self.offsets), self.standing)
        return np.array(self.offsets) + 2.0 * math.pi * self.frequency * time


class OnnxPolicy:
    """Asks a network at its own rate, and gives the servos `default pose + scale x action` until the next question.

    Attributes:
        period: time between two questions [s].
        observation_terms, last_input, last_action: see `controllers.shown.ShowsObservation`.
    """

    label, colour, marker = "policy", "#8e44ad", "P"
    libraries = ("onnxruntime",)

    class Options(Strict):
        """Options of a trained policy; lists that are of joints are in the order of `action_joints`.

        Attributes:
            policy: its ONNX file: one input, one output, no state.
            observation: the terms of its input, in order.
            stack: whether each term's past follows it ("terms"), or all terms of one question come together ("frames").
            newest_first: whether the past runs backwards.
            action_joints: the joints that its output is of, in order; None for all of the robot's, in its order. The
                others stay in the default pose.
            action_scale: from its output to angles [rad].
            action_clip: limits of its output, before the scale.
            default_pose: angles at an output of zero [rad]: the keyframe "stand", or a number a joint; joints that are
                left out are as in "stand".
            period: time between two questions [s].
            stiffness, damping: of the servos [N m/rad], [N m s/rad]; None, and joints that are left out, as in the
                robot's file.
            gait: the clock behind the terms `phase`, `phase_cos` and `phase_sin`.
            command: vx, vy [m/s] and wz [rad/s].
        """

        policy: File
        observation: Terms
        stack: Literal["terms", "frames"] = "terms"
        newest_first: bool = False
        action_joints: Joints | None = None
        action_scale: JointValues = 1.0
        action_clip: Limits = None
        default_pose: Literal["stand"] | JointValues = "stand"
        period: float = Field(default=0.02, gt=0)
        stiffness: JointValues | None = None
        damping: JointValues | None = None
        gait: Gait | None = None
        command: Vector = (0.0, 0.0, 0.0)

        @model_validator(mode="after")
        def _has_a_clock(self) -> Self:
            asked = [term.name for term in self.observation if term.name in PHASES]
            if asked and self.gait is None:
                raise conflict("gait", f"is missing; the term {asked[0]!r} needs it")
            return self

    def __init__(self, setting: Setting, options: Options) -> None:
        """Read the network, and check that it fits the terms and the joints.

        Raises:
            InputError: if it does not, or names what the robot does not have.
        """
        robot, joints = setting.robot, setting.robot.joint_names
        action = joints if options.action_joints is None else options.action_joints
        self.period, self._gait, self._clip = options.period, options.gait, options.action_clip
        self._joints = index_of(action, joints, "controller.action_joints")
        stand, none = robot.stand[7:], np.full(len(joints), math.nan)
        scale = per_joint(options.action_scale, joints, self._joints, none, "controller.action_scale")[self._joints]
        if np.isnan(scale).any():
            lacking = action[int(np.isnan(scale).argmax())]
            raise InputError(f"controller.action_scale: gives none for {lacking!r}, which the action moves")
        self._scale = scale
        pose = options.default_pose
        self._pose = (
            stand if pose == "stand" else per_joint(pose, joints, self._joints, stand, "controller.default_pose")
        )
        self._stiffness = self._gain("stiffness", options.stiffness, robot.servo_stiffness, joints)
        self._damping = self._gain("damping", options.damping, robot.servo_damping, joints)
        self._command, self._zero = np.array(options.command), np.zeros(len(joints))
        phases = 0 if options.gait is None else len(options.gait.offsets)
        self._vector = ObservationVector(
            options.observation,
            joints=joints,
            action=tuple(action),
            phases=phases,
            stack=options.stack,
            newest_first=options.newest_first,
        )
        self.observation_terms = self._vector.terms
        self._network = self._checked(Network(Path(options.policy), "controller.policy"), Path(options.policy).name)
        self.reset(0)

    def _gain(self, name: str, given: object, rest: Array, joints: tuple[str, ...]) -> Array | None:
        if given is None:
            return None
        gains = per_joint(given, joints, self._joints, rest, f"controller.{name}")  # type: ignore[arg-type]
        if (gains < 0.0).any():
            raise InputError(f"controller.{name}: {float(gains.min()):g} is not allowed; it must be >= 0")
        return gains

    def _checked(self, network: Network, name: str) -> Network:
        """The network, if what goes in and comes out is of the right size."""
        size, count = self._vector.size, len(self._joints)
        if network.inputs not in (None, size):
            raise InputError(
                f"controller.observation: the terms are {size} numbers, and {name!r} takes {network.inputs}: "
                f"{self._vector.sizes()}"
            )
        given = len(network(np.zeros(size)))
        if given != count:
            raise InputError(
                f"controller.action_joints: are {count}, and {name!r} answers {given} numbers to {size}: "
                f"{self._vector.sizes()}"
            )
        return network

    def reset(self, seed: int) -> None:
        """Forget the last episode; nothing is drawn."""
        self._asked = 0
        self._vector.reset()
        self.last_input, self.last_action = np.zeros(self._vector.size), np.zeros(len(self._joints))

    def targets(self, observation: Observation) -> JointTargets:
        """Ask the network."""
        still = not self._command.any()
        time = self._asked * self.period
        phase = np.empty(0) if self._gait is None else self._gait.phase(time, still=still)
        self.last_input = self._vector.see(
            View(
                observation=observation,
                rotation=from_quaternion(observation.configuration[3:7]),
                pose=self._pose,
                command=self._command,
                action=self.last_action,
                phase=phase,
            )
        )
        self._asked += 1
        answer = self._network(self.last_input)
        self.last_action = answer if self._clip is None else np.clip(answer, *self._clip)
        position = self._pose.copy()
        position[self._joints] += self._scale * self.last_action
        return JointTargets(
            position=position,
            velocity=self._zero,
            torque=self._zero,
            stiffness=self._stiffness,
            damping=self._damping,
        )
