"""Options that give a number a joint: one for all, a list, or a table by the joints' names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import PlainValidator

from models.errors import InputError

Array = NDArray[np.float64]
Values = float | tuple[float, ...] | dict[str, float]


def is_number(value: Any) -> bool:
    """Whether a value of a file is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _values(value: Any) -> Values:
    if is_number(value):
        return float(value)
    if isinstance(value, list | tuple) and value and all(map(is_number, value)):
        return tuple(map(float, value))
    if isinstance(value, dict) and value and all(map(is_number, value.values())):
        return {str(name): float(one) for name, one in value.items()}
    raise ValueError("is neither a number, nor a list of numbers, nor a table of joint = number")


JointValues = Annotated[Values, PlainValidator(_values)]
"""A number, a list in the order of the action's joints, or a table: joint, or pattern with * and ? -> number."""


def index_of(names: tuple[str, ...], joints: tuple[str, ...], field: str) -> NDArray[np.intp]:
    """(m,) where in the robot's joints some of them are.

    Args:
        names: the joints that are looked for.
        joints: of the robot, in its order.
        field: of the scenario, for messages.

    Raises:
        InputError: if the robot lacks one, or it is named twice.
    """
    for name in names:
        if name not in joints:
            raise InputError(f"{field}: {name!r} is no joint of the robot{_hint(name, joints)}")
        if names.count(name) > 1:
            raise InputError(f"{field}: names {name!r} twice")
    return np.array([joints.index(name) for name in names], dtype=np.intp)


def per_joint(values: Values, joints: tuple[str, ...], action: NDArray[np.intp], rest: Array, field: str) -> Array:
    """A number for each joint of the robot, (n,).

    Args:
        values: as the scenario gives them.
        joints: names of the robot's joints.
        action: (a,) index of the joints that a list is of.
        rest: (n,) of the joints that list or table leave out.
        field: of the scenario, for messages.

    Raises:
        InputError: if a list has another length, or a table names no joint, or one joint by two patterns.
    """
    result = np.array(rest, dtype=np.float64)
    if isinstance(values, float):
        result[:] = values
    elif isinstance(values, tuple):
        if len(values) != len(action):
            raise InputError(f"{field}: has {len(values)} numbers; the action is of {len(action)} joints")
        result[action] = values
    else:
        _fill(result, values, joints, field)
    return result


def _fill(result: Array, table: Mapping[str, float], joints: tuple[str, ...], field: str) -> None:
    """Put the numbers of a table where they belong: a joint's own name counts more than a pattern."""
    found: dict[str, str] = {}
    for pattern in (name for name in table if name not in joints):
        matched = [joint for joint in joints if fnmatchcase(joint, pattern)]
        if not matched:
            raise InputError(
                f"{field}: {pattern!r} is no joint of the robot, nor a pattern of any{_hint(pattern, joints)}"
            )
        for joint in matched:
            # A table has no order that files keep, so that two patterns must not be at odds.
            if joint not in table and found.setdefault(joint, pattern) != pattern:
                raise InputError(f"{field}: both {found[joint]!r} and {pattern!r} are patterns of {joint!r}")
            result[joints.index(joint)] = table[pattern]
    for joint in joints:
        if joint in table:
            result[joints.index(joint)] = table[joint]


def _hint(name: str, joints: tuple[str, ...]) -> str:
    close = get_close_matches(name, joints, n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; they are {', '.join(joints)}"
