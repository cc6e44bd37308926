"""The pushes of an episode beside the one that is asked for: a train in its place, or a first one before it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from models.robot import Robot
from scenarios.push import Push
from scenarios.random_pushes import Train
from scenarios.suite import Suite
from sim.results.push_size import edge_distance

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
DIGITS = 6
"""Of drawn values: micrometres and microseconds, and short to read."""


def canonical(value: Any) -> bytes:
    """The same bytes for the same value of JSON types."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def stream(*key: Any) -> np.random.Generator:
    """Random numbers that depend on the key alone."""
    return np.random.default_rng(int.from_bytes(hashlib.sha256(canonical(key)).digest()[:8]))


def train_pushes(suite: Suite, asked: Mapping[str, Any], replica: int, robot: Robot) -> list[dict[str, Any]]:
    """The pushes of a train; a longer one begins with the same pushes.

    Args:
        suite: says how they grow.
        asked: what they share, and the start of the first.
        replica: of which directions are drawn.
        robot: whose omega d their sizes are multiples of.
    """
    train: Train | None = suite.train
    assert train is not None
    rng = stream(suite.seed, "train", replica)
    pushes = []
    for number in range(train.count):
        start = round(asked["start"] + number * train.interval, DIGITS)
        pushes.append({**asked, "start": start, **sized(rng.uniform(*train.direction), train.size(number), robot)})
    return pushes


def first_push(suite: Suite, asked: Mapping[str, Any], parameters: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """The push before the one that is asked for.

    Args:
        suite: says how large it is, and how long before.
        asked: the push that is asked for, as run.
        parameters: of the episode; the direction depends on the replica and, if there are any, the random values, so
            that pushes that differ by the axes follow the same first push.
        robot: whose omega d its size is a multiple of.
    """
    first = suite.first
    assert first is not None
    drawn = {} if suite.random is None else {name: parameters[name] for name in suite.random.given()}
    # A golden section of the range apart, so that a few replicas are spread over it, and more change none of them.
    share = (stream(suite.seed, "first", drawn).random() + parameters["replica"] * _GOLDEN) % 1.0
    low, high = first.direction
    shared = {name: value for name, value in asked.items() if name not in ("direction", "vector", "delta_v", "impulse")}
    start = round(asked["start"] - first.gap - first.duration, DIGITS)
    pushed = sized(low + share * (high - low), first.size, robot)
    return {**shared, "start": start, "duration": first.duration, **pushed}


def sized(direction: float, omega_d: float, robot: Robot) -> dict[str, float]:
    """The fields of a push in a direction [deg], of a size in units of omega d of that direction."""
    direction = round(float(direction), DIGITS)
    unit = Push(start=0.0, direction=direction, impulse=1.0).unit[:2]
    return {"direction": direction, "delta_v": round(omega_d * robot.omega * edge_distance(robot, unit), DIGITS)}
