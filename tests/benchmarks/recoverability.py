"""How well the slack of slower feet's sets tells recovered from lost, by their share of the swing speed.

`BODY_SPEED` of `controllers/stepping/recoverability.py` is read off this table. Its pushes are those of the suite
`truth`, but hard ones only, and of a seed of which no suite is. It takes five minutes, so only by name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from rich.progress import track

from controllers.stepping.recoverability import BODY_SPEED, Recoverability
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import step_limits
from controllers.supervisor.policies import SOFTER
from controllers.supervisor.supervisor import Supervisor
from models.robot import load_robot
from scenarios.schema import Scenario
from scenarios.suite_catalogue import load_suite
from sim.analysis.calibration import FARTHEST
from sim.analysis.statistics import auc, brier, fit_logistic
from sim.episode.build import make_controller
from sim.episode.episode import run_episode
from sim.record.outcome import Result
from sim.sweep.executors import local
from sim.sweep.plan import plan, scenario_of
from tests.benchmarks.timing import show, table

SEED, PUSHES, WORKERS = 1000, 720, 2
# Harder than this [m/s] the outcome is open.
HARD = 0.7
SPEEDS = (0.3, 0.4, 0.5, 0.6, 0.72, 0.85, 1.0)


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A push and its end: what was asked then.

    Attributes:
        standing: whether it was of both feet on the floor.
        question: the arguments.
        recovered: what became of it.
    """

    standing: bool
    question: tuple[Any, ...]
    recovered: bool

    def slack(self, recoverability: Recoverability) -> float:
        """The predicted slack [cm]."""
        told = (recoverability.standing if self.standing else recoverability.stepping)(*self.question)
        return float(np.clip(100.0 * told, -FARTHEST, FARTHEST))


class Noting(Recoverability):
    """Notes the first question."""

    first: tuple[bool, tuple[Any, ...]] | None = None

    def standing(self, *question: Any) -> float:
        """Note and answer."""
        self.first = self.first or (True, question)
        return super().standing(*question)

    def stepping(self, *question: Any) -> float:
        """Note and answer."""
        self.first = self.first or (False, question)
        return super().stepping(*question)


@cache
def hard_pushes() -> tuple[Scenario, ...]:
    """Pushes as of the suite `truth`, but others, all of them hard, and on the humanoid only."""
    loaded = load_suite("truth")
    drawn = loaded.suite.random
    assert drawn is not None
    assert drawn.delta_v is not None
    changed = {
        "seed": SEED,
        "random": drawn.model_copy(update={"count": PUSHES, "delta_v": (HARD, drawn.delta_v[1])}),
        "axes": loaded.suite.axes.model_copy(update={"world": ["humanoid"]}),
    }
    hard = replace(loaded, suite=loaded.suite.model_copy(update=changed))
    return tuple(scenario_of(hard, episode) for series in plan(hard) for episode in series.episodes)


def brain_of(scenario: Scenario) -> Supervisor:
    """Whose prediction is asked."""
    controller = make_controller(scenario, load_robot(scenario.robot))
    assert isinstance(controller, Supervisor)
    return controller


def recoverability_of(
    controller: Supervisor, speed: float, kind: type[Recoverability] = Recoverability
) -> Recoverability:
    """The prediction for feet with a share of the swing speed that the controller asks of them."""
    limits = step_limits(controller.robot, controller.options.max_stride)
    slower = replace(limits, swing_speed=speed * limits.swing_speed)
    return kind(SetPolicy(controller.robot, controller.pendulum, controller.options, min(SOFTER), slower))


def ask(scenario: Scenario) -> Asked | None:
    """Run a push; None if it fells before its end."""
    controller = brain_of(scenario)
    noting = controller.recoverability = recoverability_of(controller, 1.0, Noting)
    assert isinstance(noting, Noting)
    result = run_episode(scenario, robot=controller.robot, controller=controller, polygons=False)
    if noting.first is None:
        return None
    standing, question = noting.first
    recovered = result.outcome.result is Result.RECOVERED
    return Asked(standing=standing, question=question, recovered=recovered)


def main() -> None:
    """Print the table."""
    with local(WORKERS) as workers, workers.make() as crew:
        answered = track(crew.map(ask, hard_pushes()), description="pushes", total=PUSHES)
        pushes = [asked for asked in answered if asked is not None]
    well = np.array([push.recovered for push in pushes], dtype=np.float64)
    title = f"{len(pushes)} pushes of {HARD} m/s and more, {well.sum():.0f} of them recovered; used: {BODY_SPEED}"
    made = table(title, "share of speed", "AUC", "Brier score of a logistic fit", "log odds on the rim")
    controller = brain_of(hard_pushes()[0])
    for speed in SPEEDS:
        recoverability = recoverability_of(controller, speed)
        slacks = np.array([push.slack(recoverability) for push in pushes])
        design = np.column_stack([np.ones_like(slacks), slacks])
        coefficients, _ = fit_logistic(design, well, 0.0)
        told, area = 1.0 / (1.0 + np.exp(-(design @ coefficients))), auc(slacks, well)
        assert area is not None
        made.add_row(f"{speed:g}", f"{area['value']:.3f}", f"{brier(told, well):.4f}", f"{coefficients[0]:+.2f}")
    show(made)
