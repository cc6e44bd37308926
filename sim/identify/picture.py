"""Gain and lag of the ZMP over frequency, by the scenario's senses and by the exact state."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

COLOURS = {"as given": "#1f5fd6", "exact": "#d1602f"}
RESPONSES = {
    "body": ("ZMP against its command", "--", "s"),
    "loop": ("ZMP against the law at the true state", "-", "o"),
}
_FAINT = "#b9bec6"


def draw(report: Mapping[str, Any]) -> bytes:
    """A PNG of what `sim.identify.identify.identify` returns: gain above, lag below, a column for each axis."""
    figure = Figure(figsize=(11.0, 7.0), dpi=100, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    names = {"as given": report["sensing"], "exact": "true state"}
    for column, axis in enumerate("xy"):
        for case, measured in report["standing"].items():
            for response, (words, style, marker) in RESPONSES.items():
                rows = measured["axes"][axis][response]
                # Beside each other, so that intervals can be told apart.
                shift = (0.985 if case == "exact" else 1.0) * (1.0 if response == "loop" else 1.03)
                at = [shift * row["frequency"] for row in rows]
                look = {"color": COLOURS[case], "linestyle": style, "marker": marker, "markersize": 4, "capsize": 2}
                for panel, what, scale in ((panels[0, column], "gain", 1.0), (panels[1, column], "lag", 1e3)):
                    middle = [scale * row[what]["mean"] for row in rows]
                    half = [scale * (row[what]["interval"][1] - row[what]["mean"]) for row in rows]
                    panel.errorbar(at, middle, yerr=half, linewidth=1.3, label=f"{words}, {names[case]}", **look)
        panels[0, column].set_title(f"along {axis}: k {_k(report, axis)}, designed {report['gain']['designed']:.3g}")
        panels[0, column].axhline(1.0, color=_FAINT, linewidth=0.8, zorder=0)
        panels[1, column].axhline(0.0, color=_FAINT, linewidth=0.8, zorder=0)
        panels[1, column].set_xscale("log")
        panels[1, column].set_xticks(report["frequencies"], [f"{one:g}" for one in report["frequencies"]])
        panels[1, column].minorticks_off()
        panels[1, column].set_xlabel("frequency [Hz]")
    panels[0, 0].set_ylabel("gain")
    panels[1, 0].set_ylabel("lag [ms], below 0 a lead")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    where = report["layer"] or "pendulum"
    seeds = len(report["seeds"])
    figure.suptitle(f"{report['robot']['name']}, {where}: how the ZMP follows, with 95 % intervals over {seeds} seeds")
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()


def _k(report: Mapping[str, Any], axis: str) -> str:
    return f"{report['standing']['as given']['axes'][axis]['gain']['realised']['mean']:.3g}"
