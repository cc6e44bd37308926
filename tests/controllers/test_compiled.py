"""Kept code is that of the sources as they are."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from controllers.compiled import sources_hash

HOUSE = Path(__file__).resolve().parent.parent.parent
FILES = {
    "controllers/called.py": "from controllers.compiled import compiled\nfrom controllers.numbers import TWO\n"
    "@compiled\ndef called(x):\n    return TWO * x\n",
    "controllers/calls.py": "from controllers.compiled import compiled\nfrom controllers.called import called\n"
    "@compiled\ndef calls(x):\n    return called(x) + 1.0\n",
    "controllers/numbers.py": "TWO = 2.0\n",
    "controllers/other.py": "THREE = 3\n",
    "sim/__init__.py": "",
}


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A house with a kernel that calls one of another file, which takes a number of a third."""
    compiled = (HOUSE / "controllers/compiled.py").read_text(encoding="utf-8")
    for name, text in (FILES | {"controllers/compiled.py": compiled, "controllers/__init__.py": ""}).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def edit(house: Path, name: str, old: str, new: str) -> None:
    path = house / name
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def answer(house: Path) -> str:
    code = "from controllers.calls import calls\nprint(calls(5.0))"
    # -B: Python takes a file of the same length and second for unedited, and runs its bytecode
    done = subprocess.run([sys.executable, "-B", "-c", code], cwd=house, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_an_edit_of_what_a_kernel_calls_is_seen_by_the_next_run(house: Path) -> None:
    assert answer(house) == "11.0"
    edit(house, "controllers/called.py", "TWO * x", "x - TWO")
    assert answer(house) == "4.0"
    edit(house, "controllers/numbers.py", "2.0", "7.0")
    assert answer(house) == "-1.0"
    # only the latest code is kept
    assert len(list((house / "controllers/__pycache__").glob("okiagari-*"))) == 1


@pytest.mark.parametrize(
    ("name", "old", "new", "changes"),
    [
        ("controllers/called.py", "TWO * x", "x", True),
        ("controllers/numbers.py", "2.0", "2.5", True),
        ("controllers/other.py", "3", "4", False),
    ],
)
def test_the_hash_is_of_what_compiled_code_depends_on(
    house: Path, name: str, old: str, new: str, changes: bool
) -> None:
    before = sources_hash(house)
    edit(house, name, old, new)
    assert (sources_hash(house) != before) == changes
