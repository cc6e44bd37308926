"""Rates with their intervals, and whether two runs differ beyond chance; the formulas are statsmodels'."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.proportion import proportion_confint

Row = Mapping[str, Any]
"""An episode of a sweep's table: column -> value; None or NaN where there is none."""

ALPHA = 0.05
"""Chance of being wrong that every interval and test accepts."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Rate:
    """How often something happened.

    Attributes:
        count: times that it did.
        n: times that it could have.
    """

    count: int
    n: int

    def __post_init__(self) -> None:
        if not 0 <= self.count <= self.n:
            raise ValueError(f"{self.count} of {self.n} is no rate")

    @property
    def share(self) -> float | None:
        """Between 0 and 1; None of nothing."""
        return self.count / self.n if self.n else None

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % Wilson interval of the share; None of nothing."""
        if not self.n:
            return None
        low, high = proportion_confint(self.count, self.n, alpha=ALPHA, method="wilson")
        return float(low), float(high)

    def as_dict(self) -> dict[str, Any]:
        """The numbers as JSON takes them."""
        interval = self.interval
        return {
            "n": self.n,
            "count": self.count,
            "rate": self.share,
            "interval": None if interval is None else list(interval),
        }


def rate_of(outcomes: Iterable[bool]) -> Rate:
    """The rate of True."""
    found = list(outcomes)
    return Rate(count=sum(found), n=len(found))


def paired_p(lost: int, gained: int) -> float:
    """p of the exact McNemar test: how likely so uneven a split is when gains and losses are equally likely.

    Args:
        lost: pairs that went from success to failure.
        gained: pairs that went the other way.
    """
    if lost + gained == 0:
        return 1.0
    # Pairs that agree do not enter the exact test.
    return float(mcnemar([[0, lost], [gained, 0]], exact=True).pvalue)


_RESAMPLES = 10_000


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Median, quartiles, and 95 % bootstrap interval of the median (percentiles of resampled medians).

    The same values in whatever order have the same interval.
    """
    sample = np.sort(np.asarray(values, dtype=np.float64))
    picked = np.random.default_rng(0).integers(sample.size, size=(_RESAMPLES, sample.size))
    medians = np.median(sample[picked], axis=1)
    low, high = np.quantile(medians, [0.5 * ALPHA, 1.0 - 0.5 * ALPHA])
    quartiles = np.quantile(sample, [0.25, 0.75])
    return {
        "median": float(np.median(sample)),
        "quartiles": quartiles.tolist(),
        "interval": [float(low), float(high)],
    }


def recovered(row: Row) -> bool:
    """Whether the episode ended well."""
    return bool(row["outcome"] == "recovered")


def number(value: Any) -> float | None:
    """A number of a row; None where there is none."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    return float(value)


def key_of(value: Any) -> Hashable:
    """What rows are grouped by: floats that differ by rounding are the same, and NaN is None."""
    if isinstance(value, float):
        return None if math.isnan(value) else round(value, 9) + 0.0
    if isinstance(value, list):
        return tuple(value)
    key: Hashable = value
    return key


def grouped(rows: Iterable[Row], by: Sequence[str]) -> dict[tuple[Any, ...], list[Row]]:
    """Rows by the values of some columns, in order of those values; a column that is missing counts as None."""
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(key_of(row.get(name)) for name in by), []).append(row)
    return dict(sorted(groups.items(), key=lambda group: [_order(value) for value in group[0]]))


def _order(value: Any) -> tuple[int, float, str]:
    if value is None:
        return 0, 0.0, ""
    if isinstance(value, bool | int | float):
        return 1, float(value), ""
    if isinstance(value, tuple) and value and isinstance(value[0], int | float):
        return 2, float(value[0]), str(value)  # a range, by its lower end
    return 3, 0.0, str(value)
