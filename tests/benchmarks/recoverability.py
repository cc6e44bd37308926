"""What to count on when the recovery of a body is predicted: false safes and false alarms, by swing speed and margin.

`BODY_SPEED` and `BODY_MARGIN` of `controllers/stepping/recoverability.py` are read off this table. Its pushes are those
of the suite `truth`, but hard ones only, and of a seed of which no suite is. It takes ten minutes, so only by name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from rich.progress import track

from controllers.stepping.recoverability import BODY_MARGIN, BODY_SPEED, Recoverability
from controllers.stepping.set_policy import SetPolicy
from controllers.stepping.step_policy import step_limits
from controllers.supervisor.policies import SOFTER
from controllers.supervisor.supervisor import Supervisor
from models.robot import load_robot
from scenarios.schema import Scenario
from scenarios.suite_catalogue import load_suite
from sim.episode.build import make_controller
from sim.episode.episode import run_episode
from sim.record.outcome import Result
from sim.sweep.executors import local
from sim.sweep.plan import plan, scenario_of
from tests.benchmarks.timing import show, table

SEED, PUSHES, WORKERS = 1000, 720, 2
# Harder than this [m/s] the outcome is open. The share of the pushes of `truth` that are weaker counts as predicted and
# recovered, as all but a few are.
HARD = 0.7
SPEEDS = (0.4, 0.5, 0.6, 0.72, 1.0)
MARGINS = (0.0, 0.02, 0.04, 0.05, 0.06, 0.07, 0.08)


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A push and its end: what was asked then.

    Attributes:
        standing: whether it was of both feet on the floor.
        question: the arguments.
        regulator: slack in the regulator's sets [m of ZMP]; NaN in the air.
        recovered: what became of it.
    """

    standing: bool
    question: tuple[Any, ...]
    regulator: float
    recovered: bool

    def predicted(self, recoverability: Recoverability, margin: float) -> float:
        """The predicted slack, grown by a margin [m]."""
        told = (recoverability.standing if self.standing else recoverability.stepping)(*self.question) + margin
        return told if math.isnan(self.regulator) else max(told, self.regulator)


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
    changed = {
        "seed": SEED,
        "random": drawn.model_copy(update={"count": PUSHES, "delta_v": (HARD, weakest_and_hardest()[1])}),
        "axes": loaded.suite.axes.model_copy(update={"world": ["humanoid"]}),
    }
    hard = replace(loaded, suite=loaded.suite.model_copy(update=changed))
    return tuple(scenario_of(hard, episode) for series in plan(hard) for episode in series.episodes)


def weakest_and_hardest() -> tuple[float, float]:
    """The sizes of the pushes of `truth` [m/s]."""
    drawn = load_suite("truth").suite.random
    assert drawn is not None
    assert drawn.delta_v is not None
    return drawn.delta_v


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
    (push,) = result.pushes
    if noting.first is None or push.regulator_slack is None:
        return None
    standing, question = noting.first
    recovered = result.outcome.result is Result.RECOVERED
    return Asked(standing=standing, question=question, regulator=push.regulator_slack, recovered=recovered)


def rates(pushes: list[Asked], slacks: list[float]) -> tuple[float, float]:
    """False safe and false alarm, with as many weaker pushes as `truth` has."""
    low, high = weakest_and_hardest()
    weaker = len(pushes) * (HARD - low) / (high - HARD)
    safe = [push.recovered for push, slack in zip(pushes, slacks, strict=True) if slack >= 0.0]
    unsafe = [push.recovered for push, slack in zip(pushes, slacks, strict=True) if slack < 0.0]
    return safe.count(False) / (len(safe) + weaker), sum(unsafe) / max(len(unsafe), 1)


def main() -> None:
    """Print the table."""
    with local(WORKERS) as workers, workers.make() as crew:
        answered = track(crew.map(ask, hard_pushes()), description="pushes", total=PUSHES)
        pushes = [asked for asked in answered if asked is not None]
    lost = sum(not push.recovered for push in pushes)
    title = f"False safe / false alarm, {len(pushes)} pushes of {HARD} m/s and more, {lost} of them lost"
    made = table(f"{title}; used: {BODY_SPEED}, {BODY_MARGIN} m", "share of speed", *(f"{m:g} m" for m in MARGINS))
    controller = brain_of(hard_pushes()[0])
    for speed in SPEEDS:
        recoverability = recoverability_of(controller, speed)
        told = [rates(pushes, [push.predicted(recoverability, margin) for push in pushes]) for margin in MARGINS]
        made.add_row(f"{speed:g}", *(f"{100 * safe:.1f} / {100 * alarm:.0f} %" for safe, alarm in told))
    show(made)
