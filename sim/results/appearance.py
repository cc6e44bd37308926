"""How each controller of a sweep is shown: its label, colour and marker, and in which order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

# Of what brings none of its own; told apart by the colour-blind, too (Okabe and Ito).
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#5b626b")
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a controller is shown.

    Attributes:
        label: what people call it.
        colour: "#rrggbb".
        marker: of matplotlib.
        source: SHA-256 of its file, if it is one of the user's.
    """

    label: str
    colour: str
    marker: str
    source: str | None = None

    def as_dict(self) -> dict[str, str | None]:
        """The entry of `controllers_shown` in a summary."""
        return asdict(self)


def looks(controllers: Iterable[str], sweep: Mapping[str, Any]) -> dict[str, Look]:
    """The look of every controller of a table, in the order in which they are shown.

    First come those that `sweep.json` lists, in its order and as it has them; then all others by their names, which
    are their labels, with the colour and the marker of their place. Of two with the same label each is called by its
    name, too.

    Args:
        controllers: of the table, as often as they come.
        sweep: what `sweep.json` says.
    """
    names, listed = set(controllers), sweep.get("controllers") or {}
    found = {name: listed[name] for name in listed if name in names}
    found |= {name: {} for name in sorted(names - found.keys())}
    labels = {name: entry.get("label") or name for name, entry in found.items()}
    alike = Counter(labels.values())
    return {
        name: Look(
            label=label if alike[label] == 1 or label == name else f"{label} ({name})",
            colour=found[name].get("colour") or _COLOURS[i % len(_COLOURS)],
            marker=found[name].get("marker") or _MARKERS[i % len(_MARKERS)],
            source=found[name].get("source"),
        )
        for i, (name, label) in enumerate(labels.items())
    }
