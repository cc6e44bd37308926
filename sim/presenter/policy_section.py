"""The report on a policy's adapter as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sim.presenter.formatting import MISSING
from sim.presenter.tables import Section, Table

_NAMED = 4
"""So many components are named; of more, their number is told."""


def policy_section(report: Mapping[str, Any]) -> Section:
    """What `sim.policy_check.policy_report.policy_report` returns, in words."""
    tables = []
    if report["terms"] is not None:
        tables = [_terms(report), _action(report)]
    return Section(
        key="policy",
        heading="The policy",
        tables=tuple(tables),
        notes=() if report["not_shown"] is None else (report["not_shown"],),
    )


def verdict(report: Mapping[str, Any]) -> str:
    """Whether it stood, for how long, and how its motors and feet fared, in two lines."""
    drift, torque = report["cog_drift"], report["torque"]
    stood = f"{report['controller']} stands to the end, {report['stood_for']:.2f} s"
    if not report["stands"]:
        stood = f"{report['controller']} fell after {report['stood_for']:.2f} s: {report['fall']}"
    motors = f"torque at its limit in {100 * torque['saturated_share']:.2g} % of the ticks"
    if torque["saturated_joint"] is not None:
        motors += f", most often {torque['saturated_joint']}"
    steps = f"{report['steps']} steps, {report['steps_per_second']:.2f} a second"
    return (
        f"{stood}; {steps}; COG {drift['end']:.3f} m from where it began, at most {drift['greatest']:.3f} m\n{motors}"
    )


def _terms(report: Mapping[str, Any]) -> Table:
    rows = tuple(
        {
            "term": term["name"],
            "size": str(term["size"]),
            **{key: f"{term[key]:.4g}" for key in ("min", "mean", "max")},
            "constant": _list(term["constant"], term["size"]),
            "at its clip": MISSING if term["clip"] is None else _shares(term["at_clip"]),
        }
        for term in report["terms"]
    )
    size = sum(term["size"] for term in report["terms"])
    return Table(
        title=f"What {report['controller']} is given: {size} numbers, {report['questions']} questions, one in "
        f"{report['period']:g} s",
        rows=rows,
    )


def _action(report: Mapping[str, Any]) -> Table:
    action = report["action"]
    row = {
        "size": str(action["size"]),
        "rms": f"{action['rms']:.4g}",
        "greatest": f"{action['max']:.4g}",
        ("from question to question", "rms"): f"{action['change_rms']:.4g}",
        ("from question to question", "greatest"): f"{action['change_max']:.4g}",
    }
    return Table(title="What it answers, before its scale", rows=(row,))


def _list(names: Sequence[str], size: int) -> str:
    if not names:
        return "none"
    if len(names) == size:
        return "all"
    return ", ".join(names) if len(names) <= _NAMED else f"{len(names)} of {size}"


def _shares(shares: Mapping[str, float]) -> str:
    if not shares:
        return "never"
    worst = sorted(shares, key=lambda name: -shares[name])
    words = ", ".join(f"{name} {100 * shares[name]:.2g} %" for name in worst[:_NAMED])
    return words if len(worst) <= _NAMED else f"{words}, and {len(worst) - _NAMED} more"
