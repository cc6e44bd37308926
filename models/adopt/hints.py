"""What a file cannot say of a robot, and its user can: `robot.toml` beside the MJCF."""

from __future__ import annotations

import fnmatch
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from models.errors import InputError, one_line

HINTS = "robot.toml"

_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Motor(_Table):
    """What is known of a motor, at the joint; None for what the MJCF says or the servo's rule gives.

    Attributes:
        torque: at standstill [N m].
        speed: without load [rad/s].
        armature: inertia of the rotor, reflected [kg m^2].
        friction: dry friction [N m].
        damping: viscous friction [N m s/rad].
        stiffness, servo_damping: gains of the servo [N m/rad], [N m s/rad].
    """

    torque: _Positive | None = None
    speed: _Positive | None = None
    armature: _NotNegative | None = None
    friction: _NotNegative | None = None
    damping: _NotNegative | None = None
    stiffness: _Positive | None = None
    servo_damping: _NotNegative | None = None


class Hints(_Table):
    """What a user says of a robot.

    Attributes:
        name: of the robot; None for that of the file.
        keyframe: name of the pose that shows where the soles are; None for the first one, or the zero pose.
        stand: "bent": knees bent by a solver; "keyframe": the pose of `keyframe` as it is.
        bend: height of the hip as a share of a straight leg's, in the bent stand.
        left_foot, right_foot: bodies; None for those that carry the lowest contact geoms on either side.
        speed: no-load speed of motors for which nothing gives one [rad/s].
        servos: "rule": gains from torque and inertia; "file": those of the MJCF's own position servos.
        legs_collide: whether the legs can touch each other.
        weld: patterns of joints that are taken out, so that they stay as in the zero pose.
        motors: pattern of joints -> what is known of their motors; of several that match, the last one says.
    """

    name: str | None = Field(default=None, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")
    keyframe: str | None = None
    stand: Literal["bent", "keyframe"] = "bent"
    bend: float = Field(default=0.85, ge=0.5, le=0.98)
    left_foot: str | None = None
    right_foot: str | None = None
    speed: _Positive = 20.0
    servos: Literal["rule", "file"] = "rule"
    legs_collide: bool = True
    weld: tuple[str, ...] = ()
    motors: dict[str, Motor] = {}

    def motor(self, joint: str) -> Motor:
        """What is said of a joint's motor."""
        said: dict[str, float] = {}
        for pattern, motor in self.motors.items():
            if fnmatch.fnmatchcase(joint, pattern):
                said |= motor.model_dump(exclude_none=True)
        return Motor(**said)

    def check_patterns(self, field: Literal["weld", "motors"], joints: Iterable[str], where: str) -> None:
        """Refuse a pattern of a field that no joint's name matches.

        Raises:
            InputError: names the pattern and the joints there are.
        """
        names = list(joints)
        for pattern in self.weld if field == "weld" else self.motors:
            if not any(fnmatch.fnmatchcase(name, pattern) for name in names):
                raise InputError(f"{where}: {field}: {pattern!r} matches none of the joints {', '.join(names)}")


def read_hints(path: Path) -> Hints:
    """Read a file of hints.

    Raises:
        InputError: if it cannot be read, or a field is unknown or out of its bounds.
    """
    try:
        fields = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path}: not a TOML file: {one_line(error)}") from None
    try:
        return Hints.model_validate(fields)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(map(str, first["loc"]))
        allowed = (
            f"; the fields are {', '.join(_fields_at(first['loc']))}" if first["type"] == "extra_forbidden" else ""
        )
        raise InputError(f"{path}: {field}: {first['msg']}, not {first['input']!r}{allowed}") from None


def _fields_at(place: tuple[int | str, ...]) -> Iterable[str]:
    return Motor.model_fields if len(place) > 1 and place[0] == "motors" else Hints.model_fields
