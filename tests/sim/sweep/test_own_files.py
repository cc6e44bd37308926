"""A sweep does not go on with a whole-body layer or an estimator whose file has changed since."""

from __future__ import annotations

from pathlib import Path

import pytest

from models.errors import InputError
from scenarios.suite_catalogue import load_suite
from sim.sweep.store import prepare

SUITE = """
description = "one push"

[axes]
direction = [0.0]
delta_v = [0.1]
start = [0.5]

[variants]
"plain" = {{}}
"own" = {{ {variant} }}
"""
OWN = {
    "estimator": "def reset(self, observation): pass\n    def estimate(self, readings, targets, time): pass",
    "layer": "def reset(self): pass\n    def targets(self, observation, command): pass",
}


@pytest.mark.parametrize(
    ("kind", "variant"),
    [
        ("estimator", '"sensing.preset" = "typical", "sensing.estimator" = "own.py:Own"'),
        ("layer", 'whole_body = "own.py:Own"'),
    ],
)
def test_a_changed_file_is_refused(kind: str, variant: str, tmp_path: Path) -> None:
    own, suite, folder = tmp_path / "own.py", tmp_path / "suite.toml", tmp_path / "out"
    own.write_text(f"class Own:\n    def __init__(self, robot, dt, options): pass\n    {OWN[kind]}\n", encoding="utf-8")
    suite.write_text(SUITE.format(variant=variant), encoding="utf-8")
    folder.mkdir()
    prepare(load_suite(suite), folder)
    prepare(load_suite(suite), folder)
    own.write_text(own.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"'own.py:Own' as its file was then, and it has changed since"):
        prepare(load_suite(suite), folder)
