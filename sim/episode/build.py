"""The controller and the whole-body layer that a scenario names, built from its fields."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from pydantic import ValidationError

from controllers.estimation.beliefs import SensorFigures
from controllers.fields import Strict
from controllers.interface import BalanceController, JointController, Setting, WholeBodyLayer
from controllers.registry import CONTROLLERS, ESTIMATORS, LAYERS, Entry
from controllers.senses import Estimator
from models.errors import InputError, OkiagariError, one_line, with_kind
from models.robot import Robot
from scenarios.choice import SHARED, Choice
from scenarios.error_messages import first_error
from scenarios.schema import Scenario
from sim.sensing.nominal_body import SimulatedBody


def make_controller(scenario: Scenario, robot: Robot) -> BalanceController | JointController:
    """The controller of a scenario.

    Raises:
        InputError: if it is not ours and cannot be built.
    """
    entry = CONTROLLERS.entry(scenario.controller.name)
    shared = {name: getattr(scenario, name) for name in SHARED if name in entry.options.model_fields}
    options = _options(entry, "controller", scenario.controller.options | shared)
    if entry.at_joints and scenario.world == "pendulum":
        raise InputError(f"controller: {entry.short!r} moves joints, and the world 'pendulum' has none")
    choice = layer_of(scenario)
    layer = None if choice is None else LAYERS.entry(choice.name).cls
    setting = Setting(robot=robot, dt=scenario.timing.control, layer=layer)
    return cast(BalanceController | JointController, _built(entry, "controller", setting, options))


def make_layer(scenario: Scenario, robot: Robot) -> WholeBodyLayer | None:
    """The whole-body layer of a scenario; None if nothing is there for it to do.

    Raises:
        InputError: if it is not ours and cannot be built.
    """
    choice = layer_of(scenario)
    if choice is None:
        return None
    entry = LAYERS.entry(choice.name)
    layer = _built(entry, "whole_body", robot, scenario.timing.control, _options(entry, "whole_body", choice.options))
    return cast(WholeBodyLayer, layer)


def make_estimator(scenario: Scenario, robot: Robot) -> Estimator | None:
    """The estimator of a scenario; None if the controllers are given the true state.

    Raises:
        InputError: if it is not ours and cannot be built, or cannot make up for the latency.
    """
    if not scenario.sensing.estimates:
        return None
    choice, field = scenario.sensing.who, "sensing.estimator"
    entry = ESTIMATORS.entry(choice.name)
    options = _options(entry, field, choice.options)
    known = (_figures(scenario),) if getattr(entry.cls, "takes_figures", False) else ()
    estimator = cast(Estimator, _built(entry, field, robot, scenario.timing.control, options, *known))
    late, most = scenario.sensing.latency, getattr(estimator, "most_latency", math.inf)
    if isinstance(most, int | float) and late > most:
        raise InputError(
            f"sensing.latency: {late!r} s is more than the {most:g} s that {entry.short!r} makes up for; 'ekf' "
            'with predictor = "none" sees what is so old'
        )
    if hasattr(estimator, "nominal_body"):
        estimator.nominal_body = SimulatedBody(robot, at_drive=scenario.sensing.at_drive)
    return estimator


def _figures(scenario: Scenario) -> SensorFigures:
    """What an estimator may know of a scenario's sensors: what their makers say."""
    joint, imu = scenario.sensing.joint_figures, scenario.sensing.imu_figures
    return SensorFigures(
        count=2.0 * math.pi / joint.counts if joint.counts else 0.0,
        gyro_noise=imu.gyro_noise,
        gyro_bias=imu.gyro_bias,
        accelerometer_noise=imu.accelerometer_noise,
        accelerometer_bias=imu.accelerometer_bias,
        at_drive=scenario.sensing.at_drive,
    )


def layer_of(scenario: Scenario) -> Choice | None:
    """The choice of the whole-body layer: the controller's own, if its class names one, else the scenario's.

    None if there is nothing for it to do: on the pendulum, and under a controller at joint level.
    """
    entry = CONTROLLERS.entry(scenario.controller.name)
    if scenario.world == "pendulum" or entry.at_joints:
        return None
    own = getattr(entry.cls, "layer", None)
    return scenario.whole_body if own is None else Choice(name=own)


def _options(entry: Entry, field: str, given: Mapping[str, Any]) -> Strict:
    try:
        return entry.options.model_validate(dict(given))
    except ValidationError as error:
        raise InputError(f"{field}.{first_error(error, entry.options)}") from None


def _built(entry: Entry, field: str, *arguments: Any) -> Any:
    try:
        return entry.cls(*arguments)
    except InputError:
        raise
    except OkiagariError as error:
        raise InputError(f"{field}: {entry.short!r} cannot be built: {one_line(error)}") from error
    except Exception as error:
        if entry.is_shipped:
            raise
        raise InputError(f"{field}: {entry.short!r} cannot be built: {with_kind(error)}") from error
