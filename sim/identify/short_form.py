"""The measured figures as a small TOML file: what the sets should use, and what it follows from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

AXES = ("x", "y")


def short_form(report: Mapping[str, Any]) -> str:
    """What `sim.identify.identify.identify` returns, as TOML: lengths in m, times in s."""
    return "\n".join(_lines(report)) + "\n"


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    yield f"# {report['robot']['name']}, {report['layer'] or 'pendulum'}, {report['sensing']}; seeds {report['seeds']}"
    yield "[stepping]"
    yield f"zmp_error = {report['zmp_error']!r}"
    yield ""
    yield "[identified]"
    yield f"scenario = {json.dumps(report['scenario'], ensure_ascii=False)}"
    yield f"gain_designed = {report['gain']['designed']:.6g}"
    yield f"gain_identified = {report['gain']['identified']:.6g}"
    if report["zmp_error_stepping"] is not None:
        yield f"zmp_error_stepping = {report['zmp_error_stepping']!r}"
    yield f"frequencies = {report['frequencies']}"
    for axis in AXES:
        measured = report["standing"]["as given"]["axes"][axis]
        for response in ("body", "loop"):
            for what in ("gain", "lag"):
                values = ", ".join(f"{one[what]['mean']:.4g}" for one in measured[response])
                yield f"{response}_{what}_{axis} = [{values}]"
