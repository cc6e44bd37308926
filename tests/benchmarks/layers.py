"""What a call of each whole-body layer costs, on the same observations and commands.

python -m tests.benchmarks layers
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from controllers.interface import BalanceCommand, JointTargets, Observation, WholeBodyLayer
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_layer
from sim.episode.episode import run_episode
from tests.benchmarks.timing import in_words, show, table

Tick = tuple[Observation, BalanceCommand]

# (name, what a scenario says of the layer)
LAYERS: tuple[tuple[str, Any], ...] = (
    ("dynamics", "dynamics"),
    ("dynamics, solved by placo", {"name": "dynamics", "solver": "placo"}),
    ("ik", "ik"),
)
REPEATS = 25
# Of a strong push ahead, until the robot has taken its steps.
_PUSHED = {"duration": 3.0, "pushes": [{"start": 0.5, "direction": 10.0, "delta_v": 0.6}]}
_STANDING = {"duration": 1.0}


class Recorder:
    """A layer that keeps what it was given, and hands it on."""

    follows_acceleration = True

    def __init__(self, layer: WholeBodyLayer) -> None:
        self._layer = layer
        self.ticks: list[Tick] = []

    def reset(self) -> None:
        """Forget the last episode."""
        self._layer.reset()
        self.ticks.clear()

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        """Those of the layer."""
        self.ticks.append((observation, command))
        return self._layer.targets(observation, command)


def recorded(changes: dict[str, Any]) -> list[Tick]:
    """What `dynamics` was given in an episode."""
    scenario = load("quiet", changes)
    recorder = Recorder(make_layer(scenario, load_robot(scenario.robot)))
    run_episode(scenario, layer=recorder, polygons=False)
    return recorder.ticks


def costs(layers: Sequence[WholeBodyLayer], ticks: Sequence[Tick]) -> list[float]:
    """Mean time of a call of each layer [s]; of each tick counts the best of some runs, taken in turn."""
    best = np.full((len(layers), len(ticks)), np.inf)
    for _ in range(REPEATS):
        for i, layer in enumerate(layers):
            layer.reset()
            for j, (observation, command) in enumerate(ticks):
                begin = time.perf_counter()
                layer.targets(observation, command)
                best[i, j] = min(best[i, j], time.perf_counter() - begin)
    means: list[float] = best.mean(axis=1).tolist()
    return means


def main() -> None:
    """Print the table."""
    scenarios = [load("quiet", {"whole_body": named}) for _, named in LAYERS]
    layers = [make_layer(scenario, load_robot(scenario.robot)) for scenario in scenarios]
    standing = recorded(_STANDING)
    swinging = [tick for tick in recorded(_PUSHED) if not all(foot.stance for foot in tick[1].feet.values())]
    made = table(
        "One call of a whole-body layer, mean over the ticks of an episode, each the best of several runs, one core",
        "layer", f"standing ({len(standing)} ticks)", f"a foot in the air ({len(swinging)})", "to dynamics",
    )  # fmt: skip
    costs_of = list(zip(costs(layers, standing), costs(layers, swinging), strict=True))
    for (name, _), (still, stepping) in zip(LAYERS, costs_of, strict=True):
        first = costs_of[0]
        made.add_row(name, in_words(still), in_words(stepping), f"{still / first[0]:.2f}, {stepping / first[1]:.2f}")
    show(made)


if __name__ == "__main__":
    main()
