"""The record of an episode: named channels with units, one row a control tick; saved as Parquet."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from models.errors import InputError, one_line
from sim.record.parquet import read_parquet

Array = NDArray[np.float64]


def _foot(side: str) -> dict[str, str]:
    units = {"x": "m", "y": "m", "z": "m", "yaw": "rad", "force": "N", "stance": "1"}
    return {f"{side}_{name}": unit for name, unit in units.items()}


TRACE_CHANNELS: Mapping[str, str] = MappingProxyType(
    {"time": "s"}
    | dict.fromkeys(("cog_x", "cog_y", "cog_z"), "m")
    | dict.fromkeys(("cog_vx", "cog_vy", "cog_vz"), "m/s")
    | dict.fromkeys(("zmp_x", "zmp_y", "zmp_cmd_x", "zmp_cmd_y"), "m")
    | _foot("left")
    | _foot("right")
    | {"trunk_tilt": "rad", "other_contact": "1"}
    | dict.fromkeys(("push_fx", "push_fy", "push_fz"), "N")
    | dict.fromkeys(("push_x", "push_y", "push_z"), "m")
    | dict.fromkeys(("phase", "steps"), "1")
    | dict.fromkeys(("regulator_slack", "tracking_slack", "support_slack"), "m")
    | dict.fromkeys(("solver_failed", "torque_use", "speed_use", "saturated"), "1")
)
"""Channel -> unit, in the order of the columns; every trace has them.

`push_f*` is the sum of all forces that push, its mean over the tick, and `push_x, push_y, push_z` where it acts: the
mean of the pushes' points by the size of their forces. `sim.record.push_columns` has what this cannot tell.
"""

ROOT_CHANNELS: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(("root_x", "root_y", "root_z"), "m")
    | dict.fromkeys(("root_qw", "root_qx", "root_qy", "root_qz"), "1")
)
"""Pose of the trunk; only a robot with joints has it, followed by a column `q_<joint>` [rad] for each."""


SEEN_CHANNELS: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(("seen_cog_x", "seen_cog_y", "seen_cog_z"), "m")
    | dict.fromkeys(("seen_cog_vx", "seen_cog_vy", "seen_cog_vz"), "m/s")
    | dict.fromkeys(("dcm_error_x", "dcm_error_y"), "m")
)
"""What the controllers saw, and the error of its DCM about the loaded soles; only if that was not the true state."""

SEEN_STANCE_CHANNELS: Mapping[str, str] = MappingProxyType(
    {"seen_tilt": "rad"}
    | dict.fromkeys(("seen_zmp_x", "seen_zmp_y"), "m")
    | dict.fromkeys(("seen_left_force", "seen_right_force"), "N")
)
"""How the robot stood as the controllers saw it; with `SEEN_CHANNELS`. The tilt is NaN on the pendulum."""


class TraceFileError(InputError):
    """A trace file is missing, damaged or not a trace."""


@dataclass(frozen=True, kw_only=True)
class Trace:
    """State at the start of every control tick and the command of that tick.

    `trace["cog_x"]` is the (n,) array of a channel.

    Attributes:
        values: (n, c) rows in order of time.
        units: channel -> unit, in the order of the columns.
        metadata: the scenario as run, facts of the robot, versions, seed, commit; JSON types only.
    """

    values: Array
    units: Mapping[str, str]
    metadata: Mapping[str, Any]

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or self.values.shape[1] != len(self.units):
            raise ValueError(f"a trace of {len(self.units)} channels cannot hold values of shape {self.values.shape}")
        # By column, since that is how a trace is read; a copy, so that nobody else can write to it.
        values = np.array(self.values, dtype=np.float64, order="F")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, channel: str) -> Array:
        try:
            return self.values[:, self.channels.index(channel)]
        except ValueError:
            raise KeyError(f"no channel {channel!r}; there are {', '.join(self.channels)}") from None

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.units)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the recorded joints; empty for the pendulum."""
        return tuple(name.removeprefix("q_") for name in self.channels if name.startswith("q_"))

    @property
    def time(self) -> Array:
        """(n,) start of each tick [s]."""
        return self["time"]

    def save(self, path: Path) -> None:
        """Write a Parquet file; every bit of every number comes back from `load_trace`."""
        fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in self.units.items()]
        schema = pa.schema(fields, metadata={_KEY: json.dumps(dict(self.metadata), allow_nan=False)})
        columns = [pa.array(self.values[:, i]) for i in range(len(fields))]
        pq.write_table(pa.table(columns, schema=schema), path, compression="zstd", write_page_checksum=True)


_KEY = b"okiagari"


def load_trace(path: str | Path) -> Trace:
    """Read a trace.

    Args:
        path: a `trace.parquet`.

    Raises:
        TraceFileError: if the file is missing, damaged or not a trace.
    """
    try:
        # From memory, so that a file that another process replaces meanwhile cannot be read by halves.
        table = read_parquet(Path(path).read_bytes())
    except OSError as error:
        raise TraceFileError(f"{path}: cannot be read: {error.strerror or one_line(error)}") from None
    except pa.ArrowException as error:
        raise TraceFileError(f"{path}: not a readable trace: {one_line(error)}") from None
    schema = table.schema
    missing = [name for name in TRACE_CHANNELS if name not in schema.names]
    if missing or _KEY not in (schema.metadata or {}):
        what = f"has no channel {missing[0]!r}" if missing else "has no metadata of a trace"
        raise TraceFileError(f"{path}: not a trace of Okiagari: {what}")
    if any(field.type != pa.float64() or b"unit" not in (field.metadata or {}) for field in schema):
        raise TraceFileError(f"{path}: not a trace of Okiagari: every column must be float64 and have a unit")
    return Trace(
        values=np.column_stack([column.to_numpy() for column in table.columns]),
        units={field.name: field.metadata[b"unit"].decode() for field in schema},
        metadata=json.loads(schema.metadata[_KEY]),
    )


class TraceRecorder:
    """Takes rows cheaply: memory for all of them is there from the start.

    Attributes:
        index: channel -> column.
    """

    def __init__(self, rows: int, *, joints: Sequence[str] | None = None, seen: bool = False) -> None:
        """Make room.

        Args:
            rows: most rows that will come.
            joints: names of the joints; None for a world without a body, which has no trunk pose either.
            seen: whether there are `SEEN_CHANNELS` and `SEEN_STANCE_CHANNELS`.
        """
        units = dict(TRACE_CHANNELS) | (dict(SEEN_CHANNELS) | dict(SEEN_STANCE_CHANNELS) if seen else {})
        if joints is not None:
            units |= dict(ROOT_CHANNELS) | {f"q_{joint}": "rad" for joint in joints}
        self._units = units
        self.index: Mapping[str, int] = MappingProxyType({name: i for i, name in enumerate(units)})
        self._values = np.full((rows, len(units)), np.nan)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def row(self) -> Array:
        """(c,) view of the next row, all NaN, to be filled; raises IndexError when there is no more room."""
        row: Array = self._values[self._count]
        self._count += 1
        return row

    def fill(self, columns: Mapping[str, Array]) -> None:
        """Write whole channels, one value for each of the first rows."""
        for name, values in columns.items():
            self._values[: len(values), self.index[name]] = values

    def trace(self, metadata: Mapping[str, Any], more: Mapping[str, tuple[str, Array]] | None = None) -> Trace:
        """The rows so far as a trace.

        Args:
            metadata: of the trace.
            more: channels after the others, name -> unit and a value for each row.
        """
        more = more or {}
        values = np.column_stack([self._values[: self._count], *(column for _, column in more.values())])
        units = self._units | {name: unit for name, (unit, _) in more.items()}
        return Trace(values=values, units=units, metadata=metadata)
