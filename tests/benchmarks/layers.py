"""What a call of each whole-body layer costs, on the same observations and commands.

python -m tests.benchmarks layers
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from controllers.interface import WholeBodyLayer
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_layer
from tests.benchmarks.timing import in_words, show, table
from tests.controllers.recorded_layer import Tick, recorded

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


def costs(layers: Sequence[WholeBodyLayer], ticks: Sequence[Tick]) -> list[float]:
    """Mean time of a call of each layer [s]; of each tick counts the best of some runs, taken in turn."""
    best = np.full((len(layers), len(ticks)), np.inf)
    for _ in range(REPEATS):
        for i, layer in enumerate(layers):
            layer.reset()
            for j, tick in enumerate(ticks):
                begin = time.perf_counter()
                layer.targets(tick.seen, tick.command)
                best[i, j] = min(best[i, j], time.perf_counter() - begin)
    means: list[float] = best.mean(axis=1).tolist()
    return means


def main() -> None:
    """Print the table."""
    scenarios = [load("quiet", {"whole_body": named}) for _, named in LAYERS]
    layers = [make_layer(scenario, load_robot(scenario.robot)) for scenario in scenarios]
    _, standing = recorded(_STANDING)
    swinging = [tick for tick in recorded(_PUSHED)[1] if not tick.stands]
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
