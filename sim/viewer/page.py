"""A recorded episode as one HTML file that plays it in 3-D and needs nothing else."""

from __future__ import annotations

import html
from collections import defaultdict
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from models.robot import robot_path
from sim.record.trace import Trace
from sim.viewer.moment import Moment, Observer
from sim.viewer.scene import Scene, legend_html
from sim.viewer.server import served
from sim.viz.playback import Playback

Array = NDArray[np.float64]

FPS = 50.0
"""Pictures a second."""
HOLD = 1.5
"""How long the last one stays before it begins anew [s]."""
_SHOWN_AFTER = 0.5  # [s] that the words of a push stay


def replay_page(trace: Trace, *, progress: Callable[[float], None] | None = None) -> str:
    """The page of an episode.

    Args:
        trace: of either world.
        progress: called now and then with the fraction that is done.

    Raises:
        InputError: if viser is not installed, or the robot's file is gone.
    """
    playback = Playback(trace)
    observer = Observer(trace.channels, trace.metadata["robot"])
    frames, acting = _frames(playback), _acting(playback)
    with served() as server:
        scene = Scene(
            server,
            robot_path(playback.scenario.robot),
            trace.metadata["robot"],
            humanoid=playback.is_humanoid,
            ghost=playback.seen is not None,
        )
        recorder = None
        seen = 0
        for number, tick in enumerate(frames):
            for each in range(seen, tick + 1):
                observer.see(trace.values[each], acting.get(each, {}), playback.scenario.pushes)
            seen = tick + 1
            moment = observer.moment(trace.values[tick])
            scene.draw(moment, _words(playback, moment))
            if recorder is None:
                recorder = server.get_scene_serializer()
            recorder.insert_sleep(1.0 / FPS)
            if progress is not None and number % 25 == 0:
                progress(number / len(frames))
        assert recorder is not None, "a trace has a row"
        recorder.insert_sleep(HOLD)
        page = recorder.as_html()
    return _labelled(page, playback)


def _frames(playback: Playback) -> list[int]:
    """Tick of each picture, the last one included."""
    start, end = float(playback.time[0]), float(playback.time[-1])
    times = start + np.arange(int((end - start) * FPS + 1e-6) + 1) / FPS
    return sorted({*(playback.tick(float(time)) for time in times), len(playback.time) - 1})


def _acting(playback: Playback) -> dict[int, dict[int, tuple[Array, Array]]]:
    """Tick -> index of a push -> its force or torque then, and where it acts."""
    found: defaultdict[int, dict[int, tuple[Array, Array]]] = defaultdict(dict)
    for push in playback.pushes:
        values, points = playback.acted(push)
        if push.start <= playback.time[-1]:
            for tick in range(playback.tick(push.start), playback.tick(push.end) + 1):
                if values[tick].any():
                    found[tick][push.number - 1] = values[tick], points[tick]
    return found


def _words(playback: Playback, moment: Moment) -> str:
    words = moment.words
    for push in playback.recent(moment.time, _SHOWN_AFTER):
        words += f"  push {push.number}: {push.words}"
    fell = playback.outcome.time_of_fall
    return words + ("  fell" if fell is not None and moment.time >= fell else "")


def _labelled(page: str, playback: Playback) -> str:
    """The page with what is shown, and what the marks mean."""
    scenario, outcome = playback.scenario, playback.outcome
    robot = playback.trace.metadata["robot"]["name"]
    title = html.escape(f"{robot}, {scenario.world}, {scenario.controller.short}: {scenario.description}")
    verdict = html.escape(f"{outcome.result.value.replace('_', ' ')}: {outcome.reason.value}")
    box = (
        '<div id="okiagari" style="position:fixed;left:.7em;bottom:4em;max-width:60%;padding:.5em .8em;z-index:5;'
        "font:14px/1.5 system-ui,sans-serif;color:#202226;background:rgba(255,255,255,.85);border-radius:4px;"
        f'pointer-events:none"><b>{title}</b><br>{verdict}<br>{legend_html(ghost=playback.seen is not None)}</div>'
    )
    head, body = page.split("</head>", 1)
    return f"{head}<title>{title}</title></head>{body.replace('</body>', f'{box}</body>', 1)}"
