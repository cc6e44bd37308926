"""What a page begins with: the figures that matter most, and what was run."""

from __future__ import annotations

from collections.abc import Iterator

from sim.presenter.formatting import case_words, condensed, degrees, fraction, median_words, percent
from sim.presenter.who import Summary, label, main_controller

_STILL = "at the end the COG is at rest with no step under way"
_UPRIGHT = "at the end it is upright, marching or not, and its COG moved by less than 0.1 m in the last second"
_RECOVERED = (
    "; never did the trunk tilt by more than 75°, the COG sink "
    "below half its height, or anything but a sole touch the floor"
)
_SIZE = (
    "Δv, its impulse over the mass of the robot; ωd is the Δv that a pendulum on these feet can just stop without a "
    "step, d being the distance from the middle of the feet to their edge in that direction"
)


def cards(summary: Summary) -> list[tuple[str, str]]:
    """Figures, and what they are of, of the first controller that is shown; of each robot if there are several."""
    outcomes = (f"{n} {name.replace('_', ' ')}" for name, n in summary["outcomes"].items())
    found = [
        (value, f"{robot}: {words}" if robot else words)
        for robot, part in (summary["by_robot"] or {"": summary}).items()
        for value, words in _cards(part)
    ]
    return [*found, (str(summary["episodes"]), f"episodes: {', '.join(outcomes)}")]


def _cards(summary: Summary) -> Iterator[tuple[str, str]]:
    name = main_controller(summary)
    who, first = label(summary, name), (summary["ablation"] or {}).get("reference")
    own = [
        one
        for one in summary["robust"]
        if one["controller"] == name and one.get("case", {}).get("variant", first) == first
    ]
    if name in summary["robust_mean_over_omega_d"]:
        mean, worst = condensed(own, "over_omega_d")
        froude, least = condensed(own, "over_sqrt_gh", 3)
        yield mean, f"robust Δv/(ωd) of the {who}, mean over directions; 1 is the limit without a step"
        yield worst, f"the same in its worst direction, {degrees(summary['robust_worst_direction'][name])}"
        yield froude, f"robust Δv/√(gh) of the {who}, mean over directions; in its worst {least}"
        holes = f"holes of the {who}: pushes below 75 % of their direction's threshold that were lost"
        yield str(summary["hole_counts"][name]), holes
    for entry in summary["endurance"]:
        if entry["controller"] == name:
            of = ", ".join(filter(None, (who, case_words(entry.get("case")))))
            yield median_words(entry["pushes_survived"]), f"pushes survived by the {of}, median and its 95 % interval"
    score = summary["prediction_score"]
    for entry in score["probability"]:
        whose = f"{label(summary, entry['controller'])}, {entry['world']}, senses: {entry['senses']}"
        better = f"who knows only the share recovered has {entry['brier_base']:.3f}, a perfect prophet 0"
        yield f"{entry['brier']:.3f}", f"Brier score of the probability of recovery, {whose}: {better}"
    for world, safe in score["false_safe"].items():
        alarm = score["false_alarm"][world]
        lost = f"{fraction(safe)} that were called safe were lost"
        well = f"{fraction(alarm)} that were not called safe were recovered"
        yield percent(safe), f"false safe, {world}: {lost if safe['n'] else 'none was called safe'}"
        yield percent(alarm), f"false alarm, {world}: {well if alarm['n'] else 'all were called safe'}"


def facts(summary: Summary) -> dict[str, str]:
    """What was run: term -> what it means here."""
    shown = summary["controllers_shown"]
    called = (look["label"] + (f" (file {look['source'][:12]})" if look["source"] else "") for look in shown.values())
    found = {
        "robot": ", ".join(summary["robots"]),
        "world": ", ".join(summary["worlds"]),
        "controllers": ", ".join(called),
        "recovered": (_UPRIGHT if summary.get("rest") == "upright" else _STILL) + _RECOVERED,
        "size of a push": _SIZE,
    }
    if train := summary["train"]:
        found["pushes"] = (
            f"a train: up to {train['count']} pushes, one every {train['interval']:g} s, the first of "
            f"{train['first']:g} ωd of its own direction, each larger than the one before by {train['growth']:g}; "
            "directions drawn for each replica, the same for all controllers. A push is survived if the robot stood "
            "from there until the next"
        )
    return found
