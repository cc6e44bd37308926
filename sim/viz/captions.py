"""Words over a video frame: time, controller, slack of the sets, the push, and what the marks mean."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from sim.record.palette import COG, DCM, PHASES, PUSH, SEEN, SUPPORT, ZMP
from sim.viz.glyphs import OURS, drawable
from sim.viz.playback import Playback

Frame = NDArray[np.uint8]

_INK, _PAPER, _DIM = (32, 34, 38), (255, 255, 255, 190), (96, 100, 108)
_SHOWN_AFTER = 0.5  # [s] that the words of a push stay
_PUSHES_TOLD = 4  # at once; more would hide the robot
_FELL = "#c02020"
_LEGEND = (("COG", COG), ("DCM", DCM), ("ZMP", ZMP), ("ZMP command", "ring"), ("support", SUPPORT), ("push", PUSH))
_GHOST = (("COG, DCM as seen", SEEN),)


class Caption:
    """Writes onto frames of one size.

    Args:
        playback: what is shown.
        size: (width, height) of a frame [px].
        explained_once: whether only the first frame has the legend and what is shown, as in a strip of frames.
    """

    def __init__(self, playback: Playback, size: tuple[int, int], *, explained_once: bool = False) -> None:
        self._playback = playback
        self._explained_once, self._frames = explained_once, 0
        self._width, self._height = size
        self._unit = max(9, round(self._height / 36))
        self._font = ImageFont.truetype(str(OURS), self._unit)
        self._bold = ImageFont.truetype(str(OURS.with_name("DejaVuSans-Bold.ttf")), self._unit)
        self._legend = self._draw_legend()
        self._footer = self._draw_footer()
        self._panel = lru_cache(maxsize=512)(self._draw_panel)
        self._clock = lru_cache(maxsize=16)(self._draw_clock)
        self._banner = lru_cache(maxsize=64)(self._draw_banner)
        self._fell_at = playback.outcome.time_of_fall

    def write(self, frame: Frame, tick: int) -> None:
        """Write the words of a tick onto a frame (height, width, 3), in place."""
        gap = self._unit // 2
        trace = self._playback.trace
        clock = self._clock(f"{self._playback.time[tick]:.2f} s")
        _blend(frame, clock, gap, gap)
        panel = self._panel(
            self._phase_words(tick),
            PHASES[self._playback.phase(tick)],
            _inside("regulator set", float(trace["regulator_slack"][tick])),
            _inside("tracking set", float(trace["tracking_slack"][tick])),
            self._sight_words(tick),
        )
        _blend(frame, panel, gap, gap + clock[0].shape[0])
        if not (self._explained_once and self._frames):
            _blend(frame, self._legend, self._width - self._legend[0].shape[1] - gap, gap)
            _blend(frame, self._footer, gap, self._height - self._footer[0].shape[0] - gap)
        self._frames += 1
        below = self._height - self._footer[0].shape[0] - gap
        fell = self._fell_at is not None and self._playback.time[tick] >= self._fell_at
        told = [(f"fell at {self._fell_at:.2f} s", _FELL)] if fell else []
        for words, colour in (*told, *((words, PUSH) for words in self._push_words(tick))):
            banner = self._banner(words, colour)
            below -= banner[0].shape[0] + gap
            _blend(frame, banner, (self._width - banner[0].shape[1]) // 2, below)

    def _phase_words(self, tick: int) -> str:
        name = self._playback.phase(tick).name.lower()
        steps = int(self._playback.trace["steps"][tick])
        return f"{name}: step {steps}" if name == "stepping" else name

    def _sight_words(self, tick: int) -> str:
        """How far off the DCM is that the controllers see; to a tenth of a millimetre."""
        if self._playback.seen is None:
            return ""
        off = float(np.hypot(*self._playback.seen.dcm_error[tick]))
        return f"DCM seen {1000.0 * off:.1f} mm off" if math.isfinite(off) else ""

    def _push_words(self, tick: int) -> list[str]:
        """The pushes that act, or did a moment ago, the latest first."""
        told = self._playback.recent(self._playback.time[tick], _SHOWN_AFTER)[::-1][:_PUSHES_TOLD]
        return [f"push {push.number}: {push.words}" for push in told]

    def _draw_clock(self, words: str) -> Patch:
        image, draw = self._sheet(10 * self._unit, round(1.9 * self._unit))
        draw.text((self._unit // 2, self._unit // 3), words, font=self._bold, fill=_INK)
        return _patch(image)

    def _draw_panel(self, controller: str, colour: str, *slacks: str) -> Patch:
        lines = [words for words in slacks if words]
        longest = max([self._font.getlength(words) for words in lines], default=0.0)
        width = max(round(longest) + self._unit, round(self._bold.getlength(controller)) + 2 * self._unit)
        pitch = round(1.5 * self._unit)
        image, draw = self._sheet(max(width, 10 * self._unit), round(2.0 * self._unit) + pitch * len(lines))
        box = (0, 0, round(self._bold.getlength(controller)) + self._unit, round(1.7 * self._unit))
        draw.rounded_rectangle(box, radius=self._unit // 3, fill=colour)
        draw.text((self._unit // 2, self._unit // 5), controller, font=self._bold, fill=(255, 255, 255))
        for i, words in enumerate(lines):
            draw.text((self._unit // 2, round(1.9 * self._unit) + i * pitch), words, font=self._font, fill=_INK)
        return _patch(image)

    def _draw_banner(self, words: str, colour: str) -> Patch:
        image, draw = self._sheet(round(self._bold.getlength(words)) + self._unit, round(1.8 * self._unit), colour)
        draw.text((self._unit // 2, self._unit // 4), words, font=self._bold, fill=(255, 255, 255))
        return _patch(image)

    def _draw_legend(self) -> Patch:
        entries = _LEGEND if self._playback.seen is None else _LEGEND + _GHOST
        pitch = round(1.4 * self._unit)
        width = 2.5 * self._unit + max(self._font.getlength(words) for words, _ in entries)
        image, draw = self._sheet(round(width), pitch * len(entries) + self._unit // 2)
        radius = 0.38 * self._unit
        for i, (words, colour) in enumerate(entries):
            x, y = self._unit, round((i + 0.65) * pitch)
            dot = (x - radius, y - radius, x + radius, y + radius)
            if colour == "ring":
                draw.ellipse(dot, outline=ZMP, width=2)
            elif words == "support":
                draw.rectangle(dot, fill=SUPPORT + "70", outline=SUPPORT)
            elif colour == SEEN:
                draw.ellipse(dot, fill=SEEN + "66", outline=SEEN, width=2)
            else:
                draw.ellipse(dot, fill=colour)
            draw.text((2 * self._unit, y), words, font=self._font, fill=_INK, anchor="lm")
        return _patch(image)

    def _draw_footer(self) -> Patch:
        scenario = self._playback.scenario
        robot = self._playback.trace.metadata["robot"]["name"]
        words = f"{robot}, {scenario.world}, {scenario.controller.short}: {scenario.description}"
        room = self._width - 2 * self._unit
        words, file = drawable(" ".join(words.split()))
        font = ImageFont.truetype(str(file), self._unit)
        while font.getlength(words) > room and font.size > 0.75 * self._unit:
            font = font.font_variant(size=font.size - 1)
        while font.getlength(words) > room:
            words = words[:-2].rstrip("… ") + "…"
        image, draw = self._sheet(round(font.getlength(words)) + self._unit, round(1.6 * self._unit))
        draw.text((self._unit // 2, round(0.8 * self._unit)), words, font=font, fill=_DIM, anchor="lm")
        return _patch(image)

    @staticmethod
    def _sheet(
        width: int, height: int, paper: str | tuple[int, int, int, int] = _PAPER
    ) -> tuple[Image.Image, ImageDraw.ImageDraw]:
        image = Image.new("RGBA", (width, height), paper)
        return image, ImageDraw.Draw(image)


# Premultiplied colours (h, w, 3) and what is left of the frame under them (h, w, 1), both of 0..255.
Patch = tuple[NDArray[np.uint16], NDArray[np.uint16]]


def _patch(image: Image.Image) -> Patch:
    pixels = np.asarray(image).astype(np.uint16)
    alpha = pixels[..., 3:]
    return pixels[..., :3] * alpha, 255 - alpha


def _blend(frame: Frame, patch: Patch, left: int, top: int) -> None:
    colour, rest = patch
    left, top = max(left, 0), max(top, 0)
    place = frame[top : top + colour.shape[0], left : left + colour.shape[1]]
    height, width = place.shape[:2]
    place[...] = (place * rest[:height, :width] + colour[:height, :width]) >> 8


def _inside(name: str, slack: float) -> str:
    """The signed slack [m] of a set in words."""
    if not math.isfinite(slack):
        return ""
    millimetres = abs(round(1000 * slack))
    return f"{name}: {millimetres} mm {'inside' if slack >= 0 else 'outside'}"
