"""The sets: what each operation costs, beside a peer or a plain way of doing it in the same run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from rich.table import Table

from controllers.admissible.moa import MoaSet, regulator_set
from controllers.admissible.tracking_sets import tracking_sets
from controllers.baselines.paper import STRIDE
from controllers.gains import dcm, lqr
from controllers.geometry.support_polygon import standing_feet, support_polygon
from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import step_sets
from controllers.pendulum import Pendulum
from controllers.reference.walking_reference import walk_plan
from models.robot import load_robot
from sim.set_study.walk import DT
from tests.benchmarks.naive import gilbert_tan, library_set, paper_phase, reduced, rows_with_redundant_ones
from tests.benchmarks.timing import best_of, in_words, show, table
from tests.controllers.nstep.stepping_plane import best_by_program

_SEED = 2016


class Bench:
    """The stand-in's sets, and a table that fills row by row."""

    def __init__(self) -> None:
        self.table: Table = table(
            "Sets of the stand-in, LQR Q = I, R = 1 unless stated; best of several runs",
            "operation", "rows", "ours", "wanted", "beside", "takes", "ratio",
        )  # fmt: skip
        self.robot = load_robot("utmu2")
        self.feet = standing_feet(self.robot)
        self.rng = np.random.default_rng(_SEED)

    def row(self, name: str, rows: int, ours: float, wanted: str, peer: str, takes: float) -> None:
        """Add a row; times in s."""
        self.table.add_row(name, str(rows), in_words(ours), wanted, peer, in_words(takes), f"{takes / ours:,.0f}")

    def hexagon(self, pendulum: Pendulum) -> Callable[[], MoaSet]:
        """Computes the regulator's set with the right foot a stride ahead."""
        ahead = self.feet["right"].moved(self.feet["right"].position + np.array([STRIDE, 0.0]))
        polygon = support_polygon([self.feet["left"], ahead])
        gain = lqr(pendulum, (1.0, 1.0), 1.0)
        return lambda: regulator_set(pendulum, gain, polygon)

    def regulator_sets(self) -> None:
        """4-D sets at 5 ms and 1 ms."""
        pendulum = Pendulum(self.robot.omega, DT)
        compute = self.hexagon(pendulum)
        moa = compute()
        ours = best_of(compute, repeats=20)
        name = "4-D regulator set, hexagon, dt 5 ms"
        textbook = best_of(lambda: gilbert_tan(pendulum, moa), repeats=1)
        self.row(name, len(moa.a), ours, "≤ 3 ms", "Gilbert-Tan by scipy linprog", textbook)
        S, a = rows_with_redundant_ones(pendulum, moa, 2 * (moa.t_star + 1))
        library = best_of(lambda: reduced(S, a), repeats=1)
        self.row(name, len(moa.a), ours, "≤ 3 ms", f"one polytope.reduce of {len(a)} rows", library)

        fine = Pendulum(self.robot.omega, 0.001)
        compute = self.hexagon(fine)
        moa = compute()
        textbook = best_of(lambda: gilbert_tan(fine, moa), repeats=1)
        ours = best_of(compute, repeats=10)
        self.row("the same, dt 1 ms", len(moa.a), ours, "≤ 150 ms", "Gilbert-Tan by scipy linprog", textbook)

    def tracking(self) -> None:
        """All phases of the walk."""
        pendulum = Pendulum(self.robot.omega, DT)
        reference = walk_plan(pendulum, self.feet).reference
        for gain, wanted in ((lqr(pendulum, (1.0, 1.0), 1.0), "≤ 30 ms"), (dcm(pendulum, 1.5), "< 1 ms")):
            terminal = regulator_set(pendulum, gain, reference.final, centre=reference.xi[-1, 0::2])
            sets = tracking_sets(pendulum, gain, reference, terminal)
            ours = best_of(lambda g=gain, t=terminal: tracking_sets(pendulum, g, reference, t), repeats=10)
            plain = best_of(lambda s=sets: [paper_phase(s, k) for k in range(s.m + 1)], repeats=1)
            name = f"{sets.m + 1} tracking sets of the walk, {'LQR' if gain.name.startswith('lqr') else gain.name}"
            self.row(name, len(sets.a), ours, wanted, "(31)-(41) phase by phase, unpruned", plain)
            if gain.name.startswith("lqr"):
                self._ask_phases(sets)

    def _ask_phases(self, sets: Any) -> None:
        x = sets.reference.xi[50] + 1e-3
        ours = best_of(lambda: sets.slack_all(x), batch=200)
        plain = best_of(lambda: [sets.polytope(k).slack(x) for k in range(sets.m + 1)], repeats=3)
        self.row(f"one state, all {sets.m + 1} phases", len(sets.a), ours, "≤ 20 µs", "one phase after another", plain)

    def queries(self) -> None:
        """Membership of one state and of a million."""
        moa = self.hexagon(Pendulum(self.robot.omega, DT))()
        world = moa.in_world()
        library = library_set(world.S, world.a)
        x = moa.x_C + np.array([1e-3, 1e-2, 1e-3, 1e-2])
        assert moa.contains(x)
        assert x in library
        ours = best_of(lambda: moa.slack(x), batch=2000)
        peer = best_of(lambda: x in library, batch=500)
        self.row("one state, one set", len(moa.a), ours, "≤ 1 µs", "x in polytope.Polytope", peer)
        spread = np.array([0.05, 0.3, 0.05, 0.3])
        many = moa.x_C + self.rng.uniform(-spread, spread, (1_000_000, 4))
        tenth = np.ascontiguousarray(many[:100_000].T)
        ours = best_of(lambda: moa.slacks(many), repeats=3)
        # A tenth of the states at a time, or its matrix of all slacks would need more than a gigabyte.
        peer = 10.0 * best_of(lambda: library.contains(tenth), repeats=3)
        self.row("10⁶ states, one set", len(moa.a), ours, "≤ 50 ms", "polytope.Polytope.contains", peer)

    def step_sets(self) -> None:
        """Whether some of up to eight steps recover, and where to land."""
        pendulum = Pendulum(self.robot.omega, 0.002)
        limits = StepLimits(max_stride=0.16, min_width=0.076, max_width=0.22, stance_width=0.084, swing_speed=3.0)
        sole, times = self.robot.sole_vertices["left"], (0.15, 0.2)
        sets = step_sets(pendulum, 1.5, sole, limits, times, 8, edge=0.003)
        middle = sets.polygon(2, "right", 0.1, step_time=0.15).vertices().mean(axis=0)
        swing, toward = np.array([0.0, limits.stance_width]), np.array([0.0, limits.stance_width])
        rows = sum(len(sets.polygon(n, "right", 0.1, swing, step_time=0.15).a) for n in range(1, 9))

        def each_polygon() -> list[float]:
            return [float(sets.polygon(n, "right", 0.1, swing, step_time=0.15).slack(middle)) for n in range(1, 9)]

        name = "1 to 8 steps that re-plan"
        ours = best_of(lambda: step_sets(pendulum, 1.5, sole, limits, times, 8, edge=0.003), repeats=20)
        noisy = best_of(lambda: step_sets(pendulum, 1.5, sole, limits, times, 8, zmp_error=0.003), repeats=20)
        self.row(f"{name}: all tables", rows, ours, "", "the same with a ZMP error", noisy)
        ours = best_of(lambda: sets.slacks(middle, "right", 0.1, swing, 0.15), batch=500)
        self.row(f"{name}: one state", rows, ours, "≤ 15 µs", "polygon by polygon", best_of(each_polygon, batch=20))
        for steps in (1, 2, 8):
            question = (sets, middle, "right", 0.1, swing, 0.15, steps, toward, 0.01)
            ours = best_of(lambda q=question: choose_foothold(*q), batch=200)
            peer = best_of(lambda n=steps: best_by_program(sets, (n, "right", 50, swing, 0.15), middle), repeats=20)
            self.row(f"foothold and ZMP, {steps} to do", rows, ours, "≤ 60 µs", "HiGHS, all steps at once", peer)


def main() -> None:
    """Print the table."""
    bench = Bench()
    bench.regulator_sets()
    bench.tracking()
    bench.queries()
    bench.step_sets()
    show(bench.table)


if __name__ == "__main__":
    main()
