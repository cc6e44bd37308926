from __future__ import annotations

import math
import multiprocessing
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from controllers.disk_cache import CacheError, content_key, load_or_build
from controllers.footholds import StepLimits
from controllers.gains import dcm
from controllers.moa import regulator_set
from controllers.pendulum import Pendulum
from controllers.reference_grid import LibraryError, LibraryGrid
from controllers.reference_library import ReferenceLibrary, reference_library
from controllers.support import Foot
from controllers.tracking_sets import tracking_sets
from models.arena import Side

PENDULUM = Pendulum(math.sqrt(9.81 / 0.26), 0.005)
GAIN = dcm(PENDULUM, 1.5)
SOLE = np.array([[0.0495, 0.036], [-0.0495, 0.036], [-0.0495, -0.036], [0.0495, -0.036]])
LIMITS = StepLimits(max_stride=0.16, min_width=0.075, max_width=0.2, stance_width=0.084, swing_speed=2.0)
FEET: dict[Side, Foot] = {
    "left": Foot(position=np.array([0.0, 0.042]), yaw=0.0, sole=SOLE),
    "right": Foot(position=np.array([0.0, -0.042]), yaw=0.0, sole=SOLE),
}
# Standing on the right foot from rest between the feet is falling to the left: lateral speeds carry it over.
GRID = LibraryGrid(directions=(0.0, 45.0, 90.0, 180.0), lengths=(0.0, 0.08), step_times=(0.2, 0.25), speeds=(0.0, 0.3))
MARGIN = 0.003


def library(directory: Path, **changes: float) -> ReferenceLibrary:
    return reference_library(
        PENDULUM, GAIN, FEET, LIMITS, GRID, directory=directory, **{"margin": MARGIN, **changes}
    )  # fmt: skip


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ReferenceLibrary]:
    directory = tmp_path_factory.mktemp("library")
    return directory, library(directory)


def the_file(directory: Path) -> Path:
    (path,) = directory.iterdir()
    return path


def same(one: ReferenceLibrary, other: ReferenceLibrary) -> bool:
    names = ("swing", "step_time", "landing", "start", "S", "a", "first", "knots", "counts")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_every_reference_keeps_its_margin_and_its_set(kept: tuple[Path, ReferenceLibrary]) -> None:
    references, rng = kept[1], np.random.default_rng(2)
    assert len(references) > 10
    states = rng.normal(size=(20, 4)) * [0.02, 0.2, 0.02, 0.15]
    slacks = np.array([references.slacks(x) for x in states])
    for index in range(len(references)):
        plan = references.plan(index)
        assert plan.slack >= MARGIN - 1e-9
        np.testing.assert_array_equal(plan.reference.xi[0], references.start[index])
        np.testing.assert_array_equal(plan.footholds[0].position, references.landing[index])
        final = plan.reference.final
        terminal = regulator_set(PENDULUM, GAIN, final, plan.reference.xi[-1, 0::2])
        sets = tracking_sets(PENDULUM, GAIN, plan.reference, terminal)
        np.testing.assert_allclose(slacks[:, index], sets.slacks(0, states), rtol=0, atol=1e-12)  # rounding


def test_best_is_the_largest_slack(kept: tuple[Path, ReferenceLibrary]) -> None:
    references = kept[1]
    for x in np.random.default_rng(3).normal(size=(50, 4)) * [0.02, 0.2, 0.02, 0.15]:
        slacks, (index, slack) = references.slacks(x), references.best(x)
        assert slack == slacks[index] == slacks.max()
        inside = references.containing(x)
        assert set(inside) == set(np.flatnonzero(slacks >= 0.0))
        assert (np.diff(slacks[inside]) <= 0.0).all()
    for index in range(len(references)):
        assert index in references.containing(references.start[index])
    for bad in (np.zeros(3), np.array([0.0, math.nan, 0.0, 0.0])):
        with pytest.raises(LibraryError, match="finite state"):
            references.best(bad)


def test_query_takes_less_than_a_millisecond(kept: tuple[Path, ReferenceLibrary]) -> None:
    references, x = kept[1], np.array([0.0, 0.2, 0.0, 0.1])
    taken = []
    for _ in range(50):
        begin = time.perf_counter()
        references.best(x)
        taken.append(time.perf_counter() - begin)
    assert min(taken) < 1e-3


def test_second_time_comes_from_disk(kept: tuple[Path, ReferenceLibrary]) -> None:
    directory, first = kept
    again = library(directory)
    assert not first.from_disk
    assert again.from_disk
    assert same(first, again)


def test_another_input_is_another_file(kept: tuple[Path, ReferenceLibrary], tmp_path: Path) -> None:
    (tmp_path / the_file(kept[0]).name).write_bytes(the_file(kept[0]).read_bytes())
    assert library(tmp_path).from_disk
    assert not library(tmp_path, margin=MARGIN * (1.0 + 1e-12)).from_disk
    assert not library(tmp_path, settle_time=0.65).from_disk
    # A file under the name of another key is not trusted either.
    paths = sorted(tmp_path.iterdir())
    content = {path: path.read_bytes() for path in paths}
    for path, other in zip(paths, [*paths[1:], paths[0]], strict=True):
        path.write_bytes(content[other])
    assert not library(tmp_path).from_disk


def test_damaged_file_is_rebuilt(kept: tuple[Path, ReferenceLibrary], tmp_path: Path) -> None:
    whole, rng = the_file(kept[0]).read_bytes(), np.random.default_rng(4)
    path = tmp_path / the_file(kept[0]).name
    damaged = [b"", whole[:10], whole[: len(whole) // 2], whole[:-1], whole + b"\0"]
    for position in (0, 20, 60, len(whole) - 1, *rng.integers(0, len(whole), 2).tolist()):
        flipped = bytearray(whole)
        flipped[position] ^= 1 << int(rng.integers(8))
        damaged.append(bytes(flipped))
    for content in damaged:
        path.write_bytes(content)
        built = []
        arrays, from_disk = load_or_build(
            path.stem, lambda built=built: built.append(1) or {"a": np.arange(3.0)}, tmp_path
        )
        assert built
        assert not from_disk
        np.testing.assert_array_equal(arrays["a"], np.arange(3.0))
        # ... and what was put in its place is whole.
        assert load_or_build(path.stem, dict, tmp_path)[1]
    path.write_bytes(whole[: len(whole) // 2])
    assert same(library(tmp_path), kept[1])
    assert path.read_bytes()[:20] == whole[:20]


def test_two_processes_that_write_at_once_leave_a_whole_file(tmp_path: Path) -> None:
    # Each writes its own numbers many times over the other's and checks what it then reads.
    code = """
import sys, numpy as np
from pathlib import Path
from controllers.disk_cache import _read, _write
directory, mine = Path(sys.argv[1]), float(sys.argv[2])
for _ in range(60):
    _write(directory / "k.references", "k", {"a": np.full(20_000, mine)})
    found = _read(directory / "k.references", "k")
    assert found is not None, "a reader saw half a file"
    assert len(set(found["a"].tolist())) == 1, "two writers in one file"
"""
    root = Path(__file__).resolve().parents[2]
    running = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path), str(n)], cwd=root, stderr=subprocess.PIPE)
        for n in (1, 2)
    ]
    for process in running:
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 0, errors.decode()
    assert [path.name for path in tmp_path.iterdir()] == ["k.references"], "no temporary file is left"


def build_in(directory: str) -> int:
    return len(library(Path(directory)))


def test_two_processes_that_build_at_once_agree(kept: tuple[Path, ReferenceLibrary], tmp_path: Path) -> None:
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(build_in, [str(tmp_path)] * 2, chunksize=1) == [len(kept[1])] * 2
    assert library(tmp_path).from_disk
    assert same(library(tmp_path), kept[1])


def test_key_sees_values_shapes_types_and_names() -> None:
    keys = {
        content_key(parts)
        for parts in (
            {"a": np.zeros(4)},
            {"a": np.zeros((2, 2))},
            {"a": np.zeros(4, dtype=np.int64)},
            {"b": np.zeros(4)},
            {"a": np.array([0.0, 0.0, 0.0, 5e-324])},
            {"a": np.zeros(2), "b": np.zeros(2)},
        )
    }
    assert len(keys) == 6
    assert content_key({"a": np.ones(1), "b": np.zeros(2)}) == content_key({"b": np.zeros(2), "a": np.ones(1)})


def test_bad_input_is_refused_with_advice(tmp_path: Path) -> None:
    for arguments, said in (
        ({"lengths": ()}, "at least one of its lengths"),
        ({"speeds": (math.nan,)}, "speeds must be finite"),
        ({"lengths": (-0.1,)}, "must not be negative"),
        ({"swings": ("middle",)}, "swings must be of"),
    ):
        with pytest.raises(LibraryError, match=said):
            LibraryGrid(**arguments)
    with pytest.raises(LibraryError, match="margin must be"):
        library(tmp_path, margin=-0.001)
    with pytest.raises(LibraryError, match="less margin"):
        library(tmp_path, margin=0.05)
    assert list(tmp_path.iterdir()) == []
    blocked = tmp_path / "a file"
    blocked.write_text("not a directory")
    with pytest.raises(CacheError, match="another directory"):
        library(blocked)
