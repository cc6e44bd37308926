"""The figure shows the sets and the course of an episode, and none of its words lies on another."""

from __future__ import annotations

import io
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from controllers.interface import Phase
from sim.episode.set_polygons import SetPolygon
from sim.record.palette import PUSH, REGULATOR, TRACKER, rgb
from sim.record.trace import Trace
from sim.viz.figures import draw_episode, episode_figure
from sim.viz.glyphs import OURS, drawable
from sim.viz.playback import Playback
from sim.viz.time_scale import NARROWER, time_scale
from tests.sim.still_traces import ROBOT, during, scenario, still_trace

HEXAGON = np.array([[-0.06, 0.05], [-0.03, 0.25], [0.045, 0.12], [0.06, -0.05], [0.03, -0.25], [-0.045, -0.12]])


@dataclass(frozen=True)
class Shown:
    trace: Trace
    set_polygons: tuple[SetPolygon, ...] = ()


def pushed(count: int = 3, duration: float = 12.0) -> Trace:
    """Pushes forward, each larger; after the last, it steps 0.1 m within 0.6 s."""
    gap = duration / (count + 1)
    pushes = [{"start": gap * (i + 1), "direction": 0, "delta_v": 0.1 * (i + 1)} for i in range(count)]
    run = scenario(world="pendulum", duration=duration, pushes=pushes)
    last = gap * count + 0.05
    tracker = during(run, last, last + 0.6, 1.0)
    stepped = during(run, last + 0.6, duration, 0.1)
    speed = sum(
        during(run, p["start"], p["start"] + 0.5, p["delta_v"])
        for p in pushes  # type: ignore[arg-type, type-var]
    )
    return still_trace(
        run, phase=tracker, left_force=np.where(tracker, 0.0, 30.0), left_x=stepped, right_x=stepped, cog_vx=speed
    )


def polygons(push: int, plane: str = "x-xdot", shift: float = 0.0) -> tuple[SetPolygon, ...]:
    return (
        SetPolygon(
            name="regulator",
            push=push,
            plane=plane,  # type: ignore[arg-type]
            kind="slice",
            vertices=HEXAGON,
            cut=np.arange(6) == 2,
        ),
        SetPolygon(
            name="tracking",
            push=push,
            plane=plane,  # type: ignore[arg-type]
            kind="projection",
            vertices=1.2 * HEXAGON + [0.05, 0.1 + shift],
            cut=np.zeros(6, dtype=bool),
        ),
    )


def words(figure: Figure) -> list[Text]:
    """What is written, without the labels of ticks beyond the limits: they exist but are not drawn."""
    figure.canvas.draw()
    undrawn: list[Text] = []
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick, place in zip(axis.get_major_ticks(), axis.get_majorticklocs(), strict=True):
                if not low <= place <= high or not axes.axison:
                    undrawn += [tick.label1, tick.label2]
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and not any(text is other for other in undrawn)
    ]


@pytest.mark.parametrize(
    "shown",
    [
        Shown(pushed(), (*polygons(1), *polygons(2), *polygons(3, shift=0.03))),
        Shown(pushed(), (*polygons(1), *polygons(1, "y-ydot"))),
        Shown(pushed(12, 30.0), tuple(p for i in range(1, 13) for p in polygons(i, shift=0.01 * i))),
        Shown(still_trace(scenario(duration=1.0))),
    ],
    ids=["three pushes", "both planes", "twelve pushes", "no push, no sets"],
)
def test_words_stay_apart_and_in_the_picture(shown: Shown) -> None:
    figure = episode_figure(shown)
    page = figure.bbox
    boxes = [(text.get_text(), text.get_window_extent()) for text in words(figure)]
    assert len(boxes) > 20
    for name, box in boxes:
        assert page.x0 <= box.x0, name
        assert box.x1 <= page.x1, name
        assert page.y0 <= box.y0, name
        assert box.y1 <= page.y1, name
    for (name, box), (other, its) in combinations(boxes, 2):
        # padded() takes off a pixel: boxes of lines of one text touch
        assert not box.padded(-1).overlaps(its.padded(-1)), f"{name!r} and {other!r}"


def test_figure_is_a_picture_of_the_sets_and_the_course(tmp_path: Path) -> None:
    with_sets, without = tmp_path / "with.png", tmp_path / "without.png"
    draw_episode(Shown(pushed(), (*polygons(1), *polygons(2), *polygons(3))), with_sets)
    draw_episode(Shown(pushed()), without)
    pixels = [np.asarray(Image.open(path).convert("RGB")).astype(int) for path in (with_sets, without)]
    assert pixels[0].shape == (900, 1600, 3)

    def count(image: np.ndarray, colour: str) -> int:
        return int((np.abs(image - rgb(colour)).max(axis=-1) < 10).sum())

    plane = [image[130:760, 90:655] for image in pixels]
    for colour in (REGULATOR, TRACKER):  # outlines of some hundred pixels, if the sets are given
        assert count(plane[0], colour) > 500
        assert count(plane[1], colour) == 0
    assert count(plane[0], PUSH) > 100
    strip = pixels[0][138, 760:1570]  # through the strip of the phases, above its words
    scale = time_scale(Playback(pushed()))
    share = sum(scale.share(a, b) for a, b, phase in Playback(pushed()).phases() if phase is Phase.STEPPING)
    assert count(strip[None], TRACKER) == pytest.approx(810 * share, abs=8)


def test_words_tell_the_kind_of_set_the_pushes_and_the_outcome() -> None:
    text = " | ".join(t.get_text() for t in words(episode_figure(Shown(pushed(), (*polygons(1), *polygons(2))))))
    for expected in (
        "regulator set after push 1-2 (slice at measured y)",
        "tracking set after push 1-2 (projection over y)",
        f"push 3\n{0.3 * ROBOT.mass:.2f} N s, 0.30 m/s",
        "pendulum world, controller supervisor",
        "recovered: at rest with no step under way",
    ):
        assert expected in text


def test_a_fall_is_marked_even_if_nothing_can_be_measured(tmp_path: Path) -> None:
    run = scenario(duration=1.0, controller="statue", pushes=[{"start": 0.5, "direction": 0, "impulse": 5.0}])
    fallen = during(run, 0.55, 1.0, 1.0)
    hole = np.where(fallen > 0, np.nan, 0.0)
    trace = still_trace(run, other_contact=fallen, zmp_x=hole, zmp_y=hole, left_force=0.0, right_force=0.0, phase=0.0)
    figure = episode_figure(Shown(trace))
    text = " | ".join(t.get_text() for t in words(figure))
    assert "fell at 0.55 s: something but the soles touched the floor" in text
    draw_episode(Shown(trace), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 20_000


def test_a_trace_that_ended_within_a_push_is_drawn() -> None:
    whole = pushed()
    short = Trace(values=whole.values[:1510], units=whole.units, metadata=whole.metadata)  # 3.0 to 3.1 s is push 1
    empty = SetPolygon(name="tracking", push=1, kind="slice", vertices=np.empty((0, 2)), cut=np.empty(0, dtype=bool))
    text = [t.get_text() for t in words(episode_figure(Shown(short, (empty,))))]
    assert "no set was computed in this plane" in text


def test_a_set_of_nonsense_is_refused() -> None:
    with pytest.raises(ValueError, match="not finite"):
        SetPolygon(
            name="regulator", push=1, kind="slice", vertices=np.array([[0.0, np.nan]]), cut=np.zeros(1, dtype=bool)
        )


def test_support_extent_is_that_of_the_polygon() -> None:
    run = scenario(duration=0.1)
    trace = still_trace(run, left_yaw=0.4, left_x=0.05, right_yaw=-0.2, right_force=during(run, 0.0, 0.05, 20.0))
    playback = Playback(trace)
    for tick in (0, 49):
        polygon = playback.support(tick)
        assert polygon is not None
        for axis in (0, 1):
            expected = [polygon[:, axis].min(), polygon[:, axis].max()]
            # two ways to turn the same corners: rounding only
            assert playback.support_extent(axis)[tick] == pytest.approx(expected, abs=1e-12)
    assert not np.array_equal(playback.support_extent(1)[0], playback.support_extent(1)[49])


def test_phases_cover_the_episode() -> None:
    playback = Playback(pushed())
    phases = playback.phases()
    assert [phase.name for _, _, phase in phases] == ["STANDING", "STEPPING", "STANDING"]
    assert phases[0][0] == playback.time[0]
    assert phases[-1][1] == playback.time[-1]
    assert all(earlier[1] == later[0] for earlier, later in pairwise(phases))


def test_quiet_time_is_narrower_and_its_ticks_have_room() -> None:
    scale = time_scale(Playback(pushed()))
    assert scale.quiet
    for start, end in scale.quiet:
        assert end - start >= 1.5
        assert all(push.end <= start or push.start >= end for push in Playback(pushed()).pushes)
    busy = sum(scale.share(a, b) for a, b in zip(scale.knots[:-1], scale.knots[1:], strict=True))
    assert busy == pytest.approx(1.0)
    (first, last), *_ = scale.quiet
    (push, *_) = Playback(pushed()).pushes
    per_second = scale.share(push.start, push.end) / (push.end - push.start)
    assert per_second == pytest.approx(NARROWER * scale.share(first, last) / (last - first))
    axes = Figure().add_subplot()
    scale.apply(axes)
    ticks = axes.get_xticks().tolist()
    assert all(scale.share(a, b) > 0.04 for a, b in pairwise(ticks))


def test_what_a_user_wrote_is_text_in_a_font_that_has_it(recwarn: pytest.WarningsRecorder) -> None:
    run = scenario().model_copy(update={"description": r"costs $\frac{1}{2}$ 起き上がり 🧑"})
    figure = episode_figure(Shown(still_trace(run)))
    figure.savefig(io.BytesIO())
    assert any(r"$\frac{1}{2}$" in text.get_text() for text in figure.texts)
    assert not [w for w in recwarn.list if "Glyph" in str(w.message) or "mathtext" in str(w.message)]


def test_a_font_that_lacks_the_fewest_is_taken_and_only_what_it_lacks_is_replaced() -> None:
    assert drawable("plain words") == ("plain words", OURS)
    # Of Matplotlib's own fonts some others have the arc, and none the last character there is.
    arc, none = "\u2312", "\U0010fffd"
    words, font = drawable(f"a {arc}{none}")
    assert words == f"a {arc}?"
    assert font != OURS


def test_where_a_set_is_cut_its_edge_is_dotted() -> None:
    figure = episode_figure(Shown(pushed(), polygons(3)))
    axes = next(axes for axes in figure.axes if axes.get_title(loc="left").startswith("Maximal"))
    ends = np.sort(HEXAGON[[2, 3]], axis=0)
    edges = [line for line in axes.get_lines() if np.array_equal(np.sort(line.get_xydata(), axis=0), ends)]
    (edge,) = edges
    assert edge.get_linestyle() == "--"  # what Matplotlib calls every pattern of dashes
    assert edge.get_color() == "#909090"
    assert "cut off where the legs end" in {text.get_text() for text in words(figure)}
    whole = episode_figure(Shown(pushed(), polygons(3)[1:]))
    assert "cut off where the legs end" not in {text.get_text() for text in words(whole)}


def test_lateral_pushes_are_in_their_own_plane() -> None:
    pushes = [{"start": 1.0, "direction": way, "delta_v": 0.1} for way in (90.0,)]
    figure = episode_figure(Shown(still_trace(scenario(duration=4.0, pushes=pushes))))
    labels = [axes.get_xlabel() for axes in figure.axes]
    assert "COG position y in the world [m]" in labels
    assert "COG position x in the world [m]" not in labels


def test_how_far_off_the_controllers_saw_is_drawn_until_a_fall() -> None:
    run = scenario(duration=1.0, controller="statue", pushes=[{"start": 0.5, "direction": 0, "impulse": 5.0}])
    error = during(run, 0.2, 0.4, 0.003)
    fallen = during(run, 0.6, 1.0, 2.0)
    figure = episode_figure(Shown(still_trace(run, dcm_error_x=error, trunk_tilt=fallen)))
    (panel,) = [axes for axes in figure.axes if "DCM seen" in axes.get_ylabel()]
    lines = [line for line in panel.get_lines() if len(line.get_xdata()) > 2]
    assert max(np.max(line.get_ydata()) for line in lines) == pytest.approx(3.0)
    assert max(np.max(line.get_xdata()) for line in lines) < 0.61
    exact = episode_figure(Shown(still_trace(run)))
    assert not any("off [mm" in axes.get_ylabel() for axes in exact.axes)


def test_how_far_off_the_velocity_was_seen_is_drawn_with_landings_and_pushes() -> None:
    run = scenario(duration=1.0, pushes=[{"start": 0.1, "duration": 0.1, "direction": 0, "impulse": 0.1}])
    half = ROBOT.mass * ROBOT.gravity / 2
    # The left foot is up from 0.3 s to 0.5 s, bounces off for 20 ms, and the right one is never up.
    force = half - during(run, 0.3, 0.5, half) - during(run, 0.52, 0.54, half)
    figure = episode_figure(Shown(still_trace(run, seen_cog_vy=during(run, 0.6, 0.7, -0.02), left_force=force)))
    (panel,) = [axes for axes in figure.axes if axes.get_ylabel() == "COG velocity\noff [mm/s]"]
    curves = [line for line in panel.get_lines() if len(line.get_xdata()) > 2]
    assert [(np.min(line.get_ydata()), np.max(line.get_ydata())) for line in curves] == [
        (0.0, 0.0),
        (pytest.approx(-20.0), 0.0),
    ]
    marks = [line.get_xdata()[0] for line in panel.get_lines() if list(line.get_ydata()) == [0, 1]]
    assert marks == pytest.approx([0.5])
    assert any(patch.get_facecolor()[:3] == pytest.approx(to_rgb(PUSH)) for patch in panel.patches)
    words = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert {"seen less true, x", "seen less true, y", "foot comes down"} <= set(words)
