"""Did recovery get worse than a baseline, beyond chance? The same pushes, paired one by one."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd

from models.errors import InputError
from sim.analysis.baseline import Baseline
from sim.analysis.frame import CASE_COLUMNS, DIGITS, records, recovered, score
from sim.analysis.statistics import ALPHA, paired_p
from sim.analysis.thresholds import Threshold, thresholds
from sim.results.train import SURVIVED

_SERIES = ["controller", "direction_deg", *CASE_COLUMNS]
# Of an episode in its series, which goes upward, all replicas of a level before the next.
_PLACE = ["delta_v", "replica"]


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

    @property
    def whose(self) -> str:
        """Which threshold, in words."""
        where = "".join(f", {name} {value}" for name, value in self.after.case.items())
        return f"threshold of {self.after.controller} to {self.after.direction_deg:g}°{where}"

    @property
    def words(self) -> str:
        """What it was and is."""
        return f"{self.before.delta_v:g} m/s then, {self.after.delta_v:g} m/s now"

    @property
    def dropped(self) -> bool:
        """Whether it is lower by more than one level, which fails the check."""
        return self.levels < -1


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
    lost: Sequence[Mapping[str, Any]]
    unreached: frozenset[str]
    gained: Sequence[Mapping[str, Any]]
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
        return [shift for shift in self.shifts if shift.dropped]

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
    rows = pd.concat([now.rows, baseline.rows]).drop_duplicates("episode").sort_values("episode")
    rows.index = pd.Index(rows["episode"].tolist())
    old, new = (rows.index.isin(one.rows["episode"]) for one in (baseline, now))
    missed = rows[~new & ~_explained(rows, now.rows)]
    if not missed.empty:
        raise NotComparable(
            f"{describe(records(missed)[0])}, of the baseline, was not run now; repeat the sweep with the suite of the "
            "baseline, or make a new baseline with 'okiagari baseline'"
        )
    if not (old & new).any():
        raise NotComparable("no episode of the baseline was run now: seed or axes of the suite have changed")
    paired = old | _explained(rows, baseline.rows)
    was, is_now = (
        score(one.rows.set_index("episode")).reindex(rows.index, fill_value=0)[paired] for one in (baseline, now)
    )
    lost, gained = rows[paired][was > is_now], rows[paired][is_now > was]
    return Comparison(
        pairs=int(paired.sum()),
        trains=bool(rows[SURVIVED].notna().any()),
        before=int(was.sum()),
        after=int(is_now.sum()),
        lost=records(lost.sort_values(["delta_v", "episode"], na_position="first")),
        unreached=frozenset(lost.index) - frozenset(now.rows["episode"]),
        gained=records(gained),
        p=paired_p(len(lost), len(gained)),
        shifts=_shifts(baseline.rows, now.rows),
        unpaired=int((~paired).sum()),
        versions=_differing(baseline.versions, now.versions),
    )


def as_dict(result: Comparison) -> dict[str, Any]:
    """A comparison of JSON types."""
    shifts = [
        {
            "controller": shift.after.controller,
            "direction_deg": shift.after.direction_deg,
            "case": dict(shift.after.case),
            "before": shift.before.delta_v,
            "after": shift.after.delta_v,
            "levels": shift.levels,
        }
        for shift in result.shifts
    ]
    return {
        "worse": result.worse,
        "pairs": result.pairs,
        "before": result.before,
        "after": result.after,
        "lost": [row["episode"] for row in result.lost],
        "gained": [row["episode"] for row in result.gained],
        "p": result.p,
        "thresholds": shifts,
        "unpaired": result.unpaired,
        "versions": {name: list(pair) for name, pair in result.versions.items()},
    }


def junit(result: Comparison, then: Baseline) -> bytes:
    """A comparison as JUnit's XML: one case for recovery as a whole, one for each threshold that moved."""
    cases = [("recovery", result.counts, result.worse_overall)]
    cases += [(shift.whose, shift.words, shift.dropped) for shift in result.shifts]
    suite = ElementTree.Element("testsuite", name=f"okiagari check {then.suite}", tests=str(len(cases)))
    suite.set("failures", str(sum(failed for _, _, failed in cases)))
    for name, words, failed in cases:
        case = ElementTree.SubElement(suite, "testcase", classname=f"okiagari.{then.suite}", name=name)
        told = ElementTree.SubElement(case, "failure" if failed else "system-out")
        told.text = words
        if failed:
            told.set("message", words)
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)


def describe(row: Mapping[str, Any]) -> str:
    """An episode in words."""
    # A train is of many directions and sizes.
    push = "" if row["delta_v"] is None else f"{row['direction_deg']:.4g}°, {row['delta_v']:.4g} m/s, "
    crashed = ", crashed" if row["outcome"] == "crashed" else ""
    return f"episode {row['episode']} ({row['controller']}, {push}replica {row['replica']}{crashed})"


def replay_command(folder: Path, row: Mapping[str, Any]) -> str:
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
    both = now.rows.merge(baseline.rows[["episode", "seed"]], on="episode", suffixes=("", "_then"))
    other = both[both["seed"] != both["seed_then"]]
    if not other.empty:
        raise NotComparable(f"not comparable: {describe(records(other)[0])} had another seed in the baseline")


def _explained(rows: pd.DataFrame, run: pd.DataFrame) -> pd.Series:
    """Whether each episode (n,) is one that was not run because its series had ended in failure before it."""
    series = run.round(DIGITS).sort_values(_PLACE).drop_duplicates(_SERIES, keep="last")
    last = series.assign(failed=~recovered(series))[[*_SERIES, *_PLACE, "failed"]]
    found = rows.round(DIGITS).reset_index(drop=True).merge(last, on=_SERIES, how="left", suffixes=("", "_last"))
    size, end = found["delta_v"], found["delta_v_last"]
    # Trains have no size and are no series.
    beyond = (size > end) | ((size == end) & (found["replica"] > found["replica_last"]))
    return (found["failed"].eq(True) & beyond.fillna(False)).set_axis(rows.index)


def _shifts(old: pd.DataFrame, new: pd.DataFrame) -> list[Shift]:
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
