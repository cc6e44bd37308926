"""What is told of a sweep, in words already: sections of tables, which terminal, Markdown and page only lay out."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

Heading = tuple[str, str]
"""Of a column: what it has in common with its neighbours, or "", and its own heading."""

_NUMBER = re.compile(r"[≥<+−–\d]|$")


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table.

    Attributes:
        title: what it holds, in a line.
        rows: from top to bottom, each heading -> cell; what has no heading in common may be a string alone.
        totals: how many rows at the end condense those above.
        strong: heading of the column that a reader shall see first.
        notes: what must be known to read it.
        shown: everywhere, on the page only, or there only when it is asked for.
    """

    title: str
    rows: tuple[Mapping[Any, str], ...]
    totals: int = 0
    strong: str = ""
    notes: tuple[str, ...] = ()
    shown: Literal["everywhere", "page", "folded"] = "everywhere"

    @property
    def columns(self) -> dict[Heading, list[str]]:
        """Heading -> cells, in order; what a row lacks is empty."""
        keys = dict.fromkeys(key for row in self.rows for key in row)
        return {("", key) if isinstance(key, str) else key: [row.get(key, "") for row in self.rows] for key in keys}

    @property
    def groups(self) -> Iterator[tuple[str, list[Heading]]]:
        """Neighbours that have a heading in common; the others one by one."""
        for _, members in groupby(enumerate(self.columns), lambda at: at[1][0] or at[0]):
            headings = [heading for _, heading in members]
            yield headings[0][0], headings

    @property
    def numbers(self) -> set[Heading]:
        """Columns of numbers, which belong at the right and may not be broken."""
        return {heading for heading, cells in self.columns.items() if all(map(_NUMBER.match, cells))}


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture of the page: its data, what it shows in words, and how many of its size have room side by side."""

    uri: str
    alt: str
    caption: str = ""
    size: Literal["three", "two", "one"] = "two"


@dataclass(frozen=True, kw_only=True)
class Section:
    """What is told of one question.

    Attributes:
        key: of the question, the same for all robots.
        heading: over it.
        text: before the tables, on the page only.
        tables: the answer.
        notes: what must be known to read them.
        robot: whose it is, if there are several.
        pictures: on the page only.
    """

    key: str
    heading: str
    text: str = ""
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    robot: str = ""
    pictures: tuple[Picture, ...] = ()
