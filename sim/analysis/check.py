"""Did recovery get worse than a baseline, beyond chance? The same pushes, paired one by one."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from models.errors import InputError
from sim.analysis.baseline import Baseline
from sim.analysis.statistics import ALPHA, Row, grouped, number, paired_p, recovered
from sim.analysis.thresholds import CASE_COLUMNS, Threshold, thresholds
from sim.results.train import SURVIVED, score

_SERIES = ("controller", "direction_deg", *CASE_COLUMNS)


class NotComparable(InputError):
    """Two sweeps that did not try the same."""


@dataclass(frozen=True, kw_only=True)
class Shift:
    """A threshold that moved.

    Attributes:
        before, after: the threshold in the baseline and now; same controller, direction and case.
        levels: by how many levels of the suite; negative is worse.
    """

    before: Threshold
    after: Threshold
    levels: int


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What changed between a baseline and now.

    Attributes:
        pairs: episodes that were compared.
        trains: whether they are trains of pushes; then a train that survives fewer pushes is lost, one that survives
            more is gained.
        before, after: how many of them were recovered in the baseline and now; of trains, how many pushes.
        lost: episodes that were recovered and no longer are, weakest push first.
        unreached: of these, names of the ones that were not run again since the adaptive series ended before them.
        gained: episodes that were not recovered and now are.
        p: of the exact McNemar test over all pairs.
        shifts: thresholds that moved, the worst first.
        unpaired: episodes of now that the baseline knows nothing of; they count for nothing.
        versions: library -> version in the baseline and now, where they differ.
    """

    pairs: int
    trains: bool
    before: int
    after: int
    lost: Sequence[Row]
    unreached: frozenset[str]
    gained: Sequence[Row]
    p: float
    shifts: Sequence[Shift]
    unpaired: int
    versions: Mapping[str, tuple[str, str]]

    @property
    def counts(self) -> str:
        """How many there were then and now, in words."""
        if self.trains:
            return f"{self.before} pushes survived then, {self.after} now, in {self.pairs} trains"
        return f"{self.before} of {self.pairs} recovered then, {self.after} now"

    @property
    def worse_overall(self) -> bool:
        """Whether more episodes were lost than gained, beyond chance."""
        return len(self.lost) > len(self.gained) and self.p < ALPHA

    @property
    def dropped(self) -> list[Shift]:
        """Thresholds that dropped by more than one level."""
        return [shift for shift in self.shifts if shift.levels < -1]

    @property
    def worse(self) -> bool:
        """Whether the check fails."""
        return self.worse_overall or bool(self.dropped)


def compare(baseline: Baseline, now: Baseline) -> Comparison:
    """Compare two sweeps of the same suite.

    An adaptive series ends after failures only, so what the other sweep tried beyond its end counts as not
    recovered in it.

    Raises:
        NotComparable: if they are not of the same suite and robots, or now lacks episodes of the baseline.
    """
    _check(baseline, now)
    old, new = ({row["episode"]: row for row in one.rows} for one in (baseline, now))
    beyond_old, beyond_new = _Ends(baseline.rows), _Ends(now.rows)
    lost, gained, unreached = [], [], set()
    pairs = before = after = unpaired = 0
    for name in sorted(old.keys() | new.keys()):
        row = new.get(name) or old[name]
        if name not in new and not beyond_new.explain(row):
            raise NotComparable(
                f"{describe(row)}, of the baseline, was not run now; repeat the sweep with the suite of the baseline, "
                "or make a new baseline with 'okiagari baseline'"
            )
        if name not in old and not beyond_old.explain(row):
            unpaired += 1
            continue
        was, is_now = (score(one[name]) if name in one else 0 for one in (old, new))
        pairs, before, after = pairs + 1, before + was, after + is_now
        if was > is_now:
            lost.append(row)
            if name not in new:
                unreached.add(name)
        elif is_now > was:
            gained.append(row)
    if not old.keys() & new.keys():
        raise NotComparable("no episode of the baseline was run now: seed or axes of the suite have changed")
    return Comparison(
        pairs=pairs,
        trains=any(row[SURVIVED] is not None for row in (*baseline.rows, *now.rows)),
        before=before,
        after=after,
        lost=sorted(lost, key=lambda row: (_size(row), str(row["episode"]))),
        unreached=frozenset(unreached),
        gained=gained,
        p=paired_p(len(lost), len(gained)),
        shifts=_shifts(baseline.rows, now.rows),
        unpaired=unpaired,
        versions=_differing(baseline.versions, now.versions),
    )


def describe(row: Row) -> str:
    """An episode in words."""
    # A train is of many directions and sizes.
    push = "" if row["delta_v"] is None else f"{row['direction_deg']:.4g}°, {row['delta_v']:.4g} m/s, "
    return f"episode {row['episode']} ({row['controller']}, {push}replica {row['replica']})"


def replay_command(folder: Path, row: Row) -> str:
    """What to type to see an episode."""
    return f"okiagari replay {shlex.quote(str(folder))} {row['episode']} --video"


def _check(baseline: Baseline, now: Baseline) -> None:
    for what, then, today in (
        ("suite", baseline.suite, now.suite),
        ("robot", ", ".join(baseline.robots), ", ".join(now.robots)),
        ("seed of the suite", baseline.seed, now.seed),
    ):
        if then != today:
            raise NotComparable(f"not comparable: the baseline is of {what} {then!r}, the sweep of {today!r}")
    seeds = {row["episode"]: row["seed"] for row in baseline.rows}
    other = next((row for row in now.rows if seeds.get(row["episode"], row["seed"]) != row["seed"]), None)
    if other is not None:
        raise NotComparable(f"not comparable: {describe(other)} had another seed in the baseline")


class _Ends:
    """Where each series of a sweep ends, and whether in failure."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._last: dict[tuple[Any, ...], Row] = {}
        for key, tries in grouped(rows, _SERIES).items():
            self._last[key] = max(tries, key=_rank)

    def explain(self, row: Row) -> bool:
        """Whether an episode was not run because its series had ended in failure before it."""
        if row["delta_v"] is None:
            return False  # trains are no series
        (key,) = grouped([row], _SERIES)
        last = self._last.get(key)
        return last is not None and not recovered(last) and _rank(row) > _rank(last)


def _rank(row: Row) -> tuple[float, int]:
    """The place of an episode in its series, which goes upward, all replicas of a level before the next."""
    return _size(row), int(row["replica"])


def _size(row: Row) -> float:
    return number(row["delta_v"]) or 0.0


def _shifts(old: Sequence[Row], new: Sequence[Row]) -> list[Shift]:
    before = {one.key: one for one in thresholds(old, beside=new)}
    after = {one.key: one for one in thresholds(new, beside=old)}
    shifts = [
        Shift(before=before[key], after=after[key], levels=after[key].index - before[key].index)
        for key in before.keys() & after.keys()
        if before[key].index != after[key].index
    ]
    return sorted(shifts, key=lambda shift: (shift.levels, str(shift.after.key)))


def _differing(old: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    names = sorted(old.keys() | new.keys())
    pairs = {name: (old.get(name, "none"), new.get(name, "none")) for name in names}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
