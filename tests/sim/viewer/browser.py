"""A real browser without a screen, spoken to by its debugging protocol; where there is none tests are skipped."""

from __future__ import annotations

import base64
import io
import itertools
import json
import math
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.sim.chromium import CHROMIUM

needs_viser = pytest.mark.skipif(find_spec("viser") is None, reason="no viser: pip install 'okiagari[view]'")
SWITCHES = (
    "headless",
    "no-sandbox",
    "use-gl=angle",
    "use-angle=swiftshader",
    "enable-unsafe-swiftshader",
    "disable-background-networking",
    "disable-component-update",
    "disable-sync",
    "no-first-run",
    "remote-debugging-port=0",
    "window-size=1280,800",
)


class Page:
    """A tab."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._numbers = socket, itertools.count(1)
        self.requests: list[str] = []
        self.complaints: list[str] = []
        for domain in ("Page", "Network", "Log", "Runtime"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Give a command and wait for its answer; what is told meanwhile is kept."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            told = json.loads(self._socket.recv(timeout=60))
            if told.get("id") == number:
                assert "error" not in told, told
                return dict(told["result"])
            if told.get("method") == "Network.requestWillBeSent":
                self.requests.append(told["params"]["request"]["url"])
            if told.get("method") == "Log.entryAdded" and told["params"]["entry"]["level"] == "error":
                self.complaints.append(told["params"]["entry"]["text"])
            if told.get("method") == "Runtime.exceptionThrown":
                self.complaints.append(str(told["params"]["exceptionDetails"]))

    def run(self, script: str) -> Any:
        """The value of an expression of JavaScript."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, script: str, seconds: float = 60.0) -> None:
        """Wait until an expression is true."""
        until = time.monotonic() + seconds
        while not self.run(script):
            assert time.monotonic() < until, f"{script} did not come true; the page says {self.text()!r}"
            time.sleep(0.05)

    def text(self) -> str:
        """All words of the page."""
        return str(self.run("document.body.innerText"))

    def press(self, words: str) -> None:
        """Click on the button that says this."""
        self.run(f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() === {words!r}).click()")

    def wait_for_picture(self, shows: Callable[[np.ndarray], bool], seconds: float = 90.0) -> np.ndarray:
        """Wait until what is to be seen shows something."""
        until = time.monotonic() + seconds
        while not shows(picture := self.picture()):
            assert time.monotonic() < until, f"it is not to be seen; the page says {self.text()!r}"
        return picture

    def picture(self) -> np.ndarray:
        """(height, width, 3) what is to be seen."""
        data = base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


# Hues [deg] from and to, lit and seen through what is half transparent.
HUES = {
    "push": (270.0, 310.0),
    "support": (95.0, 140.0),
    "cog": (210.0, 225.0),
    "left leg": (212.0, 235.0),
    "right leg": (5.0, 30.0),
}


def coloured(picture: np.ndarray, what: str) -> int:
    """How many pixels of a picture (h, w, 3) have the colour of something."""
    low, high = HUES[what]
    pixels = picture[:, :, :3].astype(float).reshape(-1, 3)
    most, least = pixels.max(axis=1), pixels.min(axis=1)
    vivid = most - least > {"support": 80.0, "cog": 110.0, "push": 50.0}.get(what, 35.0)
    red, green, blue = pixels[vivid].T
    hue = np.degrees(np.arctan2(math.sqrt(3.0) * (green - blue), 2.0 * red - green - blue)) % 360.0
    return int(((hue >= low) & (hue <= high)).sum())


@contextmanager
def browser(address: str, profile: Path) -> Iterator[Page]:
    """A tab that has opened an address."""
    from websockets.sync.client import connect

    assert CHROMIUM is not None
    command = [CHROMIUM, *(f"--{switch}" for switch in SWITCHES), f"--user-data-dir={profile}", "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        told = profile / "DevToolsActivePort"
        until = time.monotonic() + 60.0
        while not (told.exists() and told.read_text().count("\n")):
            assert process.poll() is None, "the browser ended"
            assert time.monotonic() < until
            time.sleep(0.05)
        port = told.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
            tabs = json.load(answer)
        where = next(tab["webSocketDebuggerUrl"] for tab in tabs if tab["type"] == "page")
        with connect(where, max_size=None) as socket:
            page = Page(socket)
            page.ask("Page.navigate", url=address)
            yield page
    finally:
        process.terminate()
        process.wait(timeout=30)
