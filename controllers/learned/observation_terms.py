"""The terms that a policy's observation is made of: what each reads, its scale, its limits and its past."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, PlainValidator, model_validator

from controllers.fields import Strict, conflict
from controllers.interface import Observation
from controllers.learned.joint_values import index_of, is_number
from controllers.shown import ObservationTerm
from models.errors import InputError

Array = NDArray[np.float64]
Name = Literal[
    "base_linear_velocity",
    "base_angular_velocity",
    "projected_gravity",
    "command",
    "joint_position",
    "joint_velocity",
    "last_action",
    "phase",
    "phase_cos",
    "phase_sin",
]
_OF_JOINTS = ("joint_position", "joint_velocity")
PHASES = ("phase", "phase_cos", "phase_sin")
"""Terms that need a gait."""
_LONGEST = 1000  # questions


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """What the terms are read off.

    Attributes:
        observation: what the robot is seen to do.
        rotation: (3, 3) of the base into the world.
        pose: (n,) the robot's joints in the default pose [rad].
        command: (3,) vx, vy [m/s], wz [rad/s].
        action: (a,) the last answer.
        phase: (p,) of the gait [rad].
    """

    observation: Observation
    rotation: Array
    pose: Array
    command: Array
    action: Array
    phase: Array


_READ: dict[str, Callable[[View], Array]] = {
    "base_linear_velocity": lambda view: view.rotation.T @ view.observation.velocity[:3],
    "base_angular_velocity": lambda view: view.observation.velocity[3:6],
    "projected_gravity": lambda view: -view.rotation[2],
    "command": lambda view: view.command,
    "joint_position": lambda view: view.observation.configuration[7:] - view.pose,
    "joint_velocity": lambda view: view.observation.velocity[6:],
    "last_action": lambda view: view.action,
    "phase": lambda view: np.concatenate((np.cos(view.phase), np.sin(view.phase))),
    "phase_cos": lambda view: np.cos(view.phase),
    "phase_sin": lambda view: np.sin(view.phase),
}


def _numbers(value: Any) -> float | tuple[float, ...]:
    if is_number(value):
        return float(value)
    if isinstance(value, list | tuple) and value and all(map(is_number, value)):
        return tuple(map(float, value))
    raise ValueError("is neither a number nor a list of numbers")


def _limits(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    low, high = (-value, value) if is_number(value) else value if _is_pair(value) else (0, 0)
    if not low < high:
        raise ValueError("is neither a number above 0 nor a list of two, [least, greatest]")
    return float(low), float(high)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(is_number, value))


Limits = Annotated[tuple[float, float] | None, PlainValidator(_limits)]
"""Least and greatest value; a number is that to either side of 0."""
Joints = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]


class TermOptions(Strict):
    """One term; a name alone is a term with nothing else said.

    Attributes:
        name: what is read.
        scale: that it is multiplied with: a number, or one for each of its numbers.
        clip: limits of the scaled values.
        history: how many questions back it reaches, this one counted.
        joints: of a term of joints: which, in this order; None for those of the action.
        zero: of a term of joints: those that read 0 whatever they do.
    """

    name: Name
    scale: Annotated[float | tuple[float, ...], PlainValidator(_numbers)] = 1.0
    clip: Limits = None
    history: int = Field(default=1, ge=1, le=_LONGEST)
    joints: Joints | None = None
    zero: Joints | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        for field in ("joints", "zero"):
            if getattr(self, field) is not None and self.name not in _OF_JOINTS:
                raise conflict(field, f"{self.name!r} is not of joints; it must not be given")
        return self


Terms = Annotated[
    tuple[Annotated[TermOptions, BeforeValidator(lambda one: {"name": one} if isinstance(one, str) else one)], ...],
    Field(strict=False, min_length=1),
]


class ObservationVector:
    """The terms side by side, as the network is given them.

    Attributes:
        terms: for those who look at them.
        size: how many numbers they are.
    """

    def __init__(
        self,
        options: Sequence[TermOptions],
        *,
        joints: tuple[str, ...],
        action: tuple[str, ...],
        phases: int,
        stack: Literal["terms", "frames"],
        newest_first: bool,
    ) -> None:
        """Lay the terms out.

        Args:
            options: of the terms, in order.
            joints: of the robot.
            action: the joints of the action.
            phases: how many the gait has.
            stack: whether each term's past follows it, or all terms of one question those of another.
            newest_first: whether the past runs backwards.

        Raises:
            InputError: if a term names joints that there are not, or has a wrong number of scales, or not all terms of
                frames reach back equally far.
        """
        field = "controller.observation"
        self._parts = [_Term(one, joints, action, phases, f"{field}[{i}]") for i, one in enumerate(options)]
        self._newest_first = newest_first
        self.size = sum(part.size * part.history for part in self._parts)
        if stack == "frames" and len({part.history for part in self._parts}) > 1:
            raise InputError(f"{field}: of frames that are stacked, all terms must have one history")
        self._places = self._laid_out(stack)
        self.terms = tuple(
            ObservationTerm(
                name=part.name,
                components=tuple(f"{one}{_back(age)}" for age in self._ages(part) for one in part.components),
                places=np.concatenate(places),
                clip=part.clip,
            )
            for part, places in zip(self._parts, self._places, strict=True)
        )

    def _ages(self, part: _Term) -> range:
        """How many questions ago each of a term's values was seen, in the order of the input."""
        return range(part.history) if self._newest_first else range(part.history - 1, -1, -1)

    def _laid_out(self, stack: Literal["terms", "frames"]) -> list[list[NDArray[np.intp]]]:
        """Where each value of each term stands, by term and age."""
        order = [(i, j) for i, part in enumerate(self._parts) for j in range(part.history)]
        if stack == "frames":
            order.sort(key=lambda place: place[1])
        found: dict[tuple[int, int], NDArray[np.intp]] = {}
        begin = 0
        for i, j in order:
            found[i, j] = np.arange(begin, begin + self._parts[i].size)
            begin += self._parts[i].size
        return [[found[i, j] for j in range(part.history)] for i, part in enumerate(self._parts)]

    def reset(self) -> None:
        """Forget the past."""
        for part in self._parts:
            part.past.clear()

    def see(self, view: View) -> Array:
        """The network's input (size,) at a question."""
        result = np.empty(self.size)
        for part, places in zip(self._parts, self._places, strict=True):
            part.see(view)
            for age, where in zip(self._ages(part), places, strict=True):
                result[where] = part.past[-1 - age]
        return result

    def sizes(self) -> str:
        """Each term with how many numbers it is, in words."""
        return ", ".join(
            f"{part.name} {part.size}" + (f" x {part.history}" if part.history > 1 else "") for part in self._parts
        )


class _Term:
    """A term with its past.

    Attributes:
        name, clip, history: as of its options.
        components: what each of its numbers is.
        past: (size,) values of the last questions, the oldest first.
    """

    def __init__(
        self, options: TermOptions, joints: tuple[str, ...], action: tuple[str, ...], phases: int, field: str
    ) -> None:
        self.name, self.clip, self.history = options.name, options.clip, options.history
        self.past: deque[Array] = deque(maxlen=self.history)
        self._read = _READ[options.name]
        self._joints: NDArray[np.intp] | None = None
        self.components = _components(options.name, action, phases)
        if options.name in _OF_JOINTS:
            self.components = options.joints or action
            self._joints = index_of(self.components, joints, f"{field}.joints")
        if isinstance(options.scale, tuple) and len(options.scale) != self.size:
            raise InputError(f"{field}.scale: has {len(options.scale)} numbers; {self.name!r} has {self.size}")
        self._scale = np.array(options.scale)
        self._zero = index_of(options.zero or (), self.components, f"{field}.zero")

    @property
    def size(self) -> int:
        return len(self.components)

    def see(self, view: View) -> None:
        values = self._read(view)
        values = (values if self._joints is None else values[self._joints]) * self._scale
        values[self._zero] = 0.0
        if self.clip is not None:
            values = np.clip(values, *self.clip)
        # Before there is a past, it is as if things had always been so.
        self.past.extend([values] * (1 if self.past else self.history))


def _components(name: str, action: tuple[str, ...], phases: int) -> tuple[str, ...]:
    if name == "last_action":
        return action
    if name == "command":
        return ("vx", "vy", "wz")
    if name in PHASES:
        which = ("cos", "sin") if name == "phase" else (name.removeprefix("phase_"),)
        return tuple(f"{one} {i + 1}" for one in which for i in range(phases))
    return ("x", "y", "z")


def _back(age: int) -> str:
    return f" ({age} back)" if age else ""
