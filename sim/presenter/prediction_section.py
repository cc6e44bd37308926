"""Words the score of the prediction."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from sim.presenter.formatting import degrees, fraction, percent
from sim.presenter.tables import Section, Table
from sim.presenter.who import Entry, Summary, label

if TYPE_CHECKING:
    from sim.analysis.calibration import Model

_RATES = {
    "false_safe": "false safe, of predicted safe",
    "false_safe_of_lost": "false safe, of lost",
    "false_alarm": "false alarm, of predicted unsafe",
    "false_alarm_of_recovered": "false alarm, of recovered",
}
_MOMENTS = {"end": "end of the push", "decision": "decision"}
_SETS = {"told": "what was told", "law": "all its sets", "regulator": "regulator's set", "tracking": "tracking sets"}
_REGIONS = {"regulator": "the regulator's set", "tracking": "a tracking set only", "outside": "none of its sets"}
_BY_PROBABILITY = (
    "A push is predicted safe if recovery is told to be as likely as not, or likelier. The probability goes by the "
    "slacks at the end of the push; its law was fitted to other pushes unless it is said below. A push of which no law "
    "speaks is "
)
_BY_SETS = (
    "predicted safe if at its end the state lies in a maximal output admissible set of its controller: in the "
    "regulator's set, or in a tracking set if it steps. A humanoid's tracking sets are those of slower feet; the "
    "pendulum's are the controller's own. Then the body does what it does."
)

_SEEN = "Where the true state was not seen, the sets were asked of the state that was seen; what came of it is true."

_MOST = 20.0
"""Logarithm of odds up to which they are told."""


def prediction_section(summary: Summary) -> Section | None:
    """Whether what was predicted of a push came true; None if no set was asked."""
    found = summary["prediction_score"]
    if not found["confusion"]:
        return None
    rates = (
        {"world": world, "rate": words, "[95 %]": percent(found[name][world]), "counted": fraction(found[name][world])}
        for world in found["confusion"]
        for name, words in _RATES.items()
    )
    regions = (
        {**_what(summary, one), "state in": _REGIONS[one["region"]], **_rate("", one["recovered"])}
        for one in found["regions"]
    )
    # By direction only what was told.
    scores = (
        {
            **_what(summary, one),
            "by": _SETS[one["set"]] if one["direction_deg"] is None else degrees(one["direction_deg"]),
            **_rate("false safe", one["false_safe"]),
            **_rate("false alarm", one["false_alarm"]),
        }
        for one in found["scores"]
        if one["direction_deg"] is None or one["set"] == "told"
    )
    return Section(
        key="prediction",
        heading="Prediction score: was the outcome what was predicted?",
        text=(_BY_PROBABILITY if found["probability"] else "A push is ") + _BY_SETS,
        tables=(
            *_probability_table(summary, found["probability"]),
            Table(title="Prediction at the end of the push, and what came of it", rows=tuple(_confusion(found))),
            Table(title="Rates of the prediction, with 95 % intervals", rows=tuple(rates)),
            Table(title="Recovery by where the state was", rows=tuple(regions), shown="page"),
            Table(title="Prediction by set and direction", rows=tuple(scores), shown="page"),
        ),
        notes=(
            *([_SEEN] if summary["sight"] else []),
            *(_slack_words(world, one["logistic"]) for world, one in found["slack"].items() if one["logistic"]),
        ),
    )


def model_words(model: Model) -> str:
    """What a model was fitted to, and came to, in a line."""
    parts = zip(model.terms, model.coefficients[1:], model.covariance[1:], range(1, 3), strict=False)
    slopes = (f"{value:+.3f} ± {math.sqrt(row[at]):.3f} per cm of slack of {term}" for term, value, row, at in parts)
    ridge = f"; a ridge of {model.ridge:g} holds what the slacks part" if model.ridge else ""
    level = f"log odds {model.coefficients[0]:+.2f} ± {math.sqrt(model.covariance[0][0]):.2f}"
    return (
        f"{model.controller} on {model.robot}, {model.world}, {model.senses}: {model.recovered} of {model.episodes} "
        f"recovered; {level}, {', '.join(slopes)}{ridge}"
    )


def _probability_table(summary: Summary, found: list[Entry]) -> list[Table]:
    if not found:
        return []
    title = "Probability of recovery from the slacks, and what came of it"
    notes = tuple(dict.fromkeys(_provenance(one) for one in found))
    return [Table(title=title, rows=tuple(_probabilities(summary, found)), notes=notes)]


def _probabilities(summary: Summary, found: list[Entry]) -> Iterator[dict[Any, str]]:
    for one in found:
        low, high = one["expected"]["interval"]
        area = one["auc"]
        yield {
            "controller": label(summary, one["controller"]),
            "world": one["world"],
            "senses": one["senses"],
            "pushes": str(one["n"]),
            ("recovered", "expected [95 %]"): f"{one['expected']['count']:.0f} [{low:.0f}, {high:.0f}]",
            ("recovered", "observed"): str(one["recovered"]["count"]),
            ("Brier score", "told"): f"{one['brier']:.3f}",
            ("Brier score", "base rate"): f"{one['brier_base']:.3f}",
            "AUC [95 %]": "–"
            if area is None
            else f"{area['value']:.2f} [{', '.join(f'{x:.2f}' for x in area['interval'])}]",
            ("p = 0.5", "false safe"): fraction(one["false_safe"]),
            ("p = 0.5", "false alarm"): fraction(one["false_alarm"]),
        }


def _provenance(one: Entry) -> str:
    """What the probabilities were fitted to."""
    by = one["by"]
    words = (
        f"Fitted to {by['episodes']} pushes of the suite {by['suite']}, seed {by['seed']}, commit {by['commit'][:12]}, "
        f"senses: {by['senses']}"
    )
    words += f", for want of a law of {one['senses']}" if one["senses"] != by["senses"] else ""
    words += f", with a ridge of {by['ridge']:g} since the slacks part some of them" if by["ridge"] else ""
    words += "; not a suite for tuning" if by["anyway"] else ""
    words += "; these very pushes, so that the score flatters" if by["same_suite"] else ""
    words += f". Without a slack to go by: {one['without']}" if one["without"] else ""
    low, high = one["expected"]["interval"]
    if not low <= one["recovered"]["count"] <= high:
        words += (
            f". {one['controller']}, {one['world']}: what was recovered is not what was expected; do not trust it here"
        )
    return f"{words}."


def _confusion(found: Entry) -> list[dict[str | tuple[str, str], str]]:
    return [
        {
            "world": world,
            ("predicted safe", "recovered"): str(matrix["safe_recovered"]),
            ("predicted safe", "lost"): str(matrix["safe_lost"]),
            ("predicted unsafe", "recovered"): str(matrix["unsafe_recovered"]),
            ("predicted unsafe", "lost"): str(matrix["unsafe_lost"]),
            "not predicted": str(matrix["not_predicted"]),
        }
        for world, matrix in found["confusion"].items()
    ]


def _what(summary: Summary, one: Entry) -> dict[str, str]:
    return {"controller": label(summary, one["controller"]), "world": one["world"], "at": _MOMENTS[one["moment"]]}


def _rate(name: str, rate: Entry) -> dict[tuple[str, str], str]:
    return {(name, "[95 %]"): percent(rate), (name, "counted"): fraction(rate)}


def _slack_words(world: str, fit: Entry) -> str:
    """What more slack was worth in a world."""
    if fit["separated"]:
        least, worst = (f"{1000 * fit[name]:.1f} mm" for name in ("least_recovered", "worst_lost"))
        return f"Slack, {world}: what had at least {least} was recovered, what had {worst} or less was lost."
    odds, low, high = (_odds(value) for value in (fit["slope_per_cm"], *fit["slope_interval"]))
    even = "" if fit["even_slack"] is None else f"; even odds at {1000 * fit['even_slack']:+.1f} mm"
    return (
        f"Slack, {world}: a centimetre more multiplies the odds of recovery by {odds} (95 % interval {low} to "
        f"{high}){even}."
    )


def _odds(logarithm: float) -> str:
    """Odds in words, from their natural logarithm; few episodes leave intervals that no number holds."""
    if abs(logarithm) > _MOST:
        return f"{'more' if logarithm > 0.0 else 'less'} than {math.exp(math.copysign(_MOST, logarithm)):.0e}"
    return f"{math.exp(logarithm):.2g}"
