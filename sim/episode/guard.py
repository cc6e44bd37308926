"""What a controller answers is checked: one line names the controller, the tick and the field that is wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Real
from typing import Any, NoReturn

import numpy as np

from controllers.interface import BalanceCommand, FootReference, FootState, JointTargets, Observation
from models.arena import SIDES
from models.errors import InputError, OkiagariError, with_kind

_FOOT = ("position", "velocity", "acceleration")


class Guard:
    """Checks the answers of one controller or layer."""

    def __init__(self, who: str, *, foreign: bool) -> None:
        """Stand beside a controller.

        Args:
            who: what to call it in messages.
            foreign: whether what it raises is told in one line; else it is passed on, with its traceback.
        """
        self._who, self._foreign = who, foreign

    def ask(self, call: Callable[..., Any], tick: int, *arguments: Any) -> Any:
        """What a call returns.

        Raises:
            InputError: if it is foreign and raises.
        """
        try:
            return call(*arguments)
        except OkiagariError:
            raise
        except Exception as error:
            if not self._foreign:
                raise
            raise InputError(f"{self._who}: tick {tick}: {call.__name__}() raised {with_kind(error)}") from error

    def check_command(self, command: Any, tick: int, observation: Observation) -> BalanceCommand:
        """A command that can be carried out.

        Raises:
            InputError: if it is none, or has a wrong shape, no feet, or a number that is not finite.
        """
        if not isinstance(command, BalanceCommand):
            self._refuse(tick, "command", f"is {_kind(command)}; it must be a BalanceCommand")
        self._numbers(tick, "zmp", command.zmp, (2,), observation)
        if not isinstance(command.feet, dict) or set(command.feet) != set(SIDES):
            given = sorted(map(str, command.feet)) if isinstance(command.feet, dict) else _kind(command.feet)
            self._refuse(tick, "feet", f"are {given}; they must be a FootReference each for 'left' and 'right'")
        for side, foot in command.feet.items():
            if not isinstance(foot, FootReference):
                self._refuse(tick, f"feet[{side!r}]", f"is {_kind(foot)}; it must be a FootReference")
            if foot.stance:
                continue
            for name in _FOOT:
                self._numbers(tick, f"feet[{side!r}].{name}", getattr(foot, name), (3,), observation)
        return command

    def check_targets(self, targets: Any, tick: int, joints: int, observation: Observation) -> JointTargets:
        """Joint targets that the servos can take; see `check_command`."""
        if not isinstance(targets, JointTargets):
            self._refuse(tick, "targets", f"is {_kind(targets)}; it must be a JointTargets")
        for name in ("position", "velocity", "torque"):
            self._numbers(tick, name, getattr(targets, name), (joints,), observation)
        for name in ("stiffness", "damping"):
            if (gains := getattr(targets, name)) is not None:
                self._numbers(tick, name, gains, (joints,), observation)
        return targets

    def check_observation(self, seen: Any, tick: int, truth: Observation) -> Observation:
        """A state that controllers can be shown.

        Raises:
            InputError: if it is none, or has a wrong shape, no feet, or a number that is not finite; a ZMP may be NaN.
        """
        if not isinstance(seen, Observation):
            self._refuse(tick, "estimate", f"is {_kind(seen)}; it must be an Observation")
        for name in ("cog", "cog_velocity", "angular_momentum", "configuration", "velocity"):
            self._numbers(tick, name, getattr(seen, name), getattr(truth, name).shape, truth)
        if not isinstance(seen.feet, dict) or set(seen.feet) != set(SIDES):
            self._refuse(tick, "feet", "must be a FootState each for 'left' and 'right'")
        for side, foot in seen.feet.items():
            if not isinstance(foot, FootState):
                self._refuse(tick, f"feet[{side!r}]", f"is {_kind(foot)}; it must be a FootState")
            self._numbers(tick, f"feet[{side!r}].position", foot.position, (3,), truth)
            self._number(tick, f"feet[{side!r}].yaw", foot.yaw, truth)
            self._number(tick, f"feet[{side!r}].force", foot.force, truth)
        self._number(tick, "time", seen.time, truth)
        if not (isinstance(seen.zmp, np.ndarray) and seen.zmp.dtype == np.float64 and np.isnan(seen.zmp).all()):
            self._numbers(tick, "zmp", seen.zmp, (2,), truth)
        elif seen.zmp.shape != (2,):
            self._refuse(tick, "zmp", f"has shape {seen.zmp.shape}; it must be an array of shape (2,)")
        return seen

    def _number(self, tick: int, field: str, value: Any, observation: Observation) -> None:
        if not isinstance(value, Real) or isinstance(value, bool):
            self._refuse(tick, field, f"is {_kind(value)}; it must be a number")
        if not math.isfinite(value) and np.isfinite(observation.cog).all():
            self._refuse(tick, field, f"{value} is not finite")

    def _numbers(self, tick: int, field: str, value: Any, shape: tuple[int, ...], observation: Observation) -> None:
        if not isinstance(value, np.ndarray) or value.shape != shape:
            given = f"has shape {value.shape}" if isinstance(value, np.ndarray) else f"is {_kind(value)}"
            self._refuse(tick, field, f"{given}; it must be an array of shape {shape}")
        # A sum of squares is finite only of finite numbers, and takes a sixth of the time.
        if value.dtype == np.float64 and math.isfinite(value.dot(value)):
            return
        if not np.issubdtype(value.dtype, np.number):
            self._refuse(tick, field, f"is of {value.dtype}; it must be of numbers")
        # Nobody can answer a state that is not finite; the episode ends at it.
        if not np.isfinite(value).all() and np.isfinite(observation.cog).all():
            self._refuse(tick, field, f"{np.asarray(value).tolist()} is not finite")

    def _refuse(self, tick: int, field: str, why: str) -> NoReturn:
        raise InputError(f"{self._who}: tick {tick}: {field} {why}")


def _kind(value: Any) -> str:
    return "None" if value is None else f"of the type {type(value).__name__}"
