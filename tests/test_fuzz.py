"""A few hundred mutated inputs do no harm, and the fuzz would tell if they did; `make fuzz` tries many more."""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

import pytest

from models.errors import InputError
from tests.fuzz import __main__ as fuzz
from tests.fuzz import cases


def test_some_hundred_mutated_inputs_do_no_harm() -> None:
    assert fuzz.fuzz(0, 400) == []


def raising(rng: random.Random, folder: Path) -> str:
    raise ZeroDivisionError("by nothing")


def hanging(rng: random.Random, folder: Path) -> str:
    time.sleep(60.0)
    return ""


def crashing(rng: random.Random, folder: Path) -> str:
    os._exit(3)


def talking(rng: random.Random, folder: Path) -> str:
    os.write(2, b"one\ntwo\n")
    return ""


def test_what_does_harm_is_found(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(fuzz, "CASES", (raising, hanging, crashing, talking))
    monkeypatch.setattr(fuzz, "PATIENCE", 0.5)
    offenders = dict(fuzz.fuzz(7, 4))
    assert "ZeroDivisionError: by nothing" in offenders[0]
    assert offenders[1] == "hang: no answer within 0.5 s"
    assert offenders[2] == "crash: exit code 3"
    assert offenders[3].startswith("2 lines on stderr")
    assert "--seed 7 --only 2  crashing: crash" in capsys.readouterr().out


def test_half_written_folders_and_nameless_lines_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def half(arguments: list[str]) -> int:
        (tmp_path / ".run.7.part").mkdir()
        return 2

    def nameless() -> None:
        raise InputError("something is wrong")

    monkeypatch.setattr(cases, "main", half)
    assert cases._command([], tmp_path) == "half written: .run.7.part"
    assert cases._refusal(nameless, tmp_path) == "names no file: 'something is wrong'"
