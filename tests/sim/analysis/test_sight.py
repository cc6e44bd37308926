"""How far off controllers saw, summed up over a sweep."""

from __future__ import annotations

from io import StringIO

import numpy as np
from rich.console import Console

from sim.analysis.frame import each_push
from sim.analysis.sight import sight
from sim.analysis.summary import summarise
from sim.presenter.render import print_sections
from sim.presenter.sections import sections
from sim.report.sight_chart import sight_plot
from tests.sim.analysis.sweep_tables import frame, row, sweep_facts


def rows() -> list[dict[str, object]]:
    found = []
    for replica, error in enumerate((0.001, 0.002, 0.006)):
        seen = row(lambda _: True, sensing="typical", latency=0.004, replica=replica)
        found.append(seen | {"dcm_error_rms": error, "dcm_error_peak": 10 * error})
        found.append(row(lambda _: True, replica=replica))
    return found


def test_it_is_of_those_that_did_not_see_the_truth() -> None:
    (entry,) = sight(frame(rows()))
    assert (entry["controller"], entry["n"]) == ("supervisor", 3)
    assert entry["case"] == {"sensing": "typical", "latency": 0.004}
    assert entry["dcm_error_rms"] == {"median": 0.002, "max": 0.006}
    assert entry["dcm_error_peak"] == {"median": 0.02, "max": 0.06}
    assert sight(frame([row(lambda _: True)])) == []


def test_it_is_told() -> None:
    out = StringIO()
    print_sections(sections(summarise(frame(rows()), sweep_facts(rows()))), Console(file=out, width=100))
    assert "What the controllers saw" in out.getvalue() or "Error of the DCM that was seen" in out.getvalue()
    assert "sensing typical, latency 0.004" in out.getvalue()


def test_the_report_draws_it_by_the_size_of_the_push() -> None:
    pushes = each_push(frame(rows()))
    (drawn,) = sight_plot(pushes)
    assert "3 pushes" in drawn.alt  # of six: the others saw the true state
    assert sight_plot(pushes.assign(dcm_error_rms=np.nan)) == []
