"""Words of a user's in a font that has their characters, or with those replaced that no font here has."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
from matplotlib.font_manager import FontProperties, fontManager
from matplotlib.ft2font import FT2Font

_FOLDER = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
OURS = {"normal": _FOLDER / "DejaVuSans.ttf", "bold": _FOLDER / "DejaVuSans-Bold.ttf"}
"""The fonts of all pictures, by weight."""


def drawable(words: str, weight: str = "normal") -> tuple[str, FontProperties]:
    """Words that can be drawn, and the font for it.

    Args:
        words: of a user's.
        weight: "normal" or "bold".
    """
    words = " ".join(words.split())
    missing = set(map(ord, words)) - _characters(OURS[weight])
    font = _font_with(frozenset(missing | set(map(ord, words)))) if missing else OURS[weight]
    if font is None:
        font, words = OURS[weight], "".join("?" if ord(one) in missing else one for one in words)
    return words, FontProperties(fname=str(font))


def font_file(properties: FontProperties) -> str:
    """The file of a font that `drawable` has chosen."""
    return str(properties.get_file())


@lru_cache(maxsize=64)
def _characters(font: Path) -> frozenset[int]:
    return frozenset(FT2Font(str(font)).get_charmap())


@lru_cache(maxsize=16)
def _font_with(wanted: frozenset[int]) -> Path | None:
    """A font of this machine that has all these characters."""
    for entry in fontManager.ttflist:
        path = Path(entry.fname)
        try:
            # The font of last resort has a box for everything.
            if "LastResort" not in path.name and wanted <= _characters(path):
                return path
        except (OSError, RuntimeError):
            continue
    return None
