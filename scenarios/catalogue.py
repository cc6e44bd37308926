"""Finding scenarios by name or path, and reading them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from controllers.gains import GainError
from controllers.pendulum import Pendulum
from models.errors import InputError
from scenarios.error_messages import first_error, near
from scenarios.files import find_file, read_toml, robot_beside, shipped_files
from scenarios.push import COG
from scenarios.schema import Scenario

if TYPE_CHECKING:
    from models.robot import Robot


def shipped() -> dict[str, Path]:
    """The scenarios that come with Okiagari: name -> file."""
    return shipped_files("scenario")


def find(name: str | Path) -> Path:
    """Find a scenario file.

    Args:
        name: a shipped scenario's name, or a path to a `.toml` file.

    Raises:
        InputError: if there is none; lists the names there are.
    """
    return find_file("scenario", name)


def load(name: str | Path, overrides: Mapping[str, Any] | None = None) -> Scenario:
    """Read and check a scenario.

    Args:
        name: a shipped scenario's name, or a path to a `.toml` file.
        overrides: top-level fields that replace the file's; files in them must be named by absolute paths.

    Raises:
        InputError: if it cannot be read or says something that is not allowed; one line that names file, field,
            value and what is allowed.
    """
    path = find(name)
    _, fields = read_toml(path)
    if isinstance(fields.get("robot"), str):
        fields["robot"] = robot_beside(path, fields["robot"])
    try:
        return Scenario.model_validate(fields | dict(overrides or {}), context={"folder": path.parent})
    except ValidationError as error:
        raise InputError(f"{path}: {first_error(error, Scenario)}") from None


def check_against(scenario: Scenario, robot: Robot, *, source: str = "scenario") -> None:
    """Check what only the robot can tell.

    Args:
        scenario: the scenario.
        robot: the robot it names.
        source: what to call the scenario in the message; its file.

    Raises:
        InputError: if the gain cannot be used, a push acts on a body that does not exist, a step is longer than the
            legs, a margin leaves nothing of the sole, or the pendulum is pushed up or down.
    """
    try:
        scenario.gain.of(Pendulum(robot.omega, scenario.timing.control))
    except GainError as error:
        raise InputError(f"{source}: gain: {error}") from None
    for i, push in enumerate(scenario.pushes):
        bodies = (*robot.body_names, COG)
        if push.body not in bodies:
            raise InputError(
                f"{source}: pushes[{i}].body: {robot.name} has no body {push.body!r}"
                f"{near(push.body, bodies)}; allowed: {', '.join(bodies)}"
            )
        if scenario.world == "pendulum" and push.vector is not None and push.vector[2]:
            raise InputError(
                f"{source}: pushes[{i}].vector: {list(push.vector)} is not horizontal; the pendulum's height is fixed"
            )
    stepping = scenario.stepping
    for field in ("max_stride", "swing_height"):
        length = getattr(stepping, field)
        if length > robot.leg_length:
            raise InputError(
                f"{source}: stepping.{field}: {length!r} m is longer than {robot.name}'s legs, {robot.leg_length:.3g} m"
            )
    room = 0.5 * robot.sole_width - stepping.zmp_margin
    if 2 * stepping.zmp_error >= room > 0.0:
        raise InputError(
            f"{source}: stepping.zmp_error: {stepping.zmp_error!r} m leaves nothing of {robot.name}'s sole, which is "
            f"{robot.sole_width:.3g} m wide, and {stepping.zmp_margin:g} m of it are margin; "
            f"it must be below {0.5 * room:.3g} m"
        )
    if 2 * stepping.zmp_margin >= robot.sole_width:
        raise InputError(
            f"{source}: stepping.zmp_margin: {stepping.zmp_margin!r} m leaves nothing of {robot.name}'s sole, "
            f"which is {robot.sole_width:.3g} m wide; it must be below {robot.sole_width / 2:.3g} m"
        )
