"""Variants of a suite: named changes of its base scenario, so that designs can be compared push by push."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from scenarios.choice import REGISTRIES
from scenarios.schema import Scenario

DECIDED = ("description", "world", "duration", "seed", "pushes")
"""Fields of a scenario that a suite decides itself, and no variant."""
CHANGEABLE = tuple(name for name in Scenario.model_fields if name not in DECIDED)
"""Fields of a scenario that a variant may change."""

WORLD: Mapping[str, str] = MappingProxyType(
    {
        "mass_scale": "disturbance.mass_scale",
        "friction": "disturbance.friction",
        "sensing": "sensing.preset",
        "latency": "sensing.latency",
        "noise_position": "sensing.state_noise.position",
        "noise_velocity": "sensing.state_noise.velocity",
        "body_error": "body.scale",
    }
)
"""Parameter of an episode that says how its world differs from what the controllers believe -> its dotted field."""

_PARAMETERS = {field: name for name, field in WORLD.items()}

# Its fields depend on its kind, so that a table of it is a whole gain and no change of the base's.
_WHOLE = "gain"


def _flat(variants: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for name, table in variants.items():
        if not name.strip() or "\n" in name:
            raise ValueError(f"has a variant named {name!r}; a name must be one line that is not empty")
        found[name] = {}
        for field, value in _leaves(table):
            if field in found[name]:
                raise ValueError(f"gives {field} of {name!r} twice")
            found[name][field] = value
    return found


def _leaves(table: Mapping[str, Any], within: str = "") -> Iterator[tuple[str, Any]]:
    """The same whether a file says `"stepping.replan" = false` or `stepping = { replan = false }`."""
    for name, value in table.items():
        field = within + name
        if isinstance(value, dict) and field != _WHOLE:
            yield from _leaves(value, field + ".")
        else:
            yield field, value


Variants = Annotated[dict[str, dict[str, Any]], Field(min_length=1), AfterValidator(_flat)]
"""Name -> dotted field -> value; the first is what the others are compared with."""


def changed(fields: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A scenario's fields with some replaced.

    Args:
        fields: of a scenario, as `Scenario.as_dict` has them; not touched.
        changes: dotted field -> value; what a scenario does not know is put in, too, for its check to refuse.
    """
    result = copy.deepcopy(dict(fields))
    for field, value in changes.items():
        *tables, name = field.split(".")
        place = result
        for table in tables:
            held = place.get(table)
            if not isinstance(held, dict):
                # A class that is named alone is a table without options.
                place[table] = {"name": held} if isinstance(held, str) else {}
            place = place[table]
        place[name] = value
    return result


def parameter_of(field: str) -> str | None:
    """The parameter of an episode that a dotted field is, if it is one: "sensing.latency" is `latency`."""
    if field in _PARAMETERS:
        return _PARAMETERS[field]
    table, _, name = field.rpartition(".")
    if table in REGISTRIES and name == "name":
        return table
    return field if field in ("robot", *REGISTRIES) else None
