"""Examples in the documents print exactly what the documents say they print."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parents[2]
# A block's lines are those up to the first fence, so that one block cannot run on into the next.
_LINES = r"(?:(?!```).*\n)*"
_EXAMPLE = re.compile(rf"^```python\n(?P<code>{_LINES})```\n```text\n(?P<output>{_LINES})```$", re.MULTILINE)


def examples() -> list[tuple[str, str, str]]:
    """Every block of Python with a block of text right after it: document, code, output."""
    documents = [HOUSE / "README.md", *sorted((HOUSE / "docs").glob("*.md"))]
    return [
        (f"{path.name}-{i}", match["code"], match["output"])
        for path in documents
        for i, match in enumerate(_EXAMPLE.finditer(path.read_text(encoding="utf-8")))
    ]


@pytest.mark.parametrize(
    ("code", "output"), [(c, o) for _, c, o in examples()], ids=[name for name, _, _ in examples()]
)
def test_example_prints_what_it_says(code: str, output: str) -> None:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, "example", "exec"), {"__name__": "__main__"})
    assert printed.getvalue() == output


def test_the_sets_have_an_example() -> None:
    names = [name for name, _, _ in examples()]
    assert any(name.startswith("sets.md") for name in names)
    assert any(name.startswith("README.md") for name in names)
