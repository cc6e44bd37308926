"""Words of a user's in a font that has their characters; those that no font here has are replaced."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, fontManager
from matplotlib.ft2font import FT2Font
from matplotlib.text import Text

OURS = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
"""The font of all pictures."""


def drawable(words: str, own: Path = OURS) -> tuple[str, Path]:
    """Words that can be drawn, and the font for them: the own one, or else that which lacks the fewest of them.

    Args:
        words: of a user's.
        own: file of the font that is wanted.
    """
    font = _font_for(frozenset(map(ord, words)), own)
    had = _characters(font)
    return "".join(one if ord(one) in had else "?" for one in words), font


def make_drawable(figure: Figure) -> None:
    """Draw every text of a figure in a font that has its characters."""
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        font = text.get_fontproperties().copy()
        own = Path(findfont(font))
        if set(map(ord, text.get_text())) - _characters(own) - {ord("\n")}:
            words, other = drawable(text.get_text(), own)
            font.set_file(str(other))
            text.set(text=words, fontproperties=font)


@lru_cache(maxsize=512)
def _characters(font: Path) -> frozenset[int]:
    return frozenset(FT2Font(str(font)).get_charmap())


@lru_cache(maxsize=64)
def _font_for(wanted: frozenset[int], own: Path) -> Path:
    found, lacking = own, len(wanted - _characters(own))
    for entry in fontManager.ttflist if lacking else ():
        path = Path(entry.fname)
        try:
            missing = len(wanted - _characters(path))
        except (OSError, RuntimeError):
            continue
        # The font of last resort has a box for everything.
        if missing < lacking and "LastResort" not in path.name:
            found, lacking = path, missing
    return found
