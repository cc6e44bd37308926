"""Pictures of a sweep in files of their own, for documents."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from models.errors import InputError
from sim.report.style import style
from sim.results.out_file import check_file, write_file

_KINDS = (".png", ".svg")
_DPI = 200


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
    stream = io.BytesIO()
    metadata = {"Date": None} if path.suffix == ".svg" else {"Software": None}
    with style():
        draw().savefig(stream, format=path.suffix[1:], dpi=_DPI, metadata=metadata)
    write_file(stream.getvalue(), path, option)
