"""Finding scenarios by name or path, and reading them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from controllers.fields import WHOLE
from controllers.gains import GainError
from controllers.pendulum import Pendulum
from controllers.registry import CONTROLLERS
from models.errors import InputError
from scenarios.choice import lacking
from scenarios.error_messages import first_error, near
from scenarios.files import find_file, read_toml, robot_beside, shipped_files
from scenarios.push import COG, FASTEST, Push
from scenarios.schema import Scenario

if TYPE_CHECKING:
    from models.robot import Robot


MEMORY = 2_000_000_000
"""Of the record of an episode, at most [byte]."""
CHANNELS = 60
"""At most so many numbers a control period, and three for each joint: its angle, torque and speed."""
_FIELDS = tuple(Scenario.model_fields)


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
        InputError: if an option that the controller needs is missing, the gain cannot be used, a push acts on a body
            that does not exist or is too large for the robot's mass, a step is longer than the legs or no whole number
            of control periods, a margin leaves nothing of the sole, the pendulum is pushed up or down or turned, or the
            record is larger than `MEMORY`.
    """
    if (option := lacking(scenario.controller, CONTROLLERS)) is not None:
        raise InputError(f"{source}: controller.{option}: is missing; {scenario.controller.short!r} needs it")
    _check_gain(scenario, robot, source)
    _check_pushes(scenario, robot, source)
    _check_steps(scenario, robot, source)
    _check_memory(scenario, robot, source)


def with_push(scenario: Scenario, push: Push, robot: Robot) -> tuple[Scenario, int]:
    """The same scenario with one push more.

    Args:
        scenario: as run so far.
        push: the new one; it comes after those that begin when it does.
        robot: the robot that the scenario names.

    Returns:
        The scenario, and the index of the push in it.

    Raises:
        InputError: if such a scenario is not allowed; one line that names field, value and what is allowed.
    """
    index = bisect_right([one.start for one in scenario.pushes], push.start)
    pushes = (*scenario.pushes[:index], push, *scenario.pushes[index:])
    try:
        longer = Scenario.model_validate({name: getattr(scenario, name) for name in _FIELDS} | {"pushes": pushes})
    except ValidationError as error:
        raise InputError(f"added push: {first_error(error, Scenario)}") from None
    _check_pushes(longer, robot, "added push")
    _check_memory(longer, robot, "added push")
    return longer, index


def _check_pushes(scenario: Scenario, robot: Robot, source: str) -> None:
    for i, push in enumerate(scenario.pushes):
        bodies = (*robot.body_names, COG)
        if push.body not in bodies:
            raise InputError(
                f"{source}: pushes[{i}].body: {robot.name} has no body {push.body!r}"
                f"{near(push.body, bodies)}; allowed: {', '.join(bodies)}"
            )
        if push.torque is not None:
            _check_torque(push, f"{source}: pushes[{i}]", scenario, robot)
            continue
        speed = float(np.linalg.norm(push.impulse_vector(robot.mass))) / robot.mass
        if speed > FASTEST * (1 + WHOLE):
            raise InputError(
                f"{source}: pushes[{i}].impulse: {push.impulse!r} N s gives {robot.name}'s {robot.mass:.3g} kg "
                f"{speed:.3g} m/s; at most {FASTEST:g} m/s are allowed"
            )
        if scenario.world == "pendulum" and push.vector is not None and push.vector[2]:
            raise InputError(
                f"{source}: pushes[{i}].vector: {list(push.vector)} is not horizontal; the pendulum's height is fixed"
            )


def _check_torque(push: Push, where: str, scenario: Scenario, robot: Robot) -> None:
    if scenario.world == "pendulum":
        raise InputError(
            f"{where}.torque: {push.torque_words}: the pendulum is a point, which no torque turns; give a force"
        )
    spin, most = float(np.linalg.norm(push.asked(robot.mass))), FASTEST * robot.mass * robot.cog_height
    if spin > most * (1 + WHOLE):
        raise InputError(
            f"{where}.torque: {push.torque_words} for {push.duration:g} s is {spin:.3g} N m s; at most "
            f"{most:.3g} N m s are allowed, which {FASTEST:g} m/s of {robot.name}'s mass at the height of its COG have "
            "about the floor"
        )


def _check_memory(scenario: Scenario, robot: Robot, source: str) -> None:
    columns = CHANNELS + 3 * len(robot.joint_names) + 6 * len(scenario.apart)
    most = MEMORY // (8 * columns)
    if scenario.ticks > most:
        raise InputError(
            f"{source}: duration: {scenario.duration!r} s of {scenario.timing.control!r} s a control period are "
            f"{scenario.ticks} rows of {columns} numbers; at most {most} rows, {MEMORY / 1e9:g} GB, are allowed"
        )


def _check_gain(scenario: Scenario, robot: Robot, source: str) -> None:
    """Refuse a gain that cannot be used, or, if the controller is one that has a gain, whose set cannot be computed."""
    pendulum = Pendulum(robot.omega, scenario.timing.control)
    try:
        gain = scenario.gain.of(pendulum)
        if "gain" in CONTROLLERS.entry(scenario.controller.name).options.model_fields:
            # Solvers and hulls are long to import, and reading a scenario does without.
            from controllers.admissible.gilbert_tan import MoaError
            from controllers.admissible.moa import regulator_set
            from controllers.geometry.support_polygon import standing_feet, support_polygon

            try:
                regulator_set(pendulum, gain, support_polygon([*standing_feet(robot).values()]))
            except MoaError as error:
                raise InputError(f"{source}: gain: {error}") from None
    except GainError as error:
        raise InputError(f"{source}: gain: {error}") from None


def _check_steps(scenario: Scenario, robot: Robot, source: str) -> None:
    stepping, control = scenario.stepping, scenario.timing.control
    steps = "stepping" in CONTROLLERS.entry(scenario.controller.name).options.model_fields
    for time in (stepping.step_times or ()) if steps else ():
        ticks = time / control
        if abs(ticks - round(ticks)) > WHOLE * max(1.0, ticks) or round(ticks) < 1:
            raise InputError(
                f"{source}: stepping.step_times: {time!r} s is no whole number of control periods, {control!r} s each"
            )
    for field in ("max_stride", "swing_height"):
        length = getattr(stepping, field)
        if length > robot.leg_length:
            raise InputError(
                f"{source}: stepping.{field}: {length!r} m is longer than {robot.name}'s legs, {robot.leg_length:.3g} m"
            )
    width = min(robot.sole_width, robot.sole_length)
    room = 0.5 * width - stepping.zmp_margin
    if 2 * stepping.zmp_error >= room > 0.0:
        raise InputError(
            f"{source}: stepping.zmp_error: {stepping.zmp_error!r} m leaves nothing of {robot.name}'s sole, which is "
            f"{width:.3g} m at its narrowest, and {stepping.zmp_margin:g} m of it are margin; "
            f"it must be below {0.5 * room:.3g} m"
        )
    if 2 * stepping.zmp_margin >= width:
        raise InputError(
            f"{source}: stepping.zmp_margin: {stepping.zmp_margin!r} m leaves nothing of {robot.name}'s sole, "
            f"which is {width:.3g} m {'wide' if width == robot.sole_width else 'long'}; "
            f"it must be below {width / 2:.3g} m"
        )
