"""Every command and every file that the pages show is tried, page by page, as a reader would."""

from __future__ import annotations

import importlib.util
import os
import re
from pathlib import Path
from typing import Any

import pytest

from models.adopt.catalogue import PACKAGE
from sim.cli.app import main
from tests.docs.pages import HOUSE, PAGES, Block, blocks

EXTRAS = {
    "gym": "gymnasium",
    "onnx": "onnxruntime",
    "robots": PACKAGE,
    "view": "viser",
    "cluster": "distributed",
}
"""Extra -> the module that it brings."""
NOT_OURS = ("make", "pip", "python", "dask", "ssh")
"""Programs whose commands are shown and not run."""
KINDS = ("", "sh", "toml", "xml", "python", "text")


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where robots that are known are adopted to, once for all pages."""
    return tmp_path_factory.mktemp("cache")


def run(block: Block, names: dict[str, Any]) -> str | None:
    """Try a block in the present folder; why it cannot be tried, if so."""
    if block.needs is not None and importlib.util.find_spec(EXTRAS[block.needs]) is None:
        return f"needs pip install 'okiagari[{block.needs}]'"
    if block.file is not None:
        Path(block.file).parent.mkdir(parents=True, exist_ok=True)
        Path(block.file).write_text(block.text, encoding="utf-8")
    elif block.runs:
        exec(compile(block.text, "page", "exec"), names)
    for words, code in block.commands() if block.kind == "sh" and block.skipped is None else ():
        if words[0] == "okiagari":
            assert main(words[1:]) == code, " ".join(words)
        else:
            assert words[0] in NOT_OURS, f"{words[0]}: neither ours nor one that is not run"
    return None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_all_that_a_page_shows_can_be_done(
    page: Path,
    tmp_path: Path,
    cache: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))
    # One process is quicker for a handful of episodes: starting one takes longer than they do.
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    # The reader works in a checkout.
    for name in ("scenarios", "baselines"):
        (tmp_path / name).symlink_to(HOUSE / name)
    names: dict[str, Any] = {"__name__": "__main__"}
    missing, printed, before = dict[str, None](), "", None
    for block in blocks(page):
        if block.kind == "text" and before is not None and before.kind == "sh" and printed:
            assert block.text in printed
        if (why := run(block, names)) is not None:
            missing[why] = None
        captured, before = capsys.readouterr(), block
        printed = captured.out + captured.err
    if missing:
        pytest.skip("; ".join(missing))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_keeps_to_what_is_tried(page: Path) -> None:
    for block in blocks(page):
        assert block.kind in KINDS
        assert block.kind or not block.text.startswith("okiagari "), "commands are blocks of sh"
        assert block.needs in (None, *EXTRAS)


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_what_is_wrong_is_seen(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "Save as `a.toml`:\n```toml\nx = 1\n```\n<!-- not run: long -->\n```sh\nokiagari run --wrong\n```\n"
        "\n```sh\nokiagari run no_such_scenario   # exit code 2\nokiagari list --wrong\n```\n"
    )
    first, second, third = blocks(page)
    assert (first.file, second.skipped) == ("a.toml", "long")
    assert list(third.commands()) == [
        (["okiagari", "run", "no_such_scenario"], 2),
        (["okiagari", "list", "--wrong"], 0),
    ]
    assert run(second, {}) is None
    with pytest.raises(AssertionError, match="--wrong"):
        run(third, {})
