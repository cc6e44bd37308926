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
from sim.report.sight_chart import draw_sight, sight_plot
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
    asked = "the sets were asked of the state that was seen"
    assert asked in " ".join(out.getvalue().split())
    exact = [row(lambda _: True)]
    (prediction,) = (one for one in sections(summarise(frame(exact), sweep_facts(exact))) if one.key == "prediction")
    assert not any(asked in note for note in prediction.notes)


def test_the_report_draws_it_by_the_size_of_the_push() -> None:
    pushes = each_push(frame(rows()))
    (drawn,) = sight_plot(pushes)
    assert "3 pushes" in drawn.alt  # of six: the others saw the true state
    assert sight_plot(pushes.assign(dcm_error_rms=np.nan)) == []


def test_its_picture_has_a_mark_an_episode_and_medians_by_outcome() -> None:
    made = []
    for level in range(1, 7):
        for replica in range(4):
            seen = row(lambda asked: asked["delta_v"] < 0.45, sensing="typical", delta_v=0.1 * level, replica=replica)
            made.append(seen | {"dcm_error_rms": 0.001 * level, "dcm_error_peak": 0.004 * level})
    figure = draw_sight(each_push(frame(made)))
    for axes, scale in zip(figure.axes, (1.0, 4.0), strict=True):
        assert [len(marks.get_offsets()) for marks in axes.collections] == [16, 8]
        stood, lost = axes.get_lines()
        np.testing.assert_allclose(stood.get_ydata(), scale * np.arange(1, 5))
        np.testing.assert_allclose(stood.get_xdata(), 0.1 * np.arange(1, 5))
        np.testing.assert_allclose(lost.get_ydata(), scale * np.arange(5, 7))
        assert axes.get_xlabel() == "Δv [m/s]"
        assert axes.get_ylabel().endswith("[mm]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["recovered", "not recovered"]
