from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import typer
from rich.console import Console

from models.errors import InputError
from sim.analysis.baseline import of_sweep, write_baseline
from sim.analysis.summary import summarise
from sim.cli import check, report
from sim.presenter.render import print_sections
from sim.presenter.sections import sections
from sim.report import failures
from sim.report.failures import Failure
from sim.report.report import REPORT, write_report
from tests.sim.analysis.sweep_tables import CONTROLLERS, adaptive, folder_of, frame, row, sweep_facts, threshold_law

LIMITS = {"supervisor": 1.5, "regulator": 0.8, "statue": 0.5}
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
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
        "Prediction score: did the sets predict the outcome?",
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


needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no browser: install Debian's package chromium")


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
    assert "Prediction score: did the sets predict the outcome?" not in text
    assert "not finished" in text


def test_many_cases_are_condensed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = {"controllers": ["supervisor", "regulator"], "directions": [0.0, 90.0], "replicas": 3}
    rows = [
        one
        for scale in (0.9, 1.0, 1.1)
        for delay in (0.0, 0.004)
        for one in adaptive(
            threshold_law({"supervisor": 1.5 * scale, "regulator": 0.8}), **options, mass_scale=scale, delay=delay
        )
    ]
    folder = folder_of(tmp_path / "sweep", rows)
    write_report(folder, folder / REPORT, failures=0)
    text = (folder / REPORT).read_text(encoding="utf-8")
    # No envelopes; two heat maps, the curves and the slack.
    assert text.count("<img ") == 4
    assert text.count("mass scale 0.9, delay 0.004") == 2
    print_sections(sections(summarise(frame(rows), sweep_facts(rows))), Console(width=80, force_terminal=False))
    printed = capsys.readouterr().out
    assert printed.count("mass scale 0.9, delay 0.004") == 1
    assert max(map(len, printed.splitlines())) <= 80


def worst_failures(rows: list[dict[str, Any]], count: int) -> list[Failure]:
    return failures.worst_failures(frame(rows), count)


def test_worst_failures_are_the_weakest_pushes_and_the_broken_promises() -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"])
    found = worst_failures(rows, 4)
    lost = [one for one in rows if one["outcome"] != "recovered"]
    assert found[0].row["delta_v_over_omega_d"] == min(one["delta_v_over_omega_d"] for one in lost)
    assert "weakest" in found[0].why
    assert len({(one.row["direction_deg"], one.row["delta_v"]) for one in found}) == 4
    crash = next(one for one in rows if one["delta_v"] == 0.2)
    crash["outcome"] = "crashed"
    assert worst_failures(rows, 4)[0].row["episode"] == crash["episode"]
    assert worst_failures(rows, 0) == []
    assert worst_failures([one for one in rows if one["outcome"] == "recovered"], 4) == []


def test_lost_though_predicted_safe_is_shown() -> None:
    rows = adaptive(lambda _: True, controllers=["supervisor"], directions=[0.0], levels=9)
    for one in rows:
        one["in_tracking_set_end"] = None
        one["outcome"] = "fell" if one["delta_v"] > 0.12 else "recovered"
    rows[-1] |= {"regulator_slack_end": 0.05, "in_regulator_set_end": True}
    weakest, surprise = worst_failures(rows, 2)
    assert weakest.row["delta_v"] == pytest.approx(0.15)
    assert (surprise.row["episode"], surprise.why) == (
        rows[-1]["episode"],
        "Predicted safe, with 50.0 mm of slack, and lost",
    )


@pytest.mark.parametrize(("levels", "asked"), [(3, 4), (9, 0)])
def test_report_without_failures_says_why(tmp_path: Path, levels: int, asked: int) -> None:
    variants: dict[str, dict[str, Any]] = {"full": {}, "weak": {}}
    rows = [
        one
        for name, limit in (("full", 1.0), ("weak", 0.2))
        for one in adaptive(threshold_law({"supervisor": limit}), controllers=["supervisor"], directions=[0.0])
        if one["delta_v"] < 0.05 * levels + 0.01
        for one in [one | {"variant": name, "episode": f"{name}{one['episode']}"[:12]}]
    ]
    # Shown first, but not what the first variant has.
    rows.append(rows[-1] | {"controller": "regulator", "variant": "weak", "episode": "other"})
    facts = {"variants": variants, "controllers": dict(reversed(CONTROLLERS.items()))}
    assert "fell" in {one["outcome"] for one in rows}
    folder = folder_of(tmp_path / "sweep", rows, **facts)
    write_report(folder, folder / REPORT, failures=asked)
    text = html.unescape((folder / REPORT).read_text(encoding="utf-8"))
    own = [one for one in rows if one["variant"] == "full"]
    lost = sum(one["outcome"] != "recovered" for one in own)
    if asked:
        assert f"None: “full” (supervisor) recovered from all of its {len(own)} pushes." in text
    else:
        assert lost
        assert f"for 0 were asked for: “full” (supervisor) did not recover from {lost} of its {len(own)} pushes" in text


def test_sets_in_words() -> None:
    one = row(lambda _: True) | {"regulator_slack_end": -0.0123, "tracking_slack_end": float("-inf")}
    assert Failure(row=one, why="").sets == "regulator set -12.3 mm, tracking set no step within reach"
    none = {"in_regulator_set_end": None, "in_tracking_set_end": None}
    assert Failure(row=one | none, why="").sets == "no set was asked"


def program() -> typer.Typer:
    app = typer.Typer()
    report.register(app)
    check.register(app)
    return app


def call(*arguments: str | Path) -> int:
    """The exit code; errors of the user come through as the program's own line would tell them."""
    code = program()(args=[str(argument) for argument in arguments], standalone_mode=False)
    return code if isinstance(code, int) else 0


def test_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    some = {"directions": [0.0, 90.0]}
    sweep = folder_of(tmp_path / "sweep", adaptive(threshold_law(LIMITS), **some))
    weak = adaptive(threshold_law(LIMITS | {"supervisor": 1.0}), **some)
    weakened = folder_of(tmp_path / "weakened", weak)
    baseline = tmp_path / "baseline.json"
    assert call("baseline", sweep, "--out", baseline) == 0
    assert call("check", sweep, "--baseline", baseline) == 0
    assert "not worse" in capsys.readouterr().out
    assert call("check", weakened, "--baseline", baseline) == 1
    printed = capsys.readouterr().out
    assert printed.startswith("worse")
    assert "more than one step" in printed
    lost = next(one for one in weak if one["episode"] in printed and one["outcome"] == "fell")
    assert f"okiagari replay {weakened} {lost['episode']} --video" in printed
    assert call("summary", sweep) == 0
    assert (sweep / "summary.json").is_file()
    assert call("report", sweep, "--failures", "0") == 0
    assert (sweep / REPORT).is_file()


def test_what_cannot_be_compared_is_refused(tmp_path: Path, sweep: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        call("check", sweep, "--baseline", tmp_path / "none.json")
    with pytest.raises(InputError, match="not the folder of a sweep"):
        call("report", tmp_path)
    baseline = tmp_path / "baseline.json"
    call("baseline", sweep, "--out", baseline)
    other = folder_of(tmp_path / "other", adaptive(threshold_law(LIMITS), directions=[0.0]), name="other")
    with pytest.raises(InputError, match="suite"):
        call("check", other, "--baseline", baseline)
