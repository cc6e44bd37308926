"""Rates with their intervals, and whether two runs differ beyond chance; the formulas are statsmodels'."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, linprog
from scipy.stats import norm, rankdata
from statsmodels.discrete.discrete_model import Logit
from statsmodels.stats.contingency_tables import mcnemar
from statsmodels.stats.proportion import proportion_confint

from models.errors import InputError

Array = NDArray[np.float64]

ALPHA = 0.05
"""Chance of being wrong that every interval and test accepts."""
_RESAMPLES = 10_000
_ITERATIONS = 200
_ROUNDING = 1e-9


def rate(count: int, n: int) -> dict[str, Any]:
    """How often something happened, as a summary has it.

    Args:
        count: times that it did.
        n: times that it could have.

    Returns:
        `n`, `count`, their `rate` between 0 and 1, and its 95 % Wilson `interval`; the last two None of nothing.
    """
    if not 0 <= count <= n:
        raise ValueError(f"{count} of {n} is no rate")
    interval = proportion_confint(count, n, alpha=ALPHA, method="wilson") if n else None
    return {
        "n": n,
        "count": count,
        "rate": count / n if n else None,
        "interval": None if interval is None else [float(end) for end in interval],
    }


def rate_of(outcomes: Any) -> dict[str, Any]:
    """The rate of True in a series (n,)."""
    return rate(int(np.count_nonzero(outcomes)), len(outcomes))


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


def brier(probabilities: Array, well: Array) -> float:
    """Mean square of what probabilities (n,) are off outcomes (n,) of 1 or 0: 0 is perfect, 0.25 that of a coin."""
    return float(np.mean((probabilities - well) ** 2))


def auc(scores: Array, well: Array) -> dict[str, Any] | None:
    """How often a success has a higher score than a failure; ties count half.

    Args:
        scores: (n,).
        well: (n,), 1 or 0.

    Returns:
        `value` between 0 and 1 and its 95 % `interval`, that of R. G. Newcombe, "Confidence intervals for an effect
        size measure based on the Mann-Whitney statistic. Part 2", Statistics in Medicine 25 (2006), method 5, which has
        a width even where the value is 0 or 1; None where one outcome is missing.
    """
    good = int(np.count_nonzero(well))
    bad = len(well) - good
    if not good or not bad:
        return None
    value = float((rankdata(scores)[well > 0.5].sum() - 0.5 * good * (good + 1)) / (good * bad))
    z, more = float(norm.ppf(1.0 - 0.5 * ALPHA)), 0.5 * (good + bad) - 1.0

    def excess(true: float) -> float:
        spoken = 1.0 + more * ((1.0 - true) / (2.0 - true) + true / (1.0 + true))
        return (value - true) ** 2 - z * z * true * (1.0 - true) * spoken / (good * bad)

    # At either end nothing varies, and the excess is not negative; at the value it is not positive.
    low = 0.0 if value == 0.0 else brentq(excess, 0.0, value) if value < 1.0 else brentq(excess, 0.0, 1.0 - 1e-9)
    high = 1.0 if value == 1.0 else brentq(excess, value, 1.0) if value > 0.0 else brentq(excess, 1e-9, 1.0)
    return {"value": value, "interval": [float(low), float(high)]}


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Median, quartiles, and 95 % bootstrap interval of the median (percentiles of resampled medians).

    The same values in whatever order have the same interval.
    """
    sample = np.sort(np.asarray(values, dtype=np.float64))
    # scipy.stats.bootstrap draws other samples from a seed, and so would move intervals that have been published.
    picked = np.random.default_rng(0).integers(sample.size, size=(_RESAMPLES, sample.size))
    medians = np.median(sample[picked], axis=1)
    return {
        "median": float(np.median(sample)),
        "quartiles": np.quantile(sample, [0.25, 0.75]).tolist(),
        "interval": np.quantile(medians, [0.5 * ALPHA, 1.0 - 0.5 * ALPHA]).tolist(),
    }


def is_parted(design: Array, well: Array) -> bool:
    """Whether some plane parts the outcomes, touching ones allowed: then the likelihood has no maximum.

    Args:
        design: (n, k), with a column of ones.
        well: (n,), 1 or 0.
    """
    signed = np.where(well[:, None] > 0.5, 1.0, -1.0) * design
    best = linprog(-signed.sum(axis=0), A_ub=-signed, b_ub=np.zeros(len(signed)), bounds=(-1.0, 1.0))
    return bool(-best.fun > _ROUNDING * len(signed))


def fit_logistic(design: Array, well: Array, ridge: float) -> tuple[Array, Array]:
    """Coefficients (k,) and their covariance (k, k), with the largest likelihood less half the ridge's penalty.

    Args:
        design: (n, k), with a column of ones first, which is not penalised.
        well: (n,), 1 or 0, both present; parted by no plane if there is no ridge.
        ridge: weight of the squared slopes.

    Raises:
        InputError: if it does not converge.
    """
    model, size = Logit(well, design), design.shape[1]
    penalty = ridge * np.diag([0.0] + [1.0] * (size - 1))
    at = np.zeros(size)

    def worth(there: Array) -> float:
        return float(model.loglike(there) - 0.5 * there @ penalty @ there)

    for _ in range(_ITERATIONS):
        slope, bend = model.score(at) - penalty @ at, penalty - model.hessian(at)
        step, share = np.linalg.solve(bend, slope), 1.0
        while worth(at + share * step) < worth(at) and share > _ROUNDING:
            share *= 0.5
        at = at + share * step
        if np.abs(share * step).max() < _ROUNDING:
            return at, np.linalg.inv(penalty - model.hessian(at))
    raise InputError("the fit of recovery by slack does not converge")
