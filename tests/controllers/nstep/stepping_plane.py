"""Steppers in the plane of the DCM, run tick by tick with the pendulum: what the N-step sets are held to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from controllers.geometry.linear_program import LinearProgram
from controllers.geometry.support_polygon import Foot, SupportPolygon, support_polygon
from controllers.nstep.box import flat
from controllers.nstep.foothold import choose_foothold
from controllers.nstep.step_kernel import corners_of
from controllers.nstep.step_limits import StepLimits
from controllers.nstep.step_sets import StepSets
from controllers.pendulum import Pendulum
from models.robot import Side, other

PENDULUM = Pendulum(6.14, 0.005)
SOLE = np.array([[0.06, 0.03], [-0.04, 0.03], [-0.04, -0.03], [0.06, -0.03]])
# A sole without edges along the axes, and one with rounded corners.
DIAMOND = np.array([[0.06, 0.0], [0.0, 0.04], [-0.05, 0.0], [0.0, -0.04]])
OCTAGON = np.array(
    [
        [0.06, 0.01],
        [0.04, 0.03],
        [-0.04, 0.03],
        [-0.06, 0.01],
        [-0.06, -0.01],
        [-0.04, -0.03],
        [0.04, -0.03],
        [0.06, -0.01],
    ]
)
LIMITS = StepLimits(max_stride=0.2, min_width=0.07, max_width=0.22, stance_width=0.084, swing_speed=4.0)
# Half of what a foot covers in 0.15 s at 1.6 m/s is less than the stride.
SLOW = replace(LIMITS, swing_speed=1.6)
# Half of what a foot covers from rest to rest in 0.15 s is less than the stride here, too.
HEAVY = replace(LIMITS, swing_acceleration=50.0)

Errors = Callable[[], np.ndarray]


def both_feet(sets: StepSets, foothold: np.ndarray) -> SupportPolygon:
    """Support of the stance foot at the origin and the foot that landed."""
    return support_polygon([Foot(position=at, yaw=0.0, sole=sets.sole.vertices) for at in (np.zeros(2), foothold)])


def recovers(
    sets: StepSets,
    steps: int,
    stance: Side,
    ticks: int,
    swing: np.ndarray,
    dcm: np.ndarray,
    step_time: float,
    margin: float = 0.01,
    errors: Errors | None = None,
) -> float:
    """Least distance [m] of the ZMP to the edge of its support until long after the last of `steps` landings.

    Footholds and ZMP are chosen anew every tick, and the foot in the air moves straight to where it shall land.
    """
    x = np.zeros(4)
    x[1::2] = PENDULUM.omega * dcm
    place, worst = np.zeros(2), np.inf
    for left in range(steps, 0, -1):
        toward = np.array([0.0, LIMITS.stance_width if stance == "right" else -LIMITS.stance_width])
        for k in range(ticks, 0, -1):
            choice = choose_foothold(
                sets,
                PENDULUM.dcm(x) - place,
                stance,
                k * PENDULUM.dt,
                swing,
                step_time,
                left,
                toward=toward,
                margin=margin,
            )
            assert sets.tables.usable.slack(choice.zmp) >= -1e-12
            zmp = choice.zmp + (0.0 if errors is None else errors())
            worst = min(worst, sets.sole.slack(zmp))
            swing = swing + (choice.position - swing) / k
            x = PENDULUM.step(x, place + zmp)
        place, swing, stance, ticks = place + swing, -swing, other(stance), round(step_time / PENDULUM.dt)
    return min(worst, stands(sets, x, place, swing, errors))


def stands(sets: StepSets, x: np.ndarray, place: np.ndarray, swing: np.ndarray, errors: Errors | None = None) -> float:
    """Least distance [m] of the regulator's ZMP to the edge of the feet at `place` and `swing` from there."""
    support, centre, worst = both_feet(sets, swing).moved(place), place + 0.5 * swing, np.inf
    for _ in range(200):
        zmp = centre + sets.gain_k * (PENDULUM.dcm(x) - centre) + (0.0 if errors is None else errors())
        worst = min(worst, support.slack(zmp))
        x = PENDULUM.step(x, zmp)
    return worst


def rim(sets: StepSets, question: tuple, rng: np.random.Generator, inside: float) -> np.ndarray:
    """A DCM of an N-step set on a random ray from its middle, `inside` [m] before its boundary (beyond if negative).

    Args:
        sets: the sets.
        question: steps, stance, time left, swing foot and step time.
        rng: draws it, one in three times towards a corner.
        inside: slack of the state.
    """
    steps, stance, time_left, swing, step_time = question
    polygon = sets.polygon(steps, stance, time_left, swing, step_time=step_time)
    corners = polygon.vertices()
    middle = corners.mean(axis=0)
    share = rng.dirichlet(np.full(len(corners), rng.choice([0.02, 0.3, 1.0])))
    way = share @ corners - middle
    moved = polygon.S @ way
    # With all rows moved out by as much, the ray ends where the slack is that.
    room = polygon.a - polygon.S @ middle - inside
    return np.asarray(middle + way * (room[moved > 0.0] / moved[moved > 0.0]).min())


def draw(sets: StepSets, rng: np.random.Generator) -> tuple[int, Side, int, np.ndarray, float]:
    """Steps, stance, ticks left, swing foot and step time."""
    stance: Side = "left" if rng.uniform() < 0.5 else "right"
    step_time = float(rng.choice(sets.step_times))
    swing = np.array([rng.uniform(-0.15, 0.15), rng.uniform(0.03, 0.22) * (1.0 if stance == "right" else -1.0)])
    ticks = int(rng.integers(0, round(step_time / PENDULUM.dt) + 1))
    return int(rng.integers(1, sets.max_steps + 1)), stance, ticks, swing, step_time


def best_of_sequences(
    sets: StepSets,
    question: tuple[int, Side, int, np.ndarray, float],
    dcm: np.ndarray,
    rng: np.random.Generator,
    count: int,
    normal: np.ndarray,
) -> float:
    """Best slack [m] in the regulator's set at the last landing, over sequences of ZMPs and footholds within reach.

    The ZMP changes every tick. Of the sequences a third are random, a third take corners only, and the rest the
    extremes against `normal`, all but a few times.
    """
    steps, stance, ticks, swing, step_time = question
    xi = np.broadcast_to(dcm, (count, 2)).copy()
    growth = np.exp(PENDULUM.omega * PENDULUM.dt)
    sole = sets.sole.vertices
    kind = np.arange(count) % 3
    # Above the last sample, below it: how often the extremes are left for a random choice.
    stray = np.where(kind == 2, rng.choice([0.0, 0.05], count), 1.0)

    def pick(corners: np.ndarray) -> np.ndarray:
        shares = rng.dirichlet(np.ones(len(corners)), count)
        random = np.where((kind == 0)[:, None], shares @ corners, corners[rng.integers(len(corners), size=count)])
        extreme = corners[np.argmax(corners @ normal)]
        return np.where((rng.uniform(size=count) < stray)[:, None], random, extreme)

    for left in range(steps, 0, -1):
        for _ in range(ticks):
            xi = growth * xi + (1.0 - growth) * pick(sole)
        last, more = sets.boxes(stance, ticks, swing, step_time)
        foothold = pick(corners_of(flat(last if left == 1 else more)))
        if left == 1:
            break
        xi = xi - foothold
        # Each sequence has a foot of its own, and every later foothold is within its reach.
        swing, stance, ticks = None, other(stance), round(step_time / PENDULUM.dt)
    best = -np.inf
    for point, at in zip(xi, foothold, strict=True):
        u = 0.5 * at + sets.gain_k * (point - 0.5 * at)
        best = max(best, both_feet(sets, at).slack(u) / sets.gain_k)
    return best


def best_by_program(
    sets: StepSets, question: tuple[int, Side, int, np.ndarray | None, float], dcm: np.ndarray
) -> float:
    """Largest slack [m] that any ZMPs z_i and footholds p_i, all of them unknowns of one linear program, leave at last.

    The last foothold enters as y = lam p, with the slack to the sole over k there.
    """
    steps, stance, ticks, swing, step_time = question
    # Two unknowns for each ZMP, and the weights of eight corners for each foothold.
    size = 10 * steps + 1
    rows, limits = [], []
    # The DCM seen from the stance foot is at + by unknowns.
    at, by = np.asarray(dcm, dtype=float), np.zeros((2, size))
    for i in range(steps):
        zmp, foot = slice(10 * i, 10 * i + 2), slice(10 * i + 2, 10 * i + 10)
        own = np.zeros((len(sets.sole.v) + 10, size))
        own[: len(sets.sole.v), zmp] = sets.sole.M
        own[-10:-2, foot], own[-2, foot], own[-1, foot] = -np.eye(8), 1.0, -1.0
        rows.append(own)
        limits.append(np.concatenate((sets.sole.v, np.zeros(8), [1.0, -1.0])))
        growth = np.exp(sets.pendulum.omega * sets.pendulum.dt * ticks)
        at, by = growth * at, growth * by
        by[:, zmp] -= (growth - 1.0) * np.eye(2)
        last, more = sets.boxes(stance, ticks, swing, step_time)
        corners = corners_of(flat(last if steps == 1 else more))
        shares = 0.5 + np.array([-0.5, 0.5]) / sets.gain_k if i == steps - 1 else (1.0, 1.0)
        by[:, foot] -= np.vstack([share * corners for share in shares]).T
        swing, stance, ticks = None, other(stance), round(step_time / sets.pendulum.dt)
    worst = sets.sole.M @ by
    worst[:, -1] = 1.0
    rows.append(worst)
    limits.append(sets.sole.v / sets.gain_k - sets.sole.M @ at)
    return float(LinearProgram(np.vstack(rows), np.concatenate(limits)).maximise(np.eye(size)[-1])[-1])
