"""Lays out tables for the terminal and in Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from sim.presenter.tables import Heading, Section, Table

# Of what is no terminal: a line of a table in a file or a pipe is never broken.
_ENDLESS = 10_000
_GAP = 2  # characters between two columns
_WORDS = 24  # characters that a column of words has at least, if it is that long
# What Markdown would take for markup; an underscore within a word, or a < before a number, is none.
_MARKUP = re.compile(r"[\\`*|]|<(?=[A-Za-z/!?])|(?<!\w)_|_(?!\w)")


def terminal() -> Console:
    """A console that breaks lines at the width of a terminal, and none where there is no terminal."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=_ENDLESS)


def print_sections(sections: Iterable[Section], console: Console | None = None) -> None:
    """Print the tables that are shown everywhere.

    Args:
        sections: of a summary.
        console: to print on; None for the program's output.
    """
    console = console or terminal()
    for section in sections:
        for table in section.tables:
            if table.shown == "everywhere":
                _print(table, console)
        for note in section.notes:
            console.print(Text(note, style="dim"))


def _print(table: Table, console: Console) -> None:
    console.print(Text(table.title, style="italic"))
    columns, numbers, last = table.columns, table.numbers, len(table.rows) - table.totals
    for part in _parts(table, console.width):
        shown = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, _GAP - 1, 0, 0))
        for heading, words in part.items():
            number = heading in numbers
            shown.add_column(Text(words), justify="right" if number else "left", no_wrap=number, overflow="fold")
        for i, cells in enumerate(zip(*(columns[heading] for heading in part), strict=True)):
            shown.add_row(*map(Text, cells), style="bold" if i >= last else "", end_section=i == last - 1)
        console.print(shown)
    for note in table.notes:
        console.print(Text(note, style="dim"))


def _parts(table: Table, width: int) -> Iterator[dict[Heading, str]]:
    """Columns, with their headings in two lines, that have room side by side; the first comes again in every part."""
    columns, numbers, part = table.columns, table.numbers, dict[Heading, str]()

    def needed(headings: dict[Heading, str]) -> int:
        widths = {h: max(map(len, (*words.splitlines(), *columns[h]))) for h, words in headings.items()}
        return sum((w if h in numbers else min(w, _WORDS)) + _GAP for h, w in widths.items())

    for group, members in table.groups:
        words = {one: f"{group if i == 0 else ''}\n{one[1]}" if group else one[1] for i, one in enumerate(members)}
        if len(part) > 1 and needed(part | words) > width:
            yield part
            part = dict(list(part.items())[:1])
        part |= words
    yield part


def markdown(table: Table) -> str:
    """A table in Markdown, with its notes."""
    columns = {f"{group} {words}".strip(): cells for (group, words), cells in table.columns.items()}
    marks = ["**" if words == table.strong else "" for words in columns]
    rows = [
        [f"{mark}{_escaped(cell)}{mark}" for mark, cell in zip(marks, cells, strict=True)]
        for cells in zip(*columns.values(), strict=True)
    ]
    lines = [f"| {' | '.join(cells)} |" for cells in (map(_escaped, columns), *rows)]
    return "\n".join([lines[0], "|---" * len(columns) + "|", *lines[1:], *(f"\n{_escaped(n)}" for n in table.notes)])


def _escaped(words: str) -> str:
    return _MARKUP.sub(r"\\\g<0>", " ".join(words.split()))
