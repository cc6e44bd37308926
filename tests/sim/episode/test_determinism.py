"""Same scenario, same seed: same bits."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np

from scenarios.catalogue import load
from sim.episode.episode import run_episode

PROGRAM = """
import hashlib
from scenarios.catalogue import load
from sim.episode.episode import run_episode
trace = run_episode(load("push_back", {"seed": 3}), polygons=False).trace
print(hashlib.sha256(trace.values.tobytes(order="C")).hexdigest())
"""


def digest(seed: int) -> str:
    trace = run_episode(load("push_back", {"seed": seed}), polygons=False).trace
    return hashlib.sha256(trace.values.tobytes(order="C")).hexdigest()


def test_twice_in_one_process_and_once_in_another() -> None:
    first = digest(3)
    assert digest(3) == first
    other = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert other.stdout.split()[-1] == first


def test_another_seed_starts_from_another_pose() -> None:
    traces = [run_episode(load("quiet", {"seed": seed, "duration": 0.1})).trace for seed in (0, 1)]
    assert not np.array_equal(traces[0]["q_left_knee"], traces[1]["q_left_knee"])
    leans = [run_episode(load("quiet", {"seed": seed, "duration": 0.1, "world": "pendulum"})).trace for seed in (0, 1)]
    assert leans[0]["cog_x"][0] != leans[1]["cog_x"][0]
