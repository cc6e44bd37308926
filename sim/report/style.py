"""How the pictures of a report look: the width of a phone, as SVG that the page holds itself, or in files."""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.errors import InputError
from sim.presenter.tables import Picture
from sim.results.out_file import check_file, write_file
from sim.viz.glyphs import make_drawable

INK, FAINT, SOFT = "#22262b", "#8a9099", "#5b626b"
WIDTH = 4.1
"""Of a picture [in]; 394 px, so that letters keep their size on a phone."""
NARROW = 3.3
"""Of a picture of which three stand side by side on a screen [in]."""
Shown = dict[str, dict[str, Any]]
"""Label, colour and marker of each controller, in order: `controllers_shown` of a summary."""

_KINDS = (".png", ".svg")
_DPI = 200
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
    # A $ of a controller's or a variant's name begins no formula.
    "text.parse_math": False,
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


def picture(
    draw: Callable[[], Figure], alt: str, *, caption: str = "", size: Literal["three", "two", "one"] = "two"
) -> Picture:
    """Draw a figure for the page; the same figure makes the same bytes."""
    uri = "data:image/svg+xml;base64," + base64.b64encode(_bytes(draw, "svg")).decode()
    return Picture(uri=uri, alt=alt, caption=caption, size=size)


def check_picture(path: Path, option: str) -> None:
    """Refuse a file that would be no picture, before anything is run for it; raises `InputError`."""
    if path.suffix not in _KINDS:
        raise InputError(f"{option}: {str(path)!r} must end in {' or '.join(_KINDS)}")
    check_file(path, option)


def write_picture(draw: Callable[[], Figure], path: Path, option: str) -> None:
    """Write a picture; the same figure makes the same bytes.

    Args:
        draw: makes the figure.
        path: file to write; its folder is made.
        option: of the command line that names the file, to begin a message with.

    Raises:
        InputError: if the file cannot be written, or its name ends otherwise than in .png or .svg.
    """
    check_picture(path, option)
    write_file(_bytes(draw, path.suffix[1:]), path, option)


def _bytes(draw: Callable[[], Figure], kind: str) -> bytes:
    metadata = {"Date": None, "Creator": None} if kind == "svg" else {"Software": None}
    stream = io.BytesIO()
    with mpl.rc_context(_STYLE), warnings.catch_warnings():
        figure = draw()
        if kind != "svg":
            make_drawable(figure)
        # The browser that shows an SVG has fonts of its own.
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)
        figure.savefig(stream, format=kind, dpi=_DPI, metadata=metadata)
    return stream.getvalue()


def legend_label(label: str) -> str:
    """A label of a legend, which would leave out what begins with an underscore."""
    return f"\u200b{label}" if label.startswith("_") else label


def share_axis(axes: Axes) -> None:
    """Let the vertical axis be a share, in percent."""
    axes.set_yticks(np.linspace(0, 1, 6), [f"{tick} %" for tick in range(0, 101, 20)])
    axes.grid(axis="y")
