"""Comparisons and single episodes at the command line: for people, for machines, for a build server."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from sim.cli.app import main
from sim.results.table import read_results

SUITE = """\
description = "two directions, growing pushes"
replicas = 6
after = 1.5
[axes]
world = ["pendulum"]
controller = ["regulator"]
direction = [0.0, 90.0]
relative = [0.5, 0.8, 1.1]
start = [0.2]
[replica]
shift = 0.05
"""

SWINGING = 'gain={kind = "poles", poles = [[-0.3, 8.0], [-0.3, -8.0]]}'


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The suite as it is, and with a regulator that swings and hardly comes to rest."""
    folder = tmp_path_factory.mktemp("comparisons")
    (folder / "suite.toml").write_text(SUITE)
    for name, options in (("soft", []), ("swings", ["--set", SWINGING])):
        command = ["sweep", str(folder / "suite.toml"), *options, "--out", str(folder / name), "--workers", "2"]
        assert main(command) == 0
    return folder


def test_two_sweeps_are_compared_push_by_push(house: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(house / "soft"), str(house / "soft")]) == 0
    assert "0 lost, 0 gained" in capsys.readouterr().out
    assert main(["compare", str(house / "soft"), str(house / "swings")]) == 1
    told = capsys.readouterr().out
    assert told.startswith("worse than")
    assert "no longer recovered:" in told
    assert main(["compare", str(house / "swings"), str(house / "soft")]) == 0


def test_machines_read_it_too(house: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["compare", str(house / "soft"), str(house / "swings"), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["worse"]
    assert found["pairs"] == 36
    assert len(found["lost"]) == found["before"] - found["after"]
    assert found["p"] < 0.05
    assert main(["summary", str(house / "soft"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["episodes"] == 36


def test_a_build_server_gets_junit(house: Path, tmp_path: Path) -> None:
    base, report = tmp_path / "base.json", tmp_path / "deep" / "check.xml"
    assert main(["baseline", str(house / "soft"), "--out", str(base)]) == 0
    for name, code in (("soft", 0), ("swings", 1)):
        assert main(["check", str(house / name), "--baseline", str(base), "--junit", str(report)]) == code
        suite = ElementTree.fromstring(report.read_bytes())
        assert int(suite.get("tests", "0")) == len(suite.findall("testcase")) >= 1
        assert int(suite.get("failures", "0")) == len(suite.findall("testcase/failure"))
        assert bool(suite.findall("testcase/failure")) == bool(code)


def test_episodes_are_listed(house: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = read_results(house / "soft").to_pylist()
    lost = [row["episode"] for row in rows if row["outcome"] != "recovered"]
    assert 0 < len(lost) < len(rows)
    capsys.readouterr()
    assert main(["episodes", str(house / "soft"), "--fell"]) == 0
    told = capsys.readouterr().out
    assert [name in told for name in (row["episode"] for row in rows)] == [row["episode"] in lost for row in rows]
    assert f"okiagari replay {house / 'soft'} EPISODE" in told
    assert main(["episodes", str(house / "soft"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == len(rows)
    assert main(["episodes", str(house / "soft"), "--controller", "nobody"]) == 2
    assert "allowed: regulator" in capsys.readouterr().err
