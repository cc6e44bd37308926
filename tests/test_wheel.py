"""What is built is what works: the wheel alone, in an environment of its own, from any folder."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from sim.episode.run_folder import DECISIONS, FIGURE, OUTCOME, SCENARIO, TRACE
from sim.record.trace import load_trace

HOUSE = Path(__file__).resolve().parent.parent
PACKAGES = ("models", "controllers", "scenarios", "sim")


def call(*command: str | Path, cwd: Path) -> str:
    # Neither this folder nor what a developer has set may help the installed program.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run([str(word) for word in command], cwd=cwd, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs' folder of an environment that holds the wheel and the dependencies of this one."""
    source, place = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("place")
    # A copy, since a build in place would take up files that an earlier build left behind.
    for package in PACKAGES:
        shutil.copytree(HOUSE / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(HOUSE / name, source)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    call(*pip, "wheel", "--no-deps", "--no-build-isolation", "--no-index", "-w", place, source, cwd=place)

    call(sys.executable, "-m", "venv", "--without-pip", place / "env", cwd=place)
    programs = place / "env" / "bin"
    # Before the dependencies are there: pip would take an editable Okiagari among them for the one that is asked for.
    (wheel,) = place.glob("okiagari-*.whl")
    call(*pip, "--python", programs / "python", "install", "--no-deps", "--no-index", wheel, cwd=place)

    # The dependencies are those of this environment, with what they do at start-up, but not an editable Okiagari.
    (site,) = (place / "env" / "lib").glob("*/site-packages")
    here = Path(sysconfig.get_path("purelib"))
    (site / "00-dependencies.pth").write_text(f"{here}\n")
    for startup in here.glob("*.pth"):
        if "okiagari" not in startup.name:
            shutil.copy(startup, site)
    return programs


def test_packages_come_from_the_wheel(installed: Path, tmp_path: Path) -> None:
    names = ", ".join(PACKAGES)
    print_files = f"import {names}; print(*(m.__file__ for m in ({names})), sep='\\n')"
    files = call(installed / "python", "-c", print_files, cwd=tmp_path).split()
    assert [Path(file).is_relative_to(installed.parent) for file in files] == [True] * len(PACKAGES)


def test_wheel_runs_the_experiment_from_any_folder(installed: Path, tmp_path: Path) -> None:
    output = call(installed / "okiagari", "run", "three_pushes", "--world", "pendulum", "--no-video", cwd=tmp_path)
    folder = tmp_path / "out" / "three_pushes-pendulum"
    assert {path.name for path in folder.iterdir()} == {SCENARIO, TRACE, OUTCOME, DECISIONS, FIGURE}
    outcome = json.loads((folder / OUTCOME).read_text())
    assert outcome["outcome"] == "recovered"
    assert [push["chosen"] for push in outcome["pushes"]] == ["standing", "standing", "stepping"]
    assert outcome["versions"]["okiagari"] != "unknown"
    assert load_trace(folder / TRACE).metadata["robot"]["name"] == "utmu2"
    assert str(Path("out") / "three_pushes-pendulum" / FIGURE) in output
