"""The four kinds of input that are mutated, and what each may lead to: an answer, or one line."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from models.errors import InputError
from models.robot import MODELS, Robot, load_robot
from scenarios.catalogue import check_against, load
from scenarios.schema import Scenario
from scenarios.suite_catalogue import load_suite
from sim.cli.app import app, main
from sim.episode import episode as episode_module
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import make_plant
from sim.episode.run_folder import FIGURE, SCENARIO, TRACE
from sim.report import hardest as hardest_module
from sim.set_study import figures as set_figures
from sim.set_study import set_report
from sim.sweep import executors
from sim.sweep import replay as replay_module
from sim.sweep import sweep as sweep_module
from sim.sweep.plan import plan
from tests.fuzz import mutations
from tests.sim.analysis.sweep_tables import folder_of, row, threshold_law

TICKS = 15
"""So many of an episode that is allowed are run."""
MANY = 20_000
"""Plans of more episodes are not made: they take long, but end."""
PUSH = {"start": 0.05, "duration": 0.1, "direction": 30.0, "delta_v": 0.3, "body": "trunk", "height": 0.01}
SCENARIO_FIELDS: dict[str, Any] = {
    "description": "fuzzed", "robot": "utmu2", "world": "humanoid", "controller": "supervisor",
    "whole_body": "dynamics", "duration": 0.4, "seed": 1, "timing": {"physics": 0.001, "control": 0.002},
    "gain": {"kind": "dcm", "k": 1.5},
    "stepping": {
        "rule": "sets", "step_times": [0.12, 0.15, 0.18], "max_steps": 4, "zmp_margin": 0.008, "max_stride": 0.28,
        "swing_height": 0.025, "replan": True, "early_trigger": 0.1, "steady_trigger": True,
        "angular_momentum": True,
    },
    "variation": {"pose": 0.002},
    "disturbance": {"mass_scale": 1.1, "friction": 0.5},
    "sensing": {
        "preset": "typical", "latency": 0.003, "servo": "drive", "joint": {"counts": 4096, "offset": 0.001},
        "imu": {"gyro_noise": 0.01, "gyro_range": 10.0, "rate": 500.0}, "foot": {"least_force": 3.0},
        "estimator": {"name": "ekf", "predictor": "none"},
    },
    "body": {"scale": 1.0, "mass": 0.05, "com": 0.002, "joint_friction": 0.3, "motor": 0.05, "floor_friction": 0.1},
    "pushes": [
        PUSH | {"shape": "half_sine", "point": [0.0, 0.0, 0.05]}, PUSH | {"start": 0.2},
        {"start": 0.21, "torque": [0.1, 0.0, 0.5], "duration": 0.1},
    ],
}  # fmt: skip
GAINS = (
    {"kind": "dcm", "k": 1.5},
    {"kind": "lqr", "q": [100.0, 1.0], "r": 1.0},
    {"kind": "poles", "poles": [-8.0, [-4.0, 0.0]]},
)
SUITE_FIELDS: dict[str, Any] = {
    "description": "fuzzed", "tuned_on": "nothing", "scenario": "quiet", "replicas": 2, "seed": 3, "after": 0.2,
    "axes": {
        "world": ["pendulum"], "controller": ["supervisor", "statue"], "body": ["trunk"], "direction": [0, 90],
        "delta_v": {"first": 0.1, "last": 0.3, "step": 0.1}, "duration": [0.1], "start": [0.6], "height": [0.0],
        "mass_scale": [0.9], "latency": [0.0], "noise_position": [0.0], "noise_velocity": [0.0],
        "sensing": ["exact"], "body_error": [0.0],
    },
    "replica": {"pose": 0.002, "shift": 0.1, "time": 0.01, "direction": 5.0},
}  # fmt: skip
EXTRAS: tuple[dict[str, Any], ...] = (
    {"adaptive": {"stop_after": 2, "each_replica": True}},
    {"first": {"size": 1.2, "gap": 0.1, "duration": 0.1, "direction": [0.0, 360.0]}},
    {"variants": {"a": {}, "b": {"stepping.replan": False, "gain.k": 2.0}}},
    {"scenario": {"controller": "regulator", "gain": {"kind": "dcm", "k": 2.0}, "timing": {"control": 0.004}}},
    {"scenario": {"pushes": [PUSH | {"point": [0.0, 0.0, 0.01]}]}},
    {"random": {"count": 5, "direction": [0, 90], "delta_v": [0.1, 0.2]}, "axes": {"world": ["pendulum"]}},
    {
        "train": {"count": 4, "interval": 0.5, "first": 0.5, "growth": 0.1, "direction": [0.0, 360.0]},
        "axes": {"controller": ["statue"], "duration": [0.1], "start": [0.5]},
        "replica": {"pose": 0.002},
    },
)
ROBOT = (MODELS / "utmu2.xml").read_text(encoding="utf-8")


class Reached(Exception):
    """A command was allowed to begin what takes long."""


def checked(path: Path) -> tuple[Scenario, Robot]:
    """Read a scenario and its robot as the command line does.

    Raises:
        InputError: if one of them is refused.
    """
    scenario = load(path)
    try:
        robot = load_robot(scenario.robot)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    check_against(scenario, robot, source=str(path))
    return scenario, robot


def short_episode(path: Path) -> None:
    """Read a scenario and run its first ticks.

    Raises:
        InputError: if it is refused.
    """
    scenario, robot = checked(path)
    plant = make_plant(scenario, robot)
    episode = Episode(scenario, plant, make_controller(scenario, robot))
    for _ in range(TICKS):
        if not episode.tick():
            break
    episode.result()


def scenario_case(rng: random.Random, folder: Path) -> str:
    """A scenario file, of which the first ticks are run."""
    base = SCENARIO_FIELDS | {"world": rng.choice(("pendulum", "humanoid")), "gain": rng.choice(GAINS)}
    if base["world"] == "pendulum":
        noisy = {"latency": 0.004, "state_noise": {"position": 0.001, "velocity": 0.01}}
        base = base | {"disturbance": {"mass_scale": 1.1}, "sensing": noisy, "body": {"scale": 0.0}}
    base["controller"] = rng.choice(("supervisor", "paper", "regulator", "statue", {"name": "paper", "edge": 0.01}))
    path = folder / "mine.toml"
    path.write_bytes(mutations.toml(rng, base))
    if rng.random() < 0.02:
        return _command(["run", str(path), "--no-video", "--out", str(folder / "run")], folder)
    return _refusal(lambda: short_episode(path), path)


def suite_case(rng: random.Random, folder: Path) -> str:
    """A suite file, of which the plan is made."""
    base = SUITE_FIELDS | (rng.choice(EXTRAS) if rng.random() < 0.7 else {})
    path = folder / "mine.toml"
    path.write_bytes(mutations.toml(rng, base))

    def planned() -> None:
        loaded = load_suite(path)
        if loaded.suite.episodes <= MANY:
            plan(loaded)

    return _refusal(planned, path)


def robot_case(rng: random.Random, folder: Path) -> str:
    """A robot's file; every fourth that is allowed is run for some ticks."""
    robot, path = folder / "mine.xml", folder / "mine.toml"
    robot.write_bytes(mutations.mjcf(rng, ROBOT))
    path.write_text('description = "fuzzed"\nrobot = "mine.xml"\nduration = 1.0\n')
    if rng.random() < 0.25:
        return _refusal(lambda: short_episode(path), robot, path)
    return _refusal(lambda: checked(path), robot, path)


def command_case(rng: random.Random, folder: Path) -> str:
    """A command line; what takes long is not begun."""
    (folder / "short.toml").write_text('description = "x"\nworld = "pendulum"\nduration = 0.1\n')
    (folder / "suite.toml").write_text('description = "x"\n[axes]\ndirection = [0]\ndelta_v = [0.1]\n')
    (folder / "broken.toml").write_bytes(mutations.toml(rng, SCENARIO_FIELDS))
    (folder / "file").touch()
    (folder / "empty").mkdir()
    (folder / "sweep").mkdir()
    facts = mutations.table(rng, {"suite": "x", "planned": 3})
    (folder / "sweep" / "sweep.json").write_text(json.dumps(facts, default=str), encoding="utf-8")
    if rng.random() < 0.3:
        folder_of(folder / "done", [row(LAW, direction_deg=d, delta_v=0.1 * v) for d in (0.0, 90.0) for v in (1, 2, 9)])
    (folder / "run").mkdir()
    (folder / "run" / TRACE).write_bytes(rng.randbytes(200))
    arguments = _arguments(rng, [str(folder / each) for each in _FILES])
    return _command(arguments, folder)


_FILES = (
    "short.toml", "suite.toml", "broken.toml", "file", "empty", "sweep", "done", "run", "new", "new/x.png", "x.html",
)  # fmt: skip
_USUAL = {"scenario": "short.toml", "suite": "suite.toml", "folder": "done"}
LAW = threshold_law({"supervisor": 1.5})
CASES: tuple[Callable[[random.Random, Path], str], ...] = (scenario_case, suite_case, robot_case, command_case)


def _arguments(rng: random.Random, files: list[str]) -> list[str]:
    commands: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    name = rng.choice(list(commands))

    def word() -> str:
        if rng.random() < 0.6:
            return rng.choice(files)
        return str(rng.choice(mutations.WORDS)) if rng.random() < 0.7 else str(mutations.number(rng))

    found = [name if rng.random() < 0.98 else word()]
    for parameter in commands[name].params:
        if parameter.param_type_name == "argument" and rng.random() < 0.95:
            usual = _USUAL.get(parameter.name)
            found.append(str(Path(files[0]).parent / usual) if usual and rng.random() < 0.5 else word())
        elif parameter.param_type_name == "option" and rng.random() < 0.3:
            found.append(parameter.opts[0])
            if not getattr(parameter, "is_flag", False) and rng.random() < 0.97:
                found.append(word())
    # A word that a shell cannot pass on cannot come in.
    found = [each for each in found if "\0" not in each]
    return [*found, *([word()] if rng.random() < 0.03 else [])]


def _refusal(attempt: Callable[[], Any], *files: Path) -> str:
    """What is wrong with how a file was answered; empty if nothing is."""
    try:
        attempt()
    except InputError as error:
        line = str(error)
        if "\n" in line or not line.strip():
            return f"not one line: {line!r}"
        if not any(str(file) in line for file in files):
            # What only shows while it runs names what it is about.
            known = ("pushes[", "controller", "whole_body", "timing.physics: at ")
            return "" if line.startswith(known) else f"names no file: {line!r}"
    return ""


def _command(arguments: list[str], folder: Path) -> str:
    before = set(folder.rglob("*"))
    with _short():
        try:
            code = main(arguments)
        except Reached:
            code = 0
        except SystemExit as error:
            return f"SystemExit({error.code})"
    new = {path for path in folder.rglob("*") if path not in before}
    half = [path for path in new if path.name.endswith((".part", ".former", ".tmp"))]
    runs = [path for path in new if path.name == TRACE]
    half += [path for path in runs if not ((path.parent / SCENARIO).exists() and (path.parent / FIGURE).exists())]
    if half:
        return f"half written: {half[0].relative_to(folder)}"
    if code == 2 and new:
        return f"refused, but wrote {next(iter(new)).relative_to(folder)}"
    return "" if code in (0, 1, 2) else f"exit code {code}"


@contextmanager
def _short() -> Iterator[None]:
    """Episodes are short, and what runs many of them or draws for long is not begun."""

    def reached(*_: Any, **__: Any) -> Any:
        raise Reached

    @contextmanager
    def nobody(*_: Any, **__: Any) -> Iterator[None]:
        yield None

    run = episode_module.run_episode
    changes: list[tuple[Any, str, Any]] = [
        (episode_module, "run_episode", lambda scenario, **more: run(_shortened(scenario), **more)),
        (sweep_module, "run_sweep", reached),
        (executors, "local", nobody),
        (executors, "cluster", nobody),
        (replay_module, "replay", reached),
        (set_figures, "draw_set_figures", reached),
        (set_report, "set_report", reached),
        (hardest_module, "film_hardest", reached),
    ]
    former = [(module, name, getattr(module, name)) for module, name, _ in changes]
    for module, name, instead in changes:
        setattr(module, name, instead)
    try:
        yield
    finally:
        for module, name, it in former:
            setattr(module, name, it)


def _shortened(scenario: Scenario) -> Scenario:
    return scenario.model_copy(update={"duration": min(scenario.duration, 0.1), "pushes": ()})
