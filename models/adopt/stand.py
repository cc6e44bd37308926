"""The pose that a robot stands in: knees bent, soles flat on the floor, the COG over their middle."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from models.adopt.soles import Sole
from models.adopt.source import Source
from models.arena import SIDES, Side
from models.errors import InputError
from models.reach import straight_leg

Array = NDArray[np.float64]

_BETWEEN = 0.01
"""Between the soles' inner edges, at least [m]."""
_SOLVED = 2e-4
"""Cost of the least-squares problem at which a stand is one."""
_STRAIGHTER = (0.87, 0.89, 0.91, 0.93, 0.95)
"""Shares of a straight leg that are tried when the ranges of the joints allow no stand at the one that is asked for."""
_LONGEST = 5.0
"""Of a straight leg [m]."""
_DIGITS = 7
"""Of what is written: machines differ in the last ones of a solver's."""


@dataclass(frozen=True, kw_only=True)
class Stand:
    """A pose to stand in.

    Attributes:
        qpos: configuration, root first.
        hip: height of the hip over the soles [m].
        straight: the same with a straight leg [m].
        words: how it came about.
    """

    qpos: Array
    hip: float
    straight: float
    words: str


def find_stand(source: Source, soles: dict[Side, Sole], progress: Callable[[float], None] = lambda done: None) -> Stand:
    """Find the stand that the hints ask for.

    Args:
        source: the robot, its legs known.
        soles: its soles.
        progress: called with the share of the search that is done, from 0 to 1.

    Raises:
        InputError: if no pose has flat soles under the COG at that height.
    """
    model, data = source.model, source.data
    hip, ankle = source.legs["left"][0], source.legs["left"][-1]
    down = soles["left"].turn[:, 2] @ model.jnt_pos[ankle] if model.jnt_bodyid[ankle] == soles["left"].body else 0.0
    straight = straight_leg(model, source.legs["left"]) + soles["left"].depth + float(down)
    if straight > _LONGEST:
        raise InputError(
            f"{source.path}: a straight leg is {straight:.3g} m long; it must be at most {_LONGEST:g} m: are its "
            f"lengths in metres?"
        )
    source.go_home()
    home = data.qpos.copy()
    if source.hints.stand == "keyframe":
        ground = float(_place(data, soles["left"])[0][2])
        home[:3] -= [*np.mean([_place(data, soles[side])[0][:2] for side in SIDES], axis=0), ground]
        return Stand(
            qpos=np.round(home, _DIGITS),
            hip=float(data.xanchor[hip][2]) - ground,
            straight=straight,
            words="as at home",
        )
    problem = _Problem(source, soles, home)
    asked = source.hints.bend
    found = None
    # Ranges of the ankle may not allow knees that are bent so much.
    bends = (asked, *(share for share in _STRAIGHTER if share > asked))
    for tried, bend in enumerate(bends):
        # Each search gets half of what is left of the bar: the first one is mostly the last.
        begun = 1.0 - 0.5**tried
        if (found := problem.best(bend * straight, progress, begun, 1.0 - 0.5 ** (tried + 1))) is not None:
            break
    if found is None:
        raise InputError(
            f"{source.path}: no stand found with flat soles under the COG and the hip at {asked:g} of a straight leg's "
            f'height, {straight:.3f} m, or higher; try another bend, or stand = "keyframe", in robot.toml'
        )
    if bend > asked:
        source.notes.append(
            f"the ranges of the joints allow no stand at {asked:g} of a straight leg; it is at {bend:g}"
        )
    problem.put(found)
    height = float(data.xanchor[hip][2] - _place(data, soles["left"])[0][2])
    return Stand(
        qpos=np.round(data.qpos.copy(), _DIGITS), hip=height, straight=straight, words="knees bent by a solver"
    )


def _place(data: mujoco.MjData, sole: Sole) -> tuple[Array, Array]:
    """(3,) place and (3, 3) frame of a sole, world."""
    frame = data.xmat[sole.body].reshape(3, 3)
    return data.xpos[sole.body] + frame @ sole.centre, frame @ sole.turn


class _Problem:
    """Least squares over the root's place and the legs' hinges."""

    def __init__(self, source: Source, soles: dict[Side, Sole], home: Array) -> None:
        self._source, self._soles, model = source, soles, source.model
        self._hinges = [j for side in SIDES for j in source.legs[side]]
        self._address = model.jnt_qposadr[self._hinges]
        limited = model.jnt_limited[self._hinges].astype(bool)[:, None]
        self._low, self._high = np.where(limited, model.jnt_range[self._hinges], (-math.pi, math.pi)).T
        self._upright = home.copy()
        self._upright[3:7] = [1.0, 0.0, 0.0, 0.0]
        self._home = home[self._address]
        self._hip, self._foot = source.legs["left"][0], soles["left"].body
        self._height = 0.0
        source.data.qpos[:] = self._upright
        mujoco.mj_kinematics(model, source.data)
        left, right = (_place(source.data, soles[side])[0] for side in SIDES)
        self._width = max(abs(float(left[1] - right[1])), float(soles["left"].size[1]) + _BETWEEN)

    def put(self, v: Array) -> None:
        """Put the robot into a pose v: the root's place (3,), then the hinges."""
        data = self._source.data
        data.qpos[:] = self._upright
        data.qpos[:3], data.qpos[self._address] = v[:3], v[3:]
        mujoco.mj_kinematics(self._source.model, data)
        mujoco.mj_comPos(self._source.model, data)

    def best(self, height: float, progress: Callable[[float], None], begun: float, over: float) -> Array | None:
        """The pose with the hip at a height [m] and knees ahead, nearest to home; None if none stands."""
        self._height = height
        n = len(self._home) // 2
        found: list[tuple[float, float, int, Array]] = []
        edge = 1e-3 * (self._high - self._low)
        # Which hinge folds the leg, and which way, is not known; the sides may be mirrored.
        turns = [(k, a, b) for k in range(n) for a in (0.7, -0.7) for b in (a, -a)]
        offsets = [np.zeros(2 * n)] + [np.repeat([a, b], n) * np.tile(np.arange(n) == k, 2) for k, a, b in turns]
        for tried, offset in enumerate(offsets):
            progress(begun + (over - begun) * tried / len(offsets))
            start = np.clip(self._home + offset, self._low + edge, self._high - edge)
            bounds = np.r_[-9.0, -9.0, -9.0, self._low], np.r_[9.0, 9.0, 9.0, self._high]
            guess = np.r_[0.0, 0.0, self._height, start]
            answer = least_squares(self._residual, guess, bounds=bounds, max_nfev=60, x_scale=0.1)
            self.put(answer.x)
            if answer.cost <= _SOLVED:
                found.append((-round(self._knee_ahead(), 2), round(answer.cost, 7), len(found), answer.x))
        return min(found, key=lambda each: each[:3])[3] if found else None

    def _knee_ahead(self) -> float:
        """How far the foremost joint of the leg is ahead of the hip [m]."""
        source, data = self._source, self._source.data
        chain = source.chain(self._foot)
        between = chain[1 : chain.index(int(source.model.jnt_bodyid[self._hip]))]
        return max((float(data.xpos[b][0]) for b in between), default=0.0) - float(data.xanchor[self._hip][0])

    def _residual(self, v: Array) -> Array:
        self.put(v)
        data, rest, middles = self._source.data, [], []
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            place, frame = _place(data, self._soles[side])
            middles.append(place)
            rest += [10 * place[2], 10 * (place[1] - sign * self._width / 2), 3 * frame[2, 0], 3 * frame[2, 1]]
            rest.append(3 * frame[1, 0])
        middle = np.mean(middles, axis=0)
        cog = data.subtree_com[self._source.root]
        rest += [10 * middle[0], 10 * (middle[0] - cog[0]), 5 * cog[1], 5 * (middles[0][0] - middles[1][0])]
        rest.append(10 * (data.xanchor[self._hip][2] - self._height))
        return np.concatenate([rest, 2e-3 * (v[3:] - self._home)])
