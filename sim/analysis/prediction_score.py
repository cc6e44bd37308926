"""Scores the prediction of the MOA sets: what they said of a push against what the body then did."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
from statsmodels.discrete.discrete_model import Logit
from statsmodels.tools import add_constant
from statsmodels.tools.sm_exceptions import ConvergenceWarning

from sim.analysis.statistics import Rate, Row, grouped, number, rate_of, recovered

Moment = Literal["end", "decision"]
Rule = Literal["law", "regulator", "tracking"]

MOMENTS: tuple[Moment, ...] = ("end", "decision")
"""At the end of the push, and when the supervisor decided."""
SECTORS = tuple(range(0, 360, 45))
"""Middles of the eight sectors that directions are sorted into [deg]."""
DENOMINATORS = {
    "false_safe": "predicted safe but not recovered, over predicted safe",
    "false_safe_of_lost": "predicted safe but not recovered, over not recovered",
    "false_alarm": "predicted unsafe but recovered, over predicted unsafe",
    "false_alarm_of_recovered": "predicted unsafe but recovered, over recovered",
}
"""What each rate is of."""

# Sets by which each controller lives: the regulator never steps, and the statue obeys no set.
_LAWS: dict[str, tuple[str, ...]] = {
    "supervisor": ("regulator", "tracking"),
    "paper": ("regulator", "tracking"),
    "regulator": ("regulator",),
}
_BINS = 6  # at most, on either side of the boundary
_PER_BIN = 8  # episodes that make a bin worth an interval
_CENTIMETRES = 100.0


def sector(direction_deg: float) -> int:
    """The middle of the sector of a direction [deg]."""
    return int(45 * round(direction_deg / 45.0)) % 360


def sets_asked(row: Row, rule: Rule = "law") -> tuple[str, ...]:
    """The sets whose word counts: those of the controller's law, or of these the one named."""
    law = _LAWS.get(row["controller"], ())
    return law if rule == "law" else tuple(name for name in law if name == rule)


def predicted_safe(row: Row, moment: Moment = "end", rule: Rule = "law") -> bool | None:
    """Whether the state was in one of the sets that count; None if none of them was asked."""
    words = [row.get(f"in_{name}_set_{moment}") for name in sets_asked(row, rule)]
    known = [bool(word) for word in words if word is not None]
    return any(known) if known else None


def signed_slack(row: Row, moment: Moment = "end") -> float | None:
    """The largest slack of the sets that count [m, of ZMP or DCM]; negative outside all of them."""
    slacks = [number(row.get(f"{name}_slack_{moment}")) for name in sets_asked(row)]
    finite = [slack for slack in slacks if slack is not None and math.isfinite(slack)]
    return max(finite) if finite else None


def score(rows: Sequence[Row], moment: Moment = "end", rule: Rule = "law") -> dict[str, Any]:
    """Confusion matrix and the rates that follow from it; see `DENOMINATORS`."""
    pairs = [(predicted_safe(row, moment, rule), recovered(row)) for row in rows]
    safe = rate_of(not well for said, well in pairs if said is True)
    unsafe = rate_of(well for said, well in pairs if said is False)
    return {
        "confusion": {
            "safe_recovered": safe.n - safe.count,
            "safe_lost": safe.count,
            "unsafe_recovered": unsafe.count,
            "unsafe_lost": unsafe.n - unsafe.count,
            "not_predicted": sum(said is None for said, _ in pairs),
        },
        "false_safe": safe.as_dict(),
        "false_alarm": unsafe.as_dict(),
        "false_safe_of_lost": Rate(count=safe.count, n=safe.count + unsafe.n - unsafe.count).as_dict(),
        "false_alarm_of_recovered": Rate(count=unsafe.count, n=unsafe.count + safe.n - safe.count).as_dict(),
    }


def truth(rows: Sequence[Row]) -> dict[str, Any]:
    """The section `truth` of a summary.

    `false_safe`, `false_alarm` and the like hold a rate for each world, of all episodes whose controller lives by
    sets, each judged by the sets of its own law at the end of the push; `scores` holds the same by moment,
    controller, set and sector; `regions` the recovery by where the state was; `slack` the recovery by signed slack.
    """
    asked = [row for row in rows if sets_asked(row)]
    worlds = {world: score(members) for (world,), members in grouped(asked, ["world"]).items()}
    names = ("confusion", *DENOMINATORS)
    return {
        **{name: {world: result[name] for world, result in worlds.items()} for name in names},
        "denominators": dict(DENOMINATORS),
        "scores": list(_scores(asked)),
        "regions": list(_regions(asked)),
        "slack": {world: by_slack(members) for (world,), members in grouped(asked, ["world"]).items()},
    }


def _scores(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    for moment in MOMENTS:
        for (world, controller), members in grouped(rows, ["world", "controller"]).items():
            rules: tuple[Rule, ...] = ("law", "regulator", "tracking")
            for rule in rules:
                if not sets_asked(members[0], rule):
                    continue
                what = {"moment": moment, "world": world, "controller": controller, "set": rule}
                yield {**what, "direction_deg": None, **score(members, moment, rule)}
                for middle in SECTORS:
                    # A train that crashed has no direction.
                    known = [row for row in members if row["direction_deg"] is not None]
                    there = [row for row in known if sector(row["direction_deg"]) == middle]
                    if there:
                        yield {**what, "direction_deg": middle, **score(there, moment, rule)}


def _regions(rows: Sequence[Row]) -> Iterator[dict[str, Any]]:
    """Recovery of the states in the regulator's set, in a tracking set only, and in neither."""
    for moment in MOMENTS:
        for (world, controller), members in grouped(rows, ["world", "controller"]).items():
            found: dict[str, list[bool]] = {}
            for row in members:
                if predicted_safe(row, moment) is None:
                    continue
                inside = [name for name in sets_asked(row) if row.get(f"in_{name}_set_{moment}")]
                found.setdefault(inside[0] if inside else "outside", []).append(recovered(row))
            for region in ("regulator", "tracking", "outside"):
                if region in found:
                    what = {"moment": moment, "world": world, "controller": controller, "region": region}
                    yield {**what, "recovered": rate_of(found[region]).as_dict()}


def by_slack(rows: Sequence[Row], moment: Moment = "end") -> dict[str, Any]:
    """Recovery by signed slack: rates in bins that meet at zero, and a logistic fit.

    The fit is None where one outcome is missing; where some slack parts all recoveries from all losses there is
    no finite slope, and the fit only says between which slacks that happens.
    """
    pairs = [(slack, recovered(row)) for row in rows if (slack := signed_slack(row, moment)) is not None]
    pairs.sort()
    outside, inside = [pair for pair in pairs if pair[0] < 0.0], [pair for pair in pairs if pair[0] >= 0.0]
    return {"n": len(pairs), "bins": [*_bins(outside), *_bins(inside)], "logistic": _logistic(pairs)}


def _bins(pairs: list[tuple[float, bool]]) -> Iterator[dict[str, Any]]:
    count = min(_BINS, max(1, len(pairs) // _PER_BIN))
    for part in np.array_split(np.arange(len(pairs)), count):
        if part.size:
            slacks = [pairs[i][0] for i in part]
            recovery = rate_of(pairs[i][1] for i in part)
            middle = float(np.median(slacks))
            yield {"low": slacks[0], "high": slacks[-1], "middle": middle, "recovered": recovery.as_dict()}


def _logistic(pairs: list[tuple[float, bool]]) -> dict[str, Any] | None:
    good = [slack for slack, well in pairs if well]
    bad = [slack for slack, well in pairs if not well]
    if not good or not bad:
        return None
    if max(bad) < min(good):
        return {"separated": True, "worst_lost": max(bad), "least_recovered": min(good)}
    slacks = np.array([slack for slack, _ in pairs]) * _CENTIMETRES
    if np.ptp(slacks) == 0.0 or min(bad) > max(good):
        return None
    with np.errstate(over="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # it is asked below
        fit = Logit(np.array([float(well) for _, well in pairs]), add_constant(slacks)).fit(disp=False, maxiter=100)
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
