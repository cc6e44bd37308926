"""How each controller of a sweep is shown: its label, colour and marker, and in which order."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from itertools import cycle
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
    are their labels, with colours and markers that are not taken yet, always the same. Of two with the same label each
    is called by its name, too.

    Args:
        controllers: of the table, as often as they come.
        sweep: what `sweep.json` says.
    """
    names, listed = set(controllers), sweep.get("controllers") or {}
    own = {name: dict(listed[name]) for name in listed if name in names}
    found = own | {name: {} for name in sorted(names - own.keys())}
    colours, markers = (
        cycle([one for one in known if all(entry.get(kind) != one for entry in own.values())] or known)
        for kind, known in (("colour", _COLOURS), ("marker", _MARKERS))
    )
    labels = [entry.get("label") or name for name, entry in found.items()]
    return {
        name: Look(
            label=label if labels.count(label) == 1 or label == name else f"{label} ({name})",
            colour=entry.get("colour") or next(colours),
            marker=entry.get("marker") or next(markers),
            source=entry.get("source"),
        )
        for (name, entry), label in zip(found.items(), labels, strict=True)
    }
