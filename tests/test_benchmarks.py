"""`make bench` is run by hand: that its tables can still be made is seen here, at the smallest size."""

from __future__ import annotations

import importlib

import pytest

from tests.benchmarks import loop
from tests.benchmarks.__main__ import LONG, NAMES


@pytest.mark.parametrize("name", NAMES + LONG)
def test_a_benchmark_can_be_run_by_name(name: str) -> None:
    assert callable(importlib.import_module(f"tests.benchmarks.{name}").main)


def test_the_loop_has_its_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(loop, "REPEATS", 1)
    monkeypatch.setattr(loop, "EPISODES", [(name, given | {"duration": 1.5}) for name, given in loop.EPISODES[:1]])
    loop.main()
    told = capsys.readouterr().out
    for words in ("dynamics", "ik", "ratio", "real time"):
        assert words in told
