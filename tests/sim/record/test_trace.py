"""A trace comes back from its file bit by bit, and a file that is none is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from models.errors import InputError
from scenarios.catalogue import CHANNELS
from sim.record.trace import ROOT_CHANNELS, TRACE_CHANNELS, Trace, TraceFileError, TraceRecorder, load_trace

METADATA = {"seed": 3, "scenario": {"pushes": [{"start": 0.1, "duration": 0.1}]}, "robot": {"cog_height": 0.26}}


@pytest.fixture
def trace() -> Trace:
    recorder = TraceRecorder(20, joints=["left_knee", "right_knee"])
    rng = np.random.default_rng(0)
    for _ in range(12):
        recorder.row()[:] = rng.normal(size=len(recorder.index)) * 10.0 ** rng.integers(-300, 300)
    recorder.row()[recorder.index["zmp_x"]] = -0.0
    recorder.row()[recorder.index["cog_x"]] = np.inf
    return recorder.trace(METADATA)


def test_every_bit_comes_back(trace: Trace, tmp_path: Path) -> None:
    trace.save(tmp_path / "trace.parquet")
    back = load_trace(tmp_path / "trace.parquet")
    assert np.isnan(trace.values).any()
    np.testing.assert_array_equal(back.values.view(np.uint64), trace.values.view(np.uint64))
    assert dict(back.units) == dict(trace.units)
    assert dict(back.metadata) == METADATA


def test_same_trace_makes_the_same_file(trace: Trace, tmp_path: Path) -> None:
    trace.save(tmp_path / "a")
    trace.save(tmp_path / "b")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_units_are_readable_without_okiagari(trace: Trace, tmp_path: Path) -> None:
    trace.save(tmp_path / "trace.parquet")
    schema = pq.read_schema(tmp_path / "trace.parquet")
    assert schema.field("cog_vx").metadata == {b"unit": b"m/s"}
    assert schema.field("q_left_knee").metadata == {b"unit": b"rad"}


def test_channels_follow_the_world() -> None:
    body = TraceRecorder(1, joints=["knee"]).trace({})
    assert body.channels == (*TRACE_CHANNELS, *ROOT_CHANNELS, "q_knee")
    assert body.joints == ("knee",)
    pendulum = TraceRecorder(1).trace({})
    assert pendulum.channels == tuple(TRACE_CHANNELS)
    assert pendulum.joints == ()


def test_recorder_gives_rows_in_order_and_no_more_than_there_is_room_for() -> None:
    recorder = TraceRecorder(2)
    for i in range(2):
        recorder.row()[recorder.index["time"]] = i
    with pytest.raises(IndexError):
        recorder.row()
    np.testing.assert_array_equal(recorder.trace({}).time, [0, 1])


def test_what_was_not_filled_is_nan() -> None:
    recorder = TraceRecorder(5)
    recorder.row()[0] = 1.0
    trace = recorder.trace({})
    assert len(trace) == 1
    assert np.isnan(trace["tracking_slack"]).all()


def test_trace_cannot_be_changed(trace: Trace) -> None:
    with pytest.raises(ValueError, match="read-only"):
        trace["cog_x"][0] = 1.0
    with pytest.raises(TypeError):
        trace.metadata["seed"] = 4  # type: ignore[index]


def test_trace_does_not_follow_the_recorder() -> None:
    recorder = TraceRecorder(2)
    row = recorder.row()
    row[:] = 1.0
    trace = recorder.trace({})
    row[:] = 2.0
    assert (trace.values == 1.0).all()


def test_unknown_channel_lists_those_there_are(trace: Trace) -> None:
    with pytest.raises(KeyError, match=r"no channel 'cog'; there are time, cog_x"):
        trace["cog"]


def test_values_must_fit_the_channels() -> None:
    with pytest.raises(ValueError, match="2 channels"):
        Trace(values=np.zeros((3, 1)), units={"a": "m", "b": "m"}, metadata={})


def test_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(TraceFileError, match=r"none\.parquet: cannot be read: No such file"):
        load_trace(tmp_path / "none.parquet")


@pytest.mark.parametrize("keep", [0, 3, 100, -100, -1])
def test_damaged_file_is_told_in_one_line(keep: int, trace: Trace, tmp_path: Path) -> None:
    path = tmp_path / "trace.parquet"
    trace.save(path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(TraceFileError, match=r"trace\.parquet: not a readable trace") as caught:
        load_trace(path)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, InputError)


def test_garbled_file_never_passes_as_a_trace(trace: Trace, tmp_path: Path) -> None:
    path = tmp_path / "trace.parquet"
    trace.save(path)
    sound = path.read_bytes()
    for at in range(4, len(sound), len(sound) // 40):
        path.write_bytes(sound[:at] + bytes(b ^ 0xFF for b in sound[at : at + 8]) + sound[at + 8 :])
        try:
            back = load_trace(path)
        except TraceFileError:
            continue
        # What still reads was hit where nothing is stored, for instance in a name of the writing library.
        np.testing.assert_array_equal(back.values.view(np.uint64), trace.values.view(np.uint64))
        assert dict(back.units) == dict(trace.units)


def test_other_parquet_is_refused(tmp_path: Path) -> None:
    pq.write_table(pa.table({"a": [1.0]}), tmp_path / "other.parquet")
    with pytest.raises(TraceFileError, match="not a trace of Okiagari: has no channel 'time'"):
        load_trace(tmp_path / "other.parquet")


def test_channels_without_units_are_refused(trace: Trace, tmp_path: Path) -> None:
    trace.save(tmp_path / "trace.parquet")
    table = pq.read_table(tmp_path / "trace.parquet")
    bare = pa.table({name: table[name] for name in table.schema.names})
    pq.write_table(bare, tmp_path / "bare.parquet")
    with pytest.raises(TraceFileError, match="has no metadata"):
        load_trace(tmp_path / "bare.parquet")
    pq.write_table(bare.replace_schema_metadata(table.schema.metadata), tmp_path / "bare.parquet")
    with pytest.raises(TraceFileError, match="every column must be float64 and have a unit"):
        load_trace(tmp_path / "bare.parquet")


def test_memory_of_a_record_is_reckoned_with_enough_columns() -> None:
    assert len(TRACE_CHANNELS) + len(ROOT_CHANNELS) <= CHANNELS
