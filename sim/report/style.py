"""How the pictures of a report look: the width of a phone, as SVG that the page holds itself."""

from __future__ import annotations

import base64
import io
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from sim.record.palette import PAPER, REGULATOR, STATUE, TRACKER

INK, FAINT, SOFT = "#22262b", "#8a9099", "#5b626b"
COLOURS = {"supervisor": TRACKER, "paper": PAPER, "regulator": REGULATOR, "statue": STATUE}
MARKERS = {"supervisor": "o", "paper": "D", "regulator": "s", "statue": "^"}
WIDTH = 4.1
"""Of a picture [in]; 394 px, so that letters keep their size on a phone."""
NARROW = 3.3
"""Of a picture of which three stand side by side on a screen [in]."""

_STYLE: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 8.5,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.7,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "grid.color": "#e2e5e9",
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "svg.fonttype": "none",
    # Names within a picture are random otherwise.
    "svg.hashsalt": "okiagari",
}


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture with what it shows in words."""

    uri: str
    alt: str


def style() -> AbstractContextManager[None]:
    """Draw within it."""
    return mpl.rc_context(_STYLE)


def picture(figure: Figure, alt: str) -> Picture:
    """A finished figure for the page; the same figure makes the same bytes."""
    FigureCanvasSVG(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return Picture(uri="data:image/svg+xml;base64," + base64.b64encode(stream.getvalue()).decode(), alt=alt)
