"""What the whole loop costs beside the bare physics, and how much faster than real time an episode runs."""

from __future__ import annotations

import mujoco
from rich.table import Table

from models.arena import build_arena
from models.robot import STAND, load_robot
from scenarios.catalogue import load
from scenarios.schema import Scenario
from sim.episode.episode import run_episode
from tests.benchmarks.timing import best_of, in_words, show, table

# (name, overrides): standing on its own, then the paper's third push on an early clock with all that follows it.
_THIRD = [{"start": 0.5, "direction": 0.0, "delta_v": 0.4}]
EPISODES: tuple[tuple[str, dict[str, object]], ...] = (
    ("standing", {"duration": 2.0}),
    ("pushed, stepping", {"duration": 4.0, "pushes": _THIRD}),
)
REPEATS = 3


def bare_step(scenario: Scenario) -> float:
    """Best wall time of one mj_step of the standing robot, servos holding, nobody looking [s]."""
    robot = load_robot(scenario.robot)
    model = build_arena(robot.path, timestep=scenario.timing.physics).compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(STAND).id)
    mujoco.mj_step(model, data, 200)
    return best_of(lambda: mujoco.mj_step(model, data, 500), repeats=3) / 500


def _row(made: Table, name: str, scenario: Scenario) -> None:
    # In turn, so that both sides of the ratio see the same neighbours on the machine.
    bare, results = bare_step(scenario), []
    for _ in range(REPEATS):
        results.append(run_episode(scenario, polygons=False))
        bare = min(bare, bare_step(scenario))
    factor = max(result.real_time_factor for result in results)
    loop = scenario.timing.physics / factor
    outcome = results[0].outcome
    made.add_row(
        name, scenario.whole_body.short, outcome.result.value, str(outcome.steps_taken), in_words(bare), in_words(loop),
        f"{loop / bare:.1f}", f"{factor:.1f}x",
    )  # fmt: skip


def main() -> None:
    """Print the table."""
    quiet = load("quiet")
    made = table(
        f"Whole loop, {1e3 * quiet.timing.physics:g} ms physics, {1e3 * quiet.timing.control:g} ms control, one core",
        "episode", "whole body", "outcome", "steps", "bare mj_step", "loop a physics step", "ratio", "real time",
    )  # fmt: skip
    for name, overrides in EPISODES:
        for whole_body in ("dynamics", "ik"):
            given = quiet.as_dict() | overrides | {"whole_body": whole_body}
            _row(made, name, Scenario.model_validate(given))
    show(made)


if __name__ == "__main__":
    main()
