"""The panel beside the live scene: what is going on, the slack of the sets over time, and pushing by hand."""

from __future__ import annotations

import html
import math
from collections import deque
from enum import Enum, auto
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from models.robot import Robot
from scenarios.push import COG, Push
from scenarios.schema import Scenario
from sim.record.palette import REGULATOR, TRACKER
from sim.results.push_size import edge_distance
from sim.viewer.moment import Moment
from sim.viewer.scene import legend_html

if TYPE_CHECKING:
    import viser

Array = NDArray[np.float64]

WINDOW = 10.0
"""How much of the slack is shown [s]."""
SMALLEST, LARGEST = 0.1, 3.0
"""Sizes of a push by hand, in units of omega d."""


class Wish(Enum):
    """What the user asked for."""

    PUSH = auto()
    PAUSE = auto()
    RESTART = auto()
    FINISH = auto()


_OTHERS = ("Restart", "Finish")
_WISHES = {"Pause": Wish.PAUSE, "Resume": Wish.PAUSE, "Restart": Wish.RESTART, "Finish": Wish.FINISH}


class Panel:
    """The panel; its buttons are pressed in other threads, and asked for by `wish`.

    Attributes:
        direction, size, body: what a push by hand is set to: [deg], in units of omega d, name.
    """

    def __init__(self, server: viser.ViserServer, scenario: Scenario, robot: Robot) -> None:
        """Put it up.

        Args:
            server: whose panel it is.
            scenario: what is run.
            robot: that is pushed.
        """
        self._robot = robot
        self._wishes: SimpleQueue[Wish] = SimpleQueue()
        self._slacks: deque[tuple[float, float, float]] = deque()
        # Beyond twice the way to the edge of the feet it matters no more by how much.
        self._most = 2000.0 * edge_distance(robot, np.array([1.0, 0.0]))
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        self._status = gui.add_html("")
        self._plot = self._add_plot(gui)
        with gui.add_folder("Push"):
            self.direction = gui.add_slider("direction [deg]", min=-180, max=180, step=5, initial_value=0)
            self.size = gui.add_slider("size [ωd]", min=SMALLEST, max=LARGEST, step=0.05, initial_value=1.0)
            on_cog = scenario.world == "pendulum"
            bodies = (COG,) if on_cog else (*robot.body_names, COG)
            self.body = gui.add_dropdown(
                "body", bodies, initial_value=COG if on_cog else Push.model_fields["body"].default
            )
            self._words = gui.add_html("")
            gui.add_button("Push now", color="violet").on_click(lambda _: self._wishes.put(Wish.PUSH))
        self._others = gui.add_button_group("", ("Pause", *_OTHERS), hint="Finish ends the episode and writes the run.")
        self._others.on_click(lambda event: self._wishes.put(_WISHES[event.target.value]))
        marks = legend_html(ghost=not scenario.sensing.is_true)
        gui.add_html(f'<div style="margin:0 1em;font-size:.75em">{marks}</div>')
        for control in (self.direction, self.size):
            control.on_update(lambda _: self._say_push())
        self._say_push()

    def wish(self) -> Wish | None:
        """What the user asked for next; None if nothing."""
        try:
            return self._wishes.get_nowait()
        except Empty:
            return None

    def push(self, time: float) -> Push:
        """The push that the controls describe, at a time [s]."""
        return Push(start=time, direction=float(self.direction.value), delta_v=self._delta_v(), body=self.body.value)

    def forget(self) -> None:
        """Begin the plot anew."""
        self._slacks.clear()

    def pause(self, paused: bool) -> None:
        """Say on the button what it does next."""
        self._others.options = ("Resume" if paused else "Pause", *_OTHERS)

    def add(self, moment: Moment) -> None:
        """Remember the slack of a moment for the plot."""
        self._slacks.append((moment.time, 1000.0 * moment.slacks[0], 1000.0 * moment.slacks[1]))
        while self._slacks[0][0] < moment.time - WINDOW:
            self._slacks.popleft()

    def show(self, *lines: tuple[str, str]) -> None:
        """Show what goes on, as pairs of a heading and words, and the plot as it is now."""
        rows = "".join(
            f'<tr><td style="padding-right:1em;opacity:.65;vertical-align:top">{html.escape(name)}</td>'
            f"<td>{html.escape(words)}</td></tr>"
            for name, words in lines
            if words
        )
        self._status.content = f'<table style="margin:0 1em;font-size:.875em">{rows}</table>'
        if len(self._slacks) > 1:
            time, standing, stepping = np.array(self._slacks).T
            self._plot.data = (time, self._shown(standing), self._shown(stepping), np.zeros(len(time)))

    def _shown(self, slack: Array) -> Array:
        return np.clip(slack, -self._most, self._most)

    def _delta_v(self) -> float:
        angle = math.radians(self.direction.value)
        distance = edge_distance(self._robot, np.array([math.cos(angle), math.sin(angle)]))
        return float(self.size.value) * self._robot.omega * distance

    def _say_push(self) -> None:
        size = self._delta_v()
        words = f"{size:.2f} m/s, {size * self._robot.mass:.2f} N s in 0.1 s; 0° is forward, 90° left"
        self._words.content = f'<div style="margin:0 1em;font-size:.875em;opacity:.65">{words}</div>'

    def _add_plot(self, gui: viser.GuiApi) -> viser.GuiUplotHandle:
        nothing = np.array([0.0, 1e-3])
        return gui.add_uplot(
            (nothing, np.full(2, np.nan), np.full(2, np.nan), np.zeros(2)),
            (
                {"label": "time [s]"},
                {"label": "standing", "stroke": REGULATOR, "width": 2},
                # Points, for a line would cross the time between two steps.
                {
                    "label": "stepping",
                    "stroke": TRACKER,
                    "width": 0,
                    "points": {"show": True, "size": 4, "fill": TRACKER},
                },
                {"label": "edge", "stroke": "#9aa0a8", "width": 1, "dash": (4.0, 4.0)},
            ),
            title="slack of the sets [mm]",
            scales={"x": {"time": False}, "y": {"range": (-self._most, self._most)}},
            height=170,
        )
