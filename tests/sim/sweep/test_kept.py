"""What a worker keeps leaves nothing of one episode in the next: same bits as in a fresh process, in any order."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from models.errors import InputError, OkiagariError
from models.robot import load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult
from sim.episode.humanoid_world import HumanoidWorld
from sim.sweep import kept
from sim.sweep.worker import trace_hash

# Each in a process of its own, with nothing kept or warmed up, as `okiagari run` does it.
PROGRAM = """
import json, sys
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from sim.sweep.worker import trace_hash
trace = run_episode(Scenario.model_validate(json.loads(sys.stdin.read())), polygons=False).trace
print(trace_hash(trace.values, trace.channels))
"""
SOFT = '''
import numpy as np
from controllers.interface import JointTargets


class Soft:
    """Holds the stand with servos of its own stiffness."""

    period = 0.01

    def __init__(self, setting, options):
        self.stand = setting.robot.stand[7:]

    def reset(self, seed):
        """Nothing to forget."""

    def targets(self, observation):
        none = 0 * self.stand
        gains = np.full(len(self.stand), 150.0)
        return JointTargets(position=self.stand, velocity=none, torque=none, stiffness=gains, damping=0.05 * gains)


class Lost(Soft):
    """Leaves its episode in the middle of it."""

    def targets(self, observation):
        if observation.time > 0.15:
            raise RuntimeError("lost")
        return super().targets(observation)
'''


def short(seed: int, **fields: Any) -> Scenario:
    push = {"start": 0.1, "direction": 100.0, "delta_v": 0.5}
    return load("quiet", {"duration": 0.6, "seed": seed, "pushes": [push]} | fields)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Scenario]:
    """Episodes that change what is compiled, drawn, kept or watched; "lost" ends in an error."""
    soft = tmp_path_factory.mktemp("soft") / "soft.py"
    soft.write_text(SOFT)
    drawn = {"scale": 1.0}
    noisy = {"state_noise": {"position": 0.002, "velocity": 0.02}, "latency": 0.003}
    return {
        "plain": short(1001),
        "soft": short(1002, controller=f"{soft}:Soft"),
        "lost": short(1002, controller=f"{soft}:Lost"),
        "slippery": short(1001, disturbance={"mass_scale": 1.2, "friction": 0.3}),
        "drawn soft": short(1006, body=drawn, controller=f"{soft}:Soft"),
        "drawn lost": short(1006, body=drawn, controller=f"{soft}:Lost"),
        "drawn anew": short(1005, body=drawn, controller="regulator", sensing={"preset": "typical", "latency": 0.004}),
        "late": short(1001, sensing=noisy),
        "other layer": short(1001, whole_body="ik"),
        "coarse": short(1001, timing={"physics": 0.002, "control": 0.004}),
        "pendulum": short(1001, world="pendulum"),
    }


def bits(result: EpisodeResult) -> str:
    return trace_hash(result.trace.values, result.trace.channels)


@pytest.fixture(scope="module")
def fresh(mixed: dict[str, Scenario]) -> dict[str, str]:
    """Hash of each episode's trace, from a process of its own."""
    found = {}
    for name, scenario in mixed.items():
        if "lost" not in name:
            told = json.dumps(scenario.as_dict())
            ran = subprocess.run(
                [sys.executable, "-c", PROGRAM], input=told, capture_output=True, text=True, check=True
            )
            found[name] = ran.stdout.split()[-1]
    return found


@pytest.fixture
def nothing_kept(monkeypatch: pytest.MonkeyPatch) -> list[Scenario]:
    """Whose worlds are compiled from now on; nothing is kept yet."""
    for name in ("_layers", "_estimators", "_worlds"):
        monkeypatch.setattr(kept, name, {})
    monkeypatch.setattr(kept, "_warm", set())
    compiled: list[Scenario] = []

    class Counted(HumanoidWorld):
        def __init__(self, scenario: Scenario, *rest: Any) -> None:
            compiled.append(scenario)
            super().__init__(scenario, *rest)

    monkeypatch.setattr(kept, "HumanoidWorld", Counted)
    return compiled


@pytest.mark.parametrize("turned", [False, True])
def test_bits_are_those_of_a_fresh_process_in_any_order(
    turned: bool, mixed: dict[str, Scenario], fresh: dict[str, str], nothing_kept: list[Scenario]
) -> None:
    assert len(set(fresh.values())) == len(fresh)
    for name, scenario in (*mixed.items(), *mixed.items()) if not turned else reversed(mixed.items()):
        kept.warm_up(scenario)
        if "lost" in name:
            with pytest.raises(InputError, match="lost"):
                kept.run_kept(scenario)
        else:
            assert bits(kept.run_kept(scenario)) == fresh[name], name


def test_a_world_is_compiled_once_for_what_is_compiled_in(
    mixed: dict[str, Scenario], nothing_kept: list[Scenario]
) -> None:
    alike = ("plain", "soft", "late", "other layer", "pendulum")
    for name in (*alike, *alike):
        kept.run_kept(mixed[name])
    assert len(nothing_kept) == 1
    with pytest.raises(InputError):
        kept.run_kept(mixed["lost"])
    kept.run_kept(mixed["plain"])
    assert len(nothing_kept) == 2  # one that was left in the middle of a tick is not used again
    for name in ("slippery", "coarse", "drawn soft", "drawn anew"):
        kept.run_kept(mixed[name])
    assert len(nothing_kept) == 5


def test_a_world_refuses_what_it_was_not_compiled_for(mixed: dict[str, Scenario]) -> None:
    world = HumanoidWorld(mixed["plain"], load_robot("utmu2"))
    world.reset(mixed["late"])
    for name in ("slippery", "drawn soft", "coarse"):
        with pytest.raises(OkiagariError, match="compiled for one robot"):
            world.reset(mixed[name])


def test_the_one_not_asked_for_longest_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "KEPT", 2)
    known: dict[Any, str] = {}
    for key in ("a", "b", "a", "c"):
        kept._kept(known, key, lambda: "made")
    assert list(known) == ["a", "c"]


def test_warming_up_in_the_parent_runs_no_foreign_code(tmp_path: Path, nothing_kept: list[Scenario]) -> None:
    soft = tmp_path / "soft.py"
    soft.write_text(SOFT)
    kept.warm_up_shipped([short(1001, controller=f"{soft}:Soft")])
    assert nothing_kept == []
    kept.warm_up_shipped([short(1001), short(1002)])
    assert [scenario.seed for scenario in nothing_kept] == [1001]


@pytest.mark.parametrize("more", [{}, {"whole_body": "ik"}, {"sensing": {"preset": "cheap", "latency": 0.004}}])
def test_all_compiled_code_is_loaded_by_warming_up(more: dict[str, Any]) -> None:
    program = """
import gc, json, sys
from numba.core.registry import CPUDispatcher
from scenarios.schema import Scenario
from sim.sweep import kept

def loaded():
    return {str(one): len(one.signatures) for one in gc.get_objects() if type(one) is CPUDispatcher}

scenario = Scenario.model_validate(json.loads(sys.stdin.read()))
kept.warm_up(scenario)
before = loaded()
kept.run_kept(scenario)
print(json.dumps([before, loaded()]))
"""
    told = json.dumps(short(1001, controller="supervisor", **more).as_dict())
    ran = subprocess.run([sys.executable, "-c", program], input=told, capture_output=True, text=True, check=True)
    before, after = json.loads(ran.stdout)
    assert sum(before.values()) > 5
    assert after == before
