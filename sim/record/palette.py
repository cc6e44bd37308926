"""One colour for each thing, the same in videos and figures (the paper's, where it has one)."""

from __future__ import annotations

from controllers.interface import Phase

COG = "#1f5fd6"
ZMP = "#d62020"
ZMP_COMMAND = "#f08a8a"
DCM = "#f08000"
SUPPORT = "#2ca02c"
PUSH = "#8a1fb0"
FEET = "#202020"
SEEN = "#00808c"

REGULATOR = "#1f5fd6"
TRACKER = "#239023"

PHASES = {Phase.STANDING: REGULATOR, Phase.STEPPING: TRACKER}


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of "#rrggbb"."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
