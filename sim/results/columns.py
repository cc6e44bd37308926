"""The columns of a sweep's table: types, units and meanings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import pyarrow as pa


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of the table.

    Attributes:
        type: of pyarrow.
        unit: "1" for numbers without one; empty for what is no number.
        meaning: one line.
    """

    type: pa.DataType
    unit: str
    meaning: str


def _text(meaning: str) -> Column:
    return Column(type=pa.string(), unit="", meaning=meaning)


def _number(unit: str, meaning: str) -> Column:
    return Column(type=pa.float64(), unit=unit, meaning=meaning)


def _count(meaning: str) -> Column:
    return Column(type=pa.int64(), unit="1", meaning=meaning)


def _flag(meaning: str) -> Column:
    return Column(type=pa.bool_(), unit="", meaning=meaning)


PARAMETERS: Mapping[str, Column] = MappingProxyType(
    {
        "robot": _text("name of a robot"),
        "world": _text("humanoid or pendulum"),
        "controller": _text("short name, entry point, or path/to/file.py:Class"),
        "whole_body": _text("dynamics or ik"),
        "variant": _text("name of the suite's variant of the scenario; null if it has none"),
        "body": _text("where the push acts; cog is every body by its mass"),
        "direction_deg": _number(
            "deg", "nominal direction of the push, 0 forward, 90 left, below 360; null of a train"
        ),
        "delta_v": _number("m/s", "impulse / nominal mass; null of a train"),
        "impulse": _number("N s", "asked impulse; null of a train"),
        "duration": _number("s", "length of the push"),
        "start": _number("s", "nominal start of the push"),
        "height": _number("m", "how far above the body's COM the push acts"),
        "mass_scale": _number("1", "true mass / mass that the controllers know"),
        "friction": _number("1", "sliding friction of the floor; null as the arena has it"),
        "sensing": _text("exact, ideal, typical or cheap: preset of the sensors"),
        "latency": _number("s", "age of what the controllers see"),
        "noise_position": _number("m", "sd of the noise of the COG that the controllers see"),
        "noise_velocity": _number("m/s", "sd of the noise of the COG velocity that the controllers see"),
        "body_error": _number("1", "scale of the true body's errors"),
        "replica": _count("number of the repetition, from 0"),
    }
)
"""What was asked; together they name an episode within its suite."""

OUTCOME: Mapping[str, Column] = MappingProxyType(
    {
        "outcome": _text("recovered, fell, not_settled or crashed"),
        "reason": _text("why, in words"),
        "time_of_fall": _number("s", "null without a fall"),
        "delivered_impulse": _number("N s", "summed from the forces that the physics was given, over all of a train"),
        "d_edge": _number("m", "from the middle of the feet to the edge of their hull in the nominal direction"),
        "delta_v_over_omega_d": _number("1", "1 is the no-step limit of the pendulum"),
        "delta_v_over_sqrt_gh": _number("1", "size of the push, comparable between robots"),
        "regulator_slack_end": _number("m", "signed slack of the regulator's set at the end of the push"),
        "tracking_slack_end": _number("m", "the same of the tracking sets; -inf if no step is within reach"),
        "in_regulator_set_end": _flag("membership at the end of the push"),
        "in_tracking_set_end": _flag("the same of the tracking sets"),
        "regulator_slack_decision": _number(
            "m", "at the first decision away from the regulator since the push began; else at the end of the push"
        ),
        "tracking_slack_decision": _number("m", "the same of the tracking set that was chosen"),
        "in_regulator_set_decision": _flag("membership at that decision"),
        "in_tracking_set_decision": _flag("the same of the tracking set that was chosen"),
        "outside_all": _flag("no set held the state at that decision"),
        "chosen": _text("how the push was answered: standing or stepping"),
        "mid_step": _flag("a step was under way when the push began; null of a train, or if it fell before"),
        "pushes_survived": _count("pushes of a train after which it stood until the next; null without a train"),
        "total_impulse": _number("N s", "of the survived pushes of a train; null without a train"),
        "pushes": _text("the pushes of a train that began: size, what was predicted, whether survived; JSON"),
        "steps": _count("steps begun"),
        "settle_time": _number("s", "from the end of the push to rest; null if it did not come to rest"),
        "peak_torque": _number("N m", "of the joint with the greatest torque / stall torque; null on the pendulum"),
        "peak_torque_use": _number("1", "that share"),
        "peak_torque_joint": _text("that joint"),
        "peak_speed": _number("rad/s", "of the joint with the greatest speed / no-load speed; null on the pendulum"),
        "peak_speed_use": _number("1", "that share"),
        "peak_speed_joint": _text("that joint"),
        "saturated_time": _number("s", "how long any motor was at its torque-speed line; null on the pendulum"),
        "saturated_joint": _text("whose was there longest; null if none was"),
        "dcm_error_rms": _number(
            "m", "of the DCM that is seen about the loaded soles, from the first push on; null if the state is seen"
        ),
        "dcm_error_peak": _number("m", "its largest"),
        "trace_hash": _text("SHA-256 of every number of the trace"),
    }
)
"""What happened; null in a row that crashed, but for what is known of the push beforehand."""

TIMING: Mapping[str, Column] = MappingProxyType(
    {
        "real_time_factor": _number("1", "simulated time / wall time of the loop"),
        "wall_time": _number("s", "of the whole episode, with setting up, but without what a worker does once"),
    }
)
"""What a clock measured: the only columns that differ when an episode is repeated with the same versions."""

COLUMNS: Mapping[str, Column] = MappingProxyType(
    {"episode": _text("short hash of the suite's seed and the parameters"), "suite": _text("name of the suite")}
    | dict(PARAMETERS)
    | {
        "seed": _count("of the episode; derived from the suite's seed and the parameters but for who answers"),
        "series": _text("rows of one adaptive series share it; else it is the episode"),
        "push_start": _number("s", "start of the push as run; of a train, of its first"),
        "push_direction_deg": _number("deg", "direction of the push as run; null of a train"),
        "first_direction_deg": _number("deg", "of the push before it; null if there is none"),
        "first_delta_v": _number("m/s", "size of the push before it; null if there is none"),
        "train": _count("pushes of the train at most; null without a train"),
    }
    | dict(OUTCOME)
    | dict(TIMING)
    | {
        "traceback": _text("of an episode that crashed"),
        "scenario": _text("the scenario as run, JSON"),
        "versions": _text("of Python and the libraries, JSON"),
        "commit": _text("of Okiagari"),
    }
)
"""Every column, in order."""

LATER: Mapping[str, Any] = MappingProxyType(
    {"variant": None, "sensing": "exact", "body_error": 0.0, "dcm_error_rms": None, "dcm_error_peak": None}
)
"""Columns that tables of former versions lack -> what is meant by that."""
RENAMED: Mapping[str, str] = MappingProxyType({"delay": "latency"})
"""Columns as tables of former versions call them -> as they are called now."""

SCHEMA = pa.schema(
    [
        pa.field(name, column.type, metadata={"unit": column.unit, "meaning": column.meaning})
        for name, column in COLUMNS.items()
    ],
    metadata={"okiagari": json.dumps({"table": "sweep", "version": 2})},
)
