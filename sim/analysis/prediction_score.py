"""Scores the prediction of the MOA sets: what was told by them of a push against what the body then did."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import norm
from statsmodels.discrete.discrete_model import Logit
from statsmodels.tools import add_constant
from statsmodels.tools.sm_exceptions import ConvergenceWarning

from sim.analysis.calibration import Calibration, Model, probabilities, senses, spoken_of
from sim.analysis.frame import crashed, groups, recovered
from sim.analysis.statistics import ALPHA, auc, brier, rate, rate_of

Moment = Literal["end", "decision"]
Rule = Literal["told", "law", "regulator", "tracking"]

MOMENTS: tuple[Moment, ...] = ("end", "decision")
"""At the end of the push, and when the controller decided."""
SETS: tuple[Rule, ...] = ("regulator", "tracking")
"""Sets that a controller may live by. The table holds null for a set that the controller has not."""
_RULES: dict[Moment, tuple[Rule, ...]] = {"end": ("told", "law", *SETS), "decision": ("law", *SETS)}
DENOMINATORS = {
    "false_safe": "predicted safe but not recovered, over predicted safe",
    "false_safe_of_lost": "predicted safe but not recovered, over not recovered",
    "false_alarm": "predicted unsafe but recovered, over predicted unsafe",
    "false_alarm_of_recovered": "predicted unsafe but recovered, over recovered",
}
"""What each rate is of."""

_BINS = 6  # at most, on either side of the boundary
_PER_BIN = 8  # episodes that make a bin worth an interval
_CENTIMETRES = 100.0
_EVEN = 0.5
_TENTHS = 10


def sector(direction_deg: Any) -> Any:
    """The middle of the sector of 45 deg of each direction [deg]; of one, or of an array of any shape."""
    return 45 * np.round(direction_deg / 45.0) % 360


def asked(frame: pd.DataFrame, rule: Rule = "told") -> pd.Series:
    """Whether the set, or with "told" or "law" any set, is one that the controller of each row has."""
    columns = [f"in_{name}_set_{moment}" for name in _sets(rule) for moment in MOMENTS]
    return frame[columns].notna().any(axis=1).groupby(frame["controller"]).transform("any")


def predicted_safe(frame: pd.DataFrame, moment: Moment = "end", rule: Rule = "told") -> pd.Series:
    """Whether each push was predicted safe; NA if no set was asked, or the episode crashed.

    By "law" it is if the state was in any of the controller's sets. "told" is the same but for pushes whose frame tells
    a `probability` of recovery, which is of the end of the push: they are if it is even or better.
    """
    inside = frame[[f"in_{name}_set_{moment}" for name in _sets(rule)]]
    nothing = inside.isna().all(axis=1) | crashed(frame)
    safe = inside.fillna(False).any(axis=1).astype("boolean").mask(nothing)
    if rule == "told" and moment == "end" and "probability" in frame:
        probability = frame["probability"]
        safe = safe.mask(probability.notna(), probability >= _EVEN)
    return safe


def signed_slack(frame: pd.DataFrame, moment: Moment = "end") -> pd.Series:
    """The largest slack of the controller's sets [m, of ZMP or DCM]; negative outside all of them, NaN without one."""
    slacks = [
        frame[f"{name}_slack_{moment}"].where(frame[f"in_{name}_set_{moment}"].notna() & ~crashed(frame))
        for name in SETS
    ]
    return pd.concat(slacks, axis=1).replace([np.inf, -np.inf], np.nan).max(axis=1)


def score(frame: pd.DataFrame, moment: Moment = "end", rule: Rule = "told") -> dict[str, Any]:
    """Confusion matrix and the rates that follow from it; see `DENOMINATORS`."""
    said, well = predicted_safe(frame, moment, rule), recovered(frame)
    known, safe = said.notna(), said.fillna(False).astype(bool)
    matrix = {
        "safe_recovered": int((known & safe & well).sum()),
        "safe_lost": int((known & safe & ~well).sum()),
        "unsafe_recovered": int((known & ~safe & well).sum()),
        "unsafe_lost": int((known & ~safe & ~well).sum()),
    }
    kept, false_safe, false_alarm, foreseen = matrix.values()
    return {
        "confusion": {**matrix, "not_predicted": int((~known).sum())},
        "false_safe": rate(false_safe, false_safe + kept),
        "false_alarm": rate(false_alarm, false_alarm + foreseen),
        "false_safe_of_lost": rate(false_safe, false_safe + foreseen),
        "false_alarm_of_recovered": rate(false_alarm, false_alarm + kept),
    }


def prediction_score(
    frame: pd.DataFrame, calibrations: Sequence[Calibration] = (), suite_hash: str | None = None
) -> dict[str, Any]:
    """The section `prediction_score` of a summary.

    `false_safe`, `false_alarm` and the like hold a rate for each world, of all episodes whose controller lives by
    sets, each judged by its probability of recovery, or by all sets of its controller at the end of the push where no
    calibration speaks of it; `scores` holds the same by moment, controller, rule and sector;
    `regions` the recovery by where the state was; `slack` the recovery by signed slack;
    `probability` how the probabilities came true, for each model of the calibrations and what was seen of its pushes.

    Args:
        frame: the pushes.
        calibrations: whose probabilities are scored.
        suite_hash: of the pushes' suite, to tell whether a calibration was fitted to them.
    """
    frame = frame.assign(probability=probabilities(frame, calibrations))
    known = frame[asked(frame)]
    worlds = {world: members for (world,), members in groups(known, ["world"])}
    scored = {world: score(members) for world, members in worlds.items()}
    parts = [
        ({"moment": moment, "world": world, "controller": controller}, members)
        for moment in MOMENTS
        for (world, controller), members in groups(known, ["world", "controller"])
    ]
    return {
        **{name: {w: found[name] for w, found in scored.items()} for name in ("confusion", *DENOMINATORS)},
        "denominators": dict(DENOMINATORS),
        "scores": [entry for what, members in parts for entry in _scores(what, members)],
        "regions": [entry for what, members in parts for entry in _regions(what, members)],
        "slack": {world: by_slack(members) for world, members in worlds.items()},
        "probability": list(_probabilities(frame, calibrations, suite_hash)),
    }


def _probabilities(
    frame: pd.DataFrame, calibrations: Sequence[Calibration], suite_hash: str | None
) -> Iterator[dict[str, Any]]:
    models = [(one, model) for one in calibrations for model in one.models]
    rows = spoken_of(frame, [model for _, model in models])
    for (one, model), own in zip(models, rows, strict=True):
        for (seen,), members in groups(frame[own].assign(senses=senses(frame[own])), ["senses"]):
            found = probability_score(members, model)
            if found is not None:
                yield {
                    "robot": model.robot,
                    "world": model.world,
                    "controller": model.controller,
                    "senses": seen,
                    "by": {
                        "suite": one.suite,
                        "seed": one.seed,
                        "commit": one.commit,
                        "anyway": one.anyway,
                        "senses": model.senses,
                        "episodes": model.episodes,
                        "ridge": model.ridge,
                        "same_suite": one.suite_hash == suite_hash and seen == model.senses,
                    },
                    **found,
                }


def probability_score(frame: pd.DataFrame, model: Model) -> dict[str, Any] | None:
    """How the probabilities of a model came true in rows that it speaks of; None if it gives no push one.

    `brier` is beside `brier_base`, that of who knows only how many were recovered here; `expected` are so many
    recoveries, with the interval that chance and the doubt in the coefficients leave; `bins` are tenths of the
    probability, each with its mean and what was recovered; `false_safe` and `false_alarm` are as of a set, with what
    has even odds or better being safe.
    """
    design, well = model.design(frame), recovered(frame).to_numpy(float)
    known = np.isfinite(design).all(axis=1)
    design, well = design[known], well[known]
    if not len(well):
        return None
    told, count = model.probability(design), int(well.sum())
    chance = told * (1.0 - told)
    tilt = chance @ design
    doubt = norm.ppf(1.0 - 0.5 * ALPHA) * np.sqrt(chance.sum() + tilt @ np.array(model.covariance) @ tilt)
    ends = np.clip([told.sum() - doubt, told.sum() + doubt], 0.0, len(well))
    safe = told >= _EVEN
    tenth = np.minimum((told * _TENTHS).astype(int), _TENTHS - 1)
    return {
        "n": len(well),
        "without": len(frame) - len(well),
        "recovered": rate(count, len(well)),
        "expected": {"count": float(told.sum()), "interval": ends.tolist()},
        "brier": brier(told, well),
        "brier_base": brier(np.full(len(well), count / len(well)), well),
        "auc": auc(told, well),
        "bins": [
            {
                "low": each / _TENTHS,
                "high": (each + 1) / _TENTHS,
                "told": float(told[tenth == each].mean()),
                "recovered": rate_of(well[tenth == each]),
            }
            for each in np.unique(tenth).tolist()
        ],
        "false_safe": rate_of(well[safe] < _EVEN),
        "false_alarm": rate_of(well[~safe] > _EVEN),
    }


def _sets(rule: Rule) -> tuple[Rule, ...]:
    return SETS if rule in ("told", "law") else (rule,)


def _scores(what: dict[str, Any], members: pd.DataFrame) -> Iterator[dict[str, Any]]:
    # A train that crashed has no direction.
    directed = members[members["direction_deg"].notna()]
    for rule in (rule for rule in _RULES[what["moment"]] if asked(members, rule).any()):
        if rule == "law" and what["moment"] == "end" and members["probability"].isna().all():
            continue  # they alone were told
        yield {**what, "set": rule, "direction_deg": None, **score(members, what["moment"], rule)}
        for middle, there in directed.groupby(sector(directed["direction_deg"])):
            yield {**what, "set": rule, "direction_deg": int(middle), **score(there, what["moment"], rule)}


def _regions(what: dict[str, Any], members: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Recovery of the states in the regulator's set, in a tracking set only, and in neither."""
    known = members[predicted_safe(members, what["moment"], "law").notna()]
    inside = [known[f"in_{name}_set_{what['moment']}"].fillna(False).to_numpy(bool) for name in SETS]
    where = np.select(inside, SETS, "outside")
    for region in (*SETS, "outside"):
        if (where == region).any():
            yield {**what, "region": region, "recovered": rate_of(recovered(known)[where == region])}


def by_slack(frame: pd.DataFrame, moment: Moment = "end") -> dict[str, Any]:
    """Recovery by signed slack: rates in bins that meet at zero, and a logistic fit.

    The fit is None where one outcome is missing; where some slack parts all recoveries from all losses there is
    no finite slope, and the fit only says between which slacks that happens.
    """
    pairs = pd.DataFrame({"slack": signed_slack(frame, moment), "well": recovered(frame)}).dropna()
    pairs = pairs.sort_values(["slack", "well"], kind="stable")
    outside = pairs["slack"] < 0.0
    return {
        "n": len(pairs),
        "bins": [*_bins(pairs[outside]), *_bins(pairs[~outside])],
        "logistic": _logistic(pairs),
    }


def _bins(pairs: pd.DataFrame) -> Iterator[dict[str, Any]]:
    count = min(_BINS, max(1, len(pairs) // _PER_BIN))
    for part in np.array_split(np.arange(len(pairs)), count):
        if part.size:
            slack = pairs["slack"].iloc[part]
            ends = {"low": float(slack.min()), "high": float(slack.max()), "middle": float(slack.median())}
            yield {**ends, "recovered": rate_of(pairs["well"].iloc[part])}


def _logistic(pairs: pd.DataFrame) -> dict[str, Any] | None:
    good, bad = pairs.loc[pairs["well"], "slack"], pairs.loc[~pairs["well"], "slack"]
    if good.empty or bad.empty:
        return None
    if bad.max() < good.min():
        return {"separated": True, "worst_lost": float(bad.max()), "least_recovered": float(good.min())}
    slacks = pairs["slack"].to_numpy() * _CENTIMETRES
    if np.ptp(slacks) == 0.0 or bad.min() > good.max():
        return None
    with np.errstate(over="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # it is asked below
        fit = Logit(pairs["well"].to_numpy(float), add_constant(slacks)).fit(disp=False, maxiter=100)
    if not fit.mle_retvals["converged"]:
        return None
    level, slope = (float(value) for value in fit.params)
    low, high = (float(value) for value in fit.conf_int()[1])
    return {
        "separated": False,
        "intercept": level,
        "slope_per_cm": slope,
        "slope_interval": [low, high],
        "p": float(fit.pvalues[1]),
        "even_slack": -level / slope / _CENTIMETRES if slope > 0.0 else None,
    }
