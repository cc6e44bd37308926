"""An episode live in the browser, in real time, with pushes by hand."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.errors import InputError
from models.robot import Robot, load_robot
from scenarios.catalogue import check_against
from scenarios.push import Push
from scenarios.schema import Scenario
from sim.episode.build import make_controller
from sim.episode.episode import Episode
from sim.episode.plant import make_plant
from sim.episode.recording import robot_facts
from sim.record.trace import Trace
from sim.viewer.moment import Observer
from sim.viewer.pace import Pace
from sim.viewer.panel import Panel, Wish
from sim.viewer.scene import Scene
from sim.viewer.server import HOST, served

if TYPE_CHECKING:
    import viser

FPS = 30.0
"""Pictures a second."""
_READ = 5  # pictures that share the words and the plot beside them
_IDLE = 0.03  # [s] between two looks at the buttons while nothing moves
_RELOAD = 3.0  # [s] that a browser may be away for


@dataclass(frozen=True, kw_only=True)
class Watched:
    """What somebody watched.

    Attributes:
        scenario: that gives the same again, with the pushes by hand, up to where it was stopped.
        trace: what was seen.
    """

    scenario: Scenario
    trace: Trace

    def differs(self, other: Trace) -> float | None:
        """From when on another trace of the scenario is not what was seen [s]; None if it is, bit for bit."""
        # The last row of what was stopped may be half full.
        rows = min(len(self.trace), len(other)) - 1
        seen, made = self.trace.values[:rows], other.values[:rows]
        same = (seen == made) | (np.isnan(seen) & np.isnan(made))
        different = np.flatnonzero(~same.all(axis=1))
        return float(self.trace.time[different[0]]) if different.size else None


def watch(scenario: Scenario, *, port: int, announce: Callable[[str], None]) -> Watched:
    """Run an episode in real time before a browser's eyes, until it is over or somebody ends it.

    It begins when a browser is there. It goes on when the robot rests, until it falls or its time is over; then it
    waits for a word, if a browser is still there. Ctrl-C ends it like the button.

    Args:
        scenario: what happens.
        port: of this machine, for the browser; 0 for any.
        announce: told the address for the browser.

    Raises:
        InputError: if viser is not installed, the port is taken, or the scenario or a controller fails.
        KeyboardInterrupt: if there was nothing to be seen yet.
    """
    robot = load_robot(scenario.robot)
    check_against(scenario, robot)
    with served(port) as server:
        session = Session(server, scenario, robot)
        announce(f"http://{HOST}:{server.get_port()}")
        return session.run()


class Session:
    """Episodes of one scenario, one after another, each begun by "Restart".

    Attributes:
        panel: the controls beside the scene.
        episode: the present one.
    """

    def __init__(self, server: viser.ViserServer, scenario: Scenario, robot: Robot) -> None:
        """Put up scene and panel, and the first episode."""
        self._server, self._scenario, self._robot = server, scenario, robot
        self._facts = robot_facts(robot)
        humanoid, ghost = scenario.world == "humanoid", not scenario.sensing.is_true
        self._scene = Scene(server, robot.path, self._facts, humanoid=humanoid, ghost=ghost)
        self.panel = Panel(server, scenario, robot)
        self._every = max(1, round(1.0 / FPS / scenario.timing.control))
        self._seen_at = time.monotonic()
        self._begin()

    def run(self) -> Watched:
        """Until it is over or ended; see `watch`."""
        try:
            self._wait_for_browser()
            while self._play():
                self._begin()
        except KeyboardInterrupt:
            if not self.episode.ticks:
                raise
        return Watched(scenario=self._as_run(), trace=self.episode.result().trace)

    def _begin(self) -> None:
        scenario, robot = self._scenario, self._robot
        plant = make_plant(scenario, robot)
        self.episode = Episode(scenario, plant, make_controller(scenario, robot), goes_on=True)
        self._observer = Observer(self.episode.channels, self._facts)
        self._pace, self._paused, self._over, self._refused = Pace(), False, False, ""
        self._phase = ""
        self.panel.forget()
        self.panel.pause(False)

    def _wait_for_browser(self) -> None:
        while not self._server.get_clients():
            time.sleep(_IDLE)

    def _play(self) -> bool:
        """Run the present episode until it is ended; True if another is wished for."""
        episode = self.episode
        while True:
            wish = self.panel.wish()
            if wish is Wish.FINISH:
                return False
            if wish is Wish.RESTART:
                return True
            if wish is Wish.PUSH:
                self._push()
            if wish is Wish.PAUSE and not self._over:
                self._paused = not self._paused
                self.panel.pause(self._paused)
                self._pace.rest()
                if self.episode.ticks:
                    self._draw()
                self._tell()
            if self._paused or self._over:
                if self._over and self._left_alone():
                    return False
                time.sleep(_IDLE)
                continue
            self._over = not episode.tick()
            self._observer.see(episode.row, episode.acting, episode.scenario.pushes)
            if self._over or episode.ticks % self._every == 0:
                self._draw()
            self._pace.wait(episode.time)

    def _push(self) -> None:
        if self._over:
            self._refused = "the episode is over; restart it first"
        else:
            try:
                self.episode.add_push(self.panel.push(self.episode.time))
                self._refused = ""
            except InputError as error:
                self._refused = str(error)
        self._tell()

    def _draw(self) -> None:
        moment = self._observer.moment(self.episode.row)
        self._scene.draw(moment, moment.words)
        self._phase = moment.phase_words
        self.panel.add(moment)
        if self._over or self.episode.ticks % (_READ * self._every) == 0:
            self._tell()

    def _tell(self) -> None:
        """Say in the panel what goes on."""
        episode = self.episode
        decisions = getattr(episode.controller, "decisions", ())
        pushes = [push for push in episode.scenario.pushes if push.start <= episode.time]
        speed = "paused" if self._paused else self._pace.words
        if self._over:
            outcome = episode.result().outcome
            speed = f"over: {outcome.result.value.replace('_', ' ')}: {outcome.reason.value}"
        latest = f"; the latest at {pushes[-1].start:.2f} s: {_words(pushes[-1], self._robot.mass)}" if pushes else ""
        self.panel.show(
            ("time", f"{episode.time:.2f} s of {episode.scenario.duration:g} s"),
            ("state", speed),
            ("phase", self._phase),
            ("decision", decisions[-1].reason if decisions else ""),
            ("pushes", f"{len(pushes)}{latest}"),
            ("refused", self._refused),
        )

    def _left_alone(self) -> bool:
        if self._server.get_clients():
            self._seen_at = time.monotonic()
        return time.monotonic() - self._seen_at > _RELOAD

    def _as_run(self) -> Scenario:
        """The scenario, cut where it was stopped, but not within a push."""
        scenario, now = self.episode.scenario, self.episode.time
        if self._over:
            return scenario
        begun = [push for push in scenario.pushes if push.start < now - 1e-9]
        end = max([now, *(push.end + scenario.timing.control for push in begun)])
        pushes = [push.model_dump(exclude_none=True) for push in begun]
        return Scenario.model_validate(scenario.as_dict() | {"duration": round(end, 9), "pushes": pushes})


def _words(push: Push, mass: float) -> str:
    if push.torque is not None:
        return push.torque_words
    size = float(np.linalg.norm(push.impulse_vector(mass)))
    return f"{push.direction_deg:.0f}°, {size:.2f} N s on {push.body}"
