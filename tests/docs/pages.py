"""The pages as a reader has them: blocks of commands, files and Python, and tables.

A block of `sh` holds commands; one of `text` right after it, what they print among other things. A line that ends with
"`name.toml`:" right above a block makes the block that file. An HTML comment on the line above a block says more:
`needs: EXTRA`, `not run: reason`, or, of Python, `run`.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
PAGES = (HOUSE / "README.md", *sorted((HOUSE / "docs").glob("*.md")))

_FILE = re.compile(r"`(?P<name>[\w./-]+\.(?:toml|py|xml|txt))`:$")
_NOTE = re.compile(r"^<!-- (?P<word>needs|not run|run)(?:: (?P<what>.+?))? -->$")
_EXIT = re.compile(r"^ *exit code (\d)$")
_CELL = re.compile(r"(?<!\\)\|")


@dataclass(frozen=True, kw_only=True)
class Block:
    """A fenced block.

    Attributes:
        kind: what stands behind the fence; empty for none.
        text: between the fences.
        file: the file that it is; None if it is none.
        needs: the extra that its commands need; None for none.
        skipped: why its commands are not run; None if they are.
        runs: whether Python in it is run.
    """

    kind: str
    text: str
    file: str | None
    needs: str | None
    skipped: str | None
    runs: bool

    def commands(self) -> Iterator[tuple[list[str], int]]:
        """The words of each command, and the exit code that its comment promises, else 0."""
        for line in self.text.replace("\\\n", " ").splitlines():
            if words := shlex.split(line, comments=True):
                promised = _EXIT.search(line.partition("#")[2])
                yield words, int(promised[1]) if promised else 0


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    found: list[Block] = []
    above, lines = "", iter(page.read_text(encoding="utf-8").splitlines())
    for line in lines:
        if line.startswith("```"):
            # Up to the closing fence; a page without one fails here.
            inside = list(iter(lambda: next(lines), "```"))
            found.append(_block(line.removeprefix("```"), "".join(f"{each}\n" for each in inside), above))
        above = line
    return found


def _block(kind: str, text: str, above: str) -> Block:
    note, file = _NOTE.match(above), _FILE.search(above)
    word, what = (note["word"], note["what"]) if note else (None, None)
    return Block(
        kind=kind,
        text=text,
        file=file["name"] if file else None,
        needs=what if word == "needs" else None,
        skipped=what if word == "not run" else None,
        runs=kind == "python" and word in ("run", "needs"),
    )


def tables(page: Path, marker: str) -> list[tuple[str, list[list[str]]]]:
    """The tables right after comments `<!-- MARKER: WHAT -->`: what each is of, and its rows without the head."""
    found = []
    text = page.read_text(encoding="utf-8")
    for match in re.finditer(rf"^<!-- {marker}: (.+) -->\n((?:\|.*\n)+)", text, re.MULTILINE):
        rows = [[cell.strip() for cell in _CELL.split(line)[1:-1]] for line in match[2].splitlines()]
        found.append((match[1], rows[2:]))
    return found


def names(cell: str) -> list[str]:
    """The names in backticks of a cell."""
    return re.findall(r"`([^`]+)`", cell)
