"""What the whole loop costs beside the bare physics, and how much faster than real time an episode runs.

python -m tests.benchmarks loop                  # the table
python -m tests.benchmarks loop_kept             # writes the ratios to baselines/loop.json
python -m tests.benchmarks loop_check            # exit code 1 if one has grown by a quarter since
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco

from models.arena import build_arena
from models.robot import STAND, load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import EpisodeResult, run_episode
from tests.benchmarks.timing import best_of, in_words, show, table

KEPT = Path("baselines/loop.json")
# A ratio that is larger than what was kept by this factor has grown, and not only on another machine: one commit,
# a0584c6, cost at most 1.25 times what was kept on one day and 1.25 to 1.5 times on another; some runs cost 1.8.
GROWN = 2.0
# (name, overrides): standing on its own, then the paper's third push on an early clock with all that follows it.
_THIRD = [{"start": 0.5, "direction": 0.0, "delta_v": 0.4}]
EPISODES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("standing", {"duration": 2.0}),
    ("pushed, stepping", {"duration": 4.0, "pushes": _THIRD}),
)
SENSES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("exact", {}),
    ("typical, 4 ms", {"preset": "typical", "latency": 0.004}),
)
LAYERS = ("dynamics", "ik")
REPEATS = 3


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a kind of episode costs.

    Attributes:
        name: of the episode, the layer and the senses.
        result: of the first run.
        bare: one mj_step of the standing robot, servos holding, nobody looking [s].
        loop: one physics step of the loop [s].
    """

    name: tuple[str, str, str]
    result: EpisodeResult
    bare: float
    loop: float

    @property
    def key(self) -> str:
        """The name in one word."""
        return ", ".join(self.name)

    @property
    def ratio(self) -> float:
        """Loop to bare step."""
        return self.loop / self.bare


def bare_step(scenario: Scenario) -> float:
    """Best wall time of one mj_step of the standing robot, servos holding, nobody looking [s]."""
    robot = load_robot(scenario.robot)
    model = build_arena(robot.path, timestep=scenario.timing.physics).compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_step(model, data, 200)
    return best_of(lambda: mujoco.mj_step(model, data, 500), repeats=3) / 500


def kinds() -> Iterator[tuple[tuple[str, str, str], Scenario]]:
    """Name and scenario of every kind."""
    quiet = load("quiet").as_dict()
    for senses, sensing in SENSES:
        for name, overrides in EPISODES:
            for layer in LAYERS:
                given = quiet | overrides | {"whole_body": layer, "sensing": sensing}
                yield (name, layer, senses), Scenario.model_validate(given)


def cost(name: tuple[str, str, str], scenario: Scenario) -> Cost:
    """Measure one kind."""
    # In turn, so that both sides of the ratio see the same neighbours on the machine.
    bare, results = bare_step(scenario), []
    for _ in range(REPEATS):
        results.append(run_episode(scenario, polygons=False))
        bare = min(bare, bare_step(scenario))
    loop = scenario.timing.physics / max(result.real_time_factor for result in results)
    return Cost(name=name, result=results[0], bare=bare, loop=loop)


def main() -> None:
    """Print the table."""
    quiet = load("quiet")
    made = table(
        f"Whole loop, {1e3 * quiet.timing.physics:g} ms physics, {1e3 * quiet.timing.control:g} ms control, one core",
        "episode", "whole body", "senses", "outcome", "steps", "bare mj_step", "loop a step", "ratio", "real time",
    )  # fmt: skip
    for one in (cost(*kind) for kind in kinds()):
        outcome, physics = one.result.outcome, quiet.timing.physics
        made.add_row(
            *one.name, outcome.result.value, str(outcome.steps_taken), in_words(one.bare), in_words(one.loop),
            f"{one.ratio:.1f}", f"{physics / one.loop:.1f}x",
        )  # fmt: skip
    show(made)


def keep() -> None:
    """Write the ratios of now."""
    ratios = {one.key: round(one.ratio, 2) for one in (cost(*kind) for kind in kinds())}
    KEPT.write_text(json.dumps({"ratio to a bare mj_step": ratios}, indent=1) + "\n", encoding="utf-8")
    print(KEPT)


def check() -> None:
    """Compare with the ratios that were kept; exit code 1 if one has grown, with a line for each that has."""
    kept = json.loads(KEPT.read_text(encoding="utf-8"))["ratio to a bare mj_step"]
    grown = []
    for kind in kinds():
        one = cost(*kind)
        if one.ratio > GROWN * kept[one.key]:
            one = cost(*kind)  # once more: what disturbs a machine seldom does so twice
        if one.ratio > GROWN * kept[one.key]:
            grown.append(f"the loop of {one.key!r} costs {one.ratio:.1f} bare steps; it was {kept[one.key]:.1f}")
    print("\n".join(grown) or f"no ratio of {KEPT} has grown by more than {100 * (GROWN - 1):.0f} %")
    sys.exit(bool(grown))


if __name__ == "__main__":
    main()
