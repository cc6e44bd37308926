"""Values at the rim, and what they are put into: tables of TOML, elements of XML, and plain text."""

from __future__ import annotations

import copy
import datetime
import math
import random
import re
import xml.etree.ElementTree as ET
from typing import Any

import tomli_w

NUMBERS: tuple[Any, ...] = (
    0, 0.0, -0.0, 1, -1, 2, 0.5, 5e-324, 1e-300, 1e-9, 1e-6, 1e-4, 0.001, 0.002, 0.01, 0.1, 3.0, 10, 20.0, 60.0, 180,
    360.0, 1000.0, 3600.0, 3600.1, 1e6, 1e8, 1e9, 1e15, 1.7e308, -1e9, -1e308, math.nan, math.inf, -math.inf,
    2**31, 2**53 + 1, 2**63 - 1, 2**63, 2**64, -(2**63), 10**30,
)  # fmt: skip
WORDS: tuple[Any, ...] = (
    "", " ", "x", "nan", "1", "trunk", "cog", "world", "left_foot", "humanoid", "pendulum", "supervisor", "statue",
    "ik", "quiet", "smoke", "utmu2", "sets", "polygon", "half_sine", "lqr", "poles", "dcm", "gone.toml", "gone.xml",
    "a/b.py:C", "..", "/", "/dev/null", "/etc/passwd", "~", "-", "--", "a\0b", "a\0b.xml", "a\0b.toml", "a\nb",
    "\x1b[31m", "[red]x[/]", "\u202e\U0001f600", "x" * 300, "x" * 300 + ".xml", "x" * 5000 + ".toml",
    "y/" * 2100 + "z.py:C", "%s{0}{}", "'", '"',
)  # fmt: skip


def number(rng: random.Random) -> Any:
    """At the rim, or anywhere on a logarithmic scale."""
    if rng.random() < 0.6:
        return rng.choice(NUMBERS)
    size = 10.0 ** rng.uniform(-6, 6)
    return rng.choice((size, -size, round(size, 3), int(size)))


def nearby(rng: random.Random, old: Any) -> Any:
    """A number of the same type, up to three times as large or small."""
    if isinstance(old, bool):
        return not old
    return type(old)(old * rng.choice((0.34, 0.5, 0.9, 1.1, 1.5, 2.0, 3.0)))


def value(rng: random.Random, depth: int = 0) -> Any:
    """Of any type that TOML knows."""
    kind = rng.random()
    if kind < 0.55:
        return number(rng)
    if kind < 0.75:
        return rng.choice(WORDS)
    if kind < 0.8:
        return rng.random() < 0.5
    if kind < 0.82:
        return datetime.date(2026, 1, 1)
    if depth > 3:
        return []
    if kind < 0.93:
        return [value(rng, depth + 1) for _ in range(rng.choice((0, 1, 2, 3, 4, 30)))]
    return {rng.choice(("a", "first", "last", "step", "name", "kind")): value(rng, depth + 1) for _ in range(3)}


def _places(table: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all that is in a table, at any depth."""
    items = table.items() if isinstance(table, dict) else enumerate(table) if isinstance(table, list) else ()
    return [place for key, inner in items for place in ((*path, key), *_places(inner, (*path, key)))]


def table(rng: random.Random, base: dict[str, Any]) -> dict[str, Any]:
    """A table with one to three changes."""
    fields = copy.deepcopy(base)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = _places(fields)
        if not places:
            break
        *above, last = rng.choice(places)
        holder = fields
        for key in above:
            holder = holder[key]
        act = rng.random()
        if act < 0.7:
            old = holder[last]
            plain = isinstance(old, int | float) and rng.random() < 0.8
            holder[last] = value(rng) if not plain else number(rng) if rng.random() < 0.5 else nearby(rng, old)
        elif act < 0.8:
            del holder[last]
        elif act < 0.9 and isinstance(holder, list):
            holder.append(copy.deepcopy(holder[last]))
        elif isinstance(holder, dict):
            holder[rng.choice((f"{last}s", "x", "pushes", "timing", "gain", "random", "train", "first"))] = value(rng)
    return fields


def toml(rng: random.Random, base: dict[str, Any]) -> bytes:
    """A file of a changed table, now and then broken as text too."""
    text = tomli_w.dumps(table(rng, base))
    if rng.random() < 0.02:
        depth = rng.choice((10, 30, 500, 3000))
        lists, keys = "zz = " + "[" * depth + "]" * depth, "zz" + ".z" * depth
        text = rng.choice((f"{lists}\n{text}", f"{keys} = 1\n{text}", f"{text}\n[{keys}]"))
    return broken(rng, text) if rng.random() < 0.15 else text.encode("utf-8")


def broken(rng: random.Random, text: str) -> bytes:
    """Text with bytes cut, doubled or replaced."""
    content = bytearray(text.encode("utf-8"))
    for _ in range(rng.choice((1, 1, 2, 5))):
        at, length = rng.randrange(len(content) + 1), rng.choice((1, 1, 3, 20, 300))
        act = rng.random()
        if act < 0.4:
            content[at : at + length] = bytes(rng.randrange(256) for _ in range(min(length, 3)))
        elif act < 0.6:
            del content[at : at + length]
        elif act < 0.8:
            content[at:at] = content[max(0, at - length) : at]
        else:
            del content[at:]
    return bytes(content)


def mjcf(rng: random.Random, base: str) -> bytes:
    """A robot's file with one to four changes of its elements, now and then broken as text too."""
    root = ET.fromstring(base)
    for _ in range(rng.choice((1, 1, 2, 4))):
        parents = {child: parent for parent in root.iter() for child in parent}
        if not parents:
            break
        element = rng.choice(list(parents))
        act = rng.random()
        if act < 0.6 and element.attrib:
            key = rng.choice(list(element.attrib))
            element.attrib[key] = _attribute(rng, element.attrib[key])
        elif act < 0.7 and element.attrib:
            del element.attrib[rng.choice(list(element.attrib))]
        elif act < 0.8:
            parents[element].remove(element)
        elif act < 0.87:
            parents[element].append(copy.deepcopy(element))
        elif act < 0.93:
            element.set(rng.choice(("euler", "class", "gear", "type", "mass", "group", "limited")), str(number(rng)))
        else:
            gravity = " ".join(str(number(rng)) for _ in range(3))
            root.insert(0, ET.Element("option", gravity=gravity, timestep=str(number(rng))))
    text = ET.tostring(root, encoding="unicode")
    return broken(rng, text) if rng.random() < 0.1 else text.encode("utf-8")


def _attribute(rng: random.Random, text: str) -> str:
    parts = text.split()
    if parts and re.fullmatch(r"[-+.\deE]+", parts[0]):
        at = rng.randrange(len(parts))
        act = rng.random()
        if act < 0.5:
            parts[at] = str(float(parts[at]) * rng.choice((-1.0, 0.05, 0.5, 0.9, 1.1, 2.0, 20.0)))
        elif act < 0.8:
            parts[at] = str(number(rng))
        elif act < 0.9:
            del parts[at]
        else:
            parts.append("0")
        return " ".join(parts)
    return rng.choice((*(word for word in WORDS if word.isprintable()), "box", "capsule", "mesh", "trunk", "left_sole"))
