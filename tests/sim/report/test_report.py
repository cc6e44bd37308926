from __future__ import annotations

import html
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from sim.analysis.baseline import of_sweep, write_baseline
from sim.analysis.summary import summarise
from sim.presenter.render import print_sections
from sim.presenter.sections import sections
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import LIMITS, adaptive, folder_of, frame, row, sweep_facts, threshold_law
from tests.sim.chromium import CHROMIUM, needs_chromium

PHONE, DESK = 390, 1280

# What a reader would see, worked out by the browser itself.
PROBE = """<script>
addEventListener("load", () => {
  const images = [...document.images].map(i => [i.alt, i.naturalWidth, i.getBoundingClientRect().width]);
  const probe = document.createElement("pre");
  probe.id = "probe";
  probe.textContent = JSON.stringify({
    images, inner: innerWidth, scroll: document.documentElement.scrollWidth,
    loaded: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:")),
  });
  parent.document.body.append(probe);
});
</script>"""


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    law = threshold_law(LIMITS, pockets=[(0.7, 0)])
    rows = adaptive(law) + adaptive(law, world="pendulum", controllers=["supervisor"], directions=[0.0, 90.0])
    return folder_of(tmp_path_factory.mktemp("report") / "sweep", rows)


@pytest.fixture(scope="module")
def page(sweep: Path) -> str:
    old = adaptive(threshold_law(LIMITS | {"supervisor": 1.8}))
    old += adaptive(threshold_law(LIMITS), world="pendulum", controllers=["supervisor"], directions=[0.0, 90.0])
    baseline = sweep.parent / "baseline.json"
    write_baseline(of_sweep(folder_of(sweep.parent / "old", old)), baseline)
    path = sweep / REPORT
    write_report(sweep, path, baseline=baseline, failures=0)
    return path.read_text(encoding="utf-8")


def test_needs_nothing_but_itself(page: str) -> None:
    sources = re.findall(r'(?:src|href|action|data)\s*=\s*"([^"]*)"', page)
    assert sources
    assert all(source.startswith("data:") for source in sources)
    assert "url(" not in page
    assert "<script" not in page


def test_says_what_it_must(page: str) -> None:
    for words in (
        "What was run",
        "Against the baseline",
        "How hard it can be pushed",
        "What was recovered",
        "Prediction score: was the outcome what was predicted?",
        "Failures that ask for an explanation",
        "To reproduce",
        "Koolen",
        "mujoco",
        "okiagari sweep made_up.toml",
        "<b>Worse.</b>",
        "false safe, pendulum",
        "false alarm, humanoid",
        "false alarm, pendulum",
    ):
        assert words in page


def test_same_results_make_the_same_page(sweep: Path, page: str) -> None:
    again = sweep.parent / "again.html"
    write_report(sweep, again, baseline=sweep.parent / "baseline.json", failures=0)
    assert again.read_text(encoding="utf-8") == page


def browse(page: str, folder: Path, width: int) -> tuple[dict[str, Any], list[str]]:
    """What the probe saw, and what the browser wrote on its console."""
    assert CHROMIUM is not None
    path = folder / "frame.html"
    allowed = page.replace("default-src 'none'", "default-src 'none'; script-src 'unsafe-inline'")
    # A window has a least width above that of a phone; a frame has none.
    inside = html.escape(allowed.replace("</body>", PROBE + "</body>"))
    path.write_text(f'<body><iframe style="width: {width}px; border: 0" srcdoc="{inside}"></iframe></body>', "utf-8")
    switches = (
        "no-sandbox",
        "disable-gpu",
        "disable-background-networking",
        "disable-component-update",
        "disable-sync",
    )
    command = [CHROMIUM, "--headless", *(f"--{switch}" for switch in switches), "--enable-logging=stderr"]
    command += [f"--user-data-dir={folder / 'profile'}", "--window-size=1400,900", "--dump-dom", path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found is not None, done.stderr
    return json.loads(html.unescape(found[1])), [line for line in done.stderr.splitlines() if "CONSOLE" in line]


@needs_chromium
@pytest.mark.parametrize("width", [PHONE, DESK])
def test_browser_shows_every_figure(page: str, tmp_path: Path, width: int) -> None:
    seen, console = browse(page, tmp_path, width)
    assert console == []
    assert seen["loaded"] == []
    # Two envelopes, three heat maps, the curves, and the slack in two worlds.
    assert len(seen["images"]) == 8
    assert seen["inner"] == width
    for alt, natural, shown in seen["images"]:
        assert alt
        assert natural > 100
        # The narrowest column of figures still leaves their letters legible.
        assert shown > 250
    # Only tables scroll sideways, and in boxes of their own; a pixel for rounding.
    assert seen["scroll"] <= seen["inner"] + 1


@needs_chromium
def test_browser_would_tell(page: str, tmp_path: Path) -> None:
    broken = page.replace(
        "</main>", '<img src="data:image/png;base64,AAAA" alt="x"><img src="http://127.0.0.1:9/" alt="y">'
    )
    seen, console = browse(broken, tmp_path, DESK)
    assert sorted(natural for _, natural, _ in seen["images"])[:2] == [0, 0]
    assert any("Content Security Policy" in line for line in console)


def test_random_pushes_and_lone_controllers_have_a_page(tmp_path: Path) -> None:
    def law(asked: Any) -> bool:
        return bool(asked["delta_v"] < 0.3)

    rows = [
        row(law, direction_deg=(37.7 * i) % 360, delta_v=0.002 * (i + 1), start=1.0 + 0.001 * i) for i in range(200)
    ]
    folder = folder_of(tmp_path / "random", rows)
    write_report(folder, folder / REPORT, failures=0)
    text = (folder / REPORT).read_text(encoding="utf-8")
    assert "How hard it can be pushed" not in text
    assert text.count("<img ") == 3

    statue = folder_of(tmp_path / "statue", adaptive(law, controllers=["statue"], directions=[0.0]), finished=0)
    write_report(statue, statue / REPORT, failures=0)
    text = (statue / REPORT).read_text(encoding="utf-8")
    assert "Prediction score: was the outcome what was predicted?" not in text
    assert "not finished" in text


def test_many_cases_are_condensed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = {"controllers": ["supervisor", "regulator"], "directions": [0.0, 90.0], "replicas": 3}
    rows = [
        one
        for scale in (0.9, 1.0, 1.1)
        for latency in (0.0, 0.004)
        for one in adaptive(
            threshold_law({"supervisor": 1.5 * scale, "regulator": 0.8}), **options, mass_scale=scale, latency=latency
        )
    ]
    folder = folder_of(tmp_path / "sweep", rows)
    write_report(folder, folder / REPORT, failures=0)
    text = (folder / REPORT).read_text(encoding="utf-8")
    # No envelopes; two heat maps, the curves and the slack.
    assert text.count("<img ") == 4
    assert text.count("mass scale 0.9, latency 0.004") == 2
    print_sections(sections(summarise(frame(rows), sweep_facts(rows))), Console(width=80, force_terminal=False))
    printed = capsys.readouterr().out
    assert printed.count("mass scale 1, latency 0.004") == 1
    assert max(map(len, printed.splitlines())) <= 80
