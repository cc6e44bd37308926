"""A suite file says what is run, or is refused in one line that names file, field and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest

from models.errors import InputError
from scenarios.suite_catalogue import load_suite, shipped

PLAIN = 'description = "x"\n'
SMALL = "[axes]\ndirection = [0]\ndelta_v = [0.1]\n"
TRAIN = "[train]\ncount = 3\ninterval = 1.0\nfirst = 0.5\ngrowth = 0.1 # of omega d\n"
FIRST = "[first]\nsize = 1.2\ngap = 0.25\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


def assert_refused(path: Path, words: str) -> None:
    """The suite is refused in one line that begins with its file and holds these words."""
    with pytest.raises(InputError) as caught:
        load_suite(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message


def test_suites_that_ship() -> None:
    tuned_by = {"ablation", "calibration"}
    reported = {"trunk_push", "trunk_push_24", "cog_push", "smoke", "disturbed", "truth", "endurance", "second_push"}
    reported |= {"robots", "senses", "disturbed_senses"}
    assert set(shipped()) == reported | tuned_by
    for name in reported:
        loaded = load_suite(name)
        assert loaded.name == name
        # Whoever tunes, tunes on others: the seed is below 1000, the directions whole eighths of a turn, or between.
        assert "held out" in (loaded.suite.tuned_on or "")
        assert loaded.suite.seed < 1000
        assert all(direction % 15 == 0 for direction in loaded.suite.axes.direction or ())


def test_trunk_push_is_the_protocol() -> None:
    suite = load_suite("trunk_push").suite
    axes = suite.axes
    assert axes.body == ("trunk",)
    assert axes.duration == (0.1,)
    assert axes.direction == (0, 45, 90, 135, 180, 225, 270, 315)
    assert axes.delta_v is not None
    assert axes.delta_v[:4] == (0.05, 0.1, 0.15, 0.2)
    assert axes.height is None
    assert (suite.replicas, suite.replica.shift, suite.after) == (5, 0.1, 5.0)
    assert suite.adaptive is not None
    assert suite.adaptive.stop_after == 10


def test_truth_is_1000_pushes_on_both_worlds() -> None:
    suite = load_suite("truth").suite
    assert suite.random is not None
    assert suite.random.count == 1000
    assert set(suite.random.given()) == {"direction", "delta_v", "duration", "height", "start"}
    assert suite.axes.world == ("humanoid", "pendulum")


def test_truth_reaches_beyond_the_envelope() -> None:
    suite = load_suite("truth").suite
    assert suite.random is not None
    assert suite.random.delta_v == (0.02, 1.2)


def test_endurance_is_the_protocol() -> None:
    suite = load_suite("endurance").suite
    assert suite.train is not None
    assert (suite.train.count, suite.train.interval, suite.train.direction) == (40, 3.0, (0.0, 360.0))
    # Push n, counted from 1, is of 0.5 + 0.1 (n - 1) omega d.
    assert [suite.train.size(n - 1) for n in (1, 2, 40)] == pytest.approx([0.5, 0.6, 4.4])
    assert (suite.axes.body, suite.axes.duration) == (("trunk",), (0.1,))
    assert suite.axes.controller == ("supervisor", "regulator", "statue")
    assert suite.replicas >= 15


def test_second_push_is_trunk_push_after_another() -> None:
    suite, alone = load_suite("second_push").suite, load_suite("trunk_push").suite
    assert suite.first is not None
    assert (suite.first.size, suite.first.gap, suite.first.duration) == (1.2, 0.25, 0.1)
    start = suite.axes.start
    assert start is not None
    assert start[0] - suite.first.gap - suite.first.duration == pytest.approx(1.0)
    assert suite.axes == alone.axes.model_copy(update={"start": start})
    assert (suite.replicas, suite.replica, suite.adaptive) == (alone.replicas, alone.replica, alone.adaptive)


def test_train_gives_direction_and_size(tmp_path: Path) -> None:
    assert load_suite(written(tmp_path, PLAIN + TRAIN)).suite.episodes == 1


def test_range_counts_in_decimals(tmp_path: Path) -> None:
    text = PLAIN + "[axes]\ndirection = [0]\ndelta_v = { first = 0.05, last = 0.3, step = 0.05 }\n"
    assert load_suite(written(tmp_path, text)).suite.axes.delta_v == (0.05, 0.1, 0.15, 0.2, 0.25, 0.3)


def test_number_of_episodes(tmp_path: Path) -> None:
    text = PLAIN + "replicas = 3\n[axes]\ndirection = [0, 90]\nimpulse = [1, 2, 3, 4]\n"
    assert load_suite(written(tmp_path, text)).suite.episodes == 24


def test_base_s_push_gives_defaults(tmp_path: Path) -> None:
    text = PLAIN + 'scenario = "push_left"\n[axes]\ncontroller = ["statue"]\n'
    loaded = load_suite(written(tmp_path, text))
    assert loaded.push["direction"] == 90
    assert loaded.base.pushes == ()


def test_base_may_be_written_in_the_suite_or_lie_beside_it(tmp_path: Path) -> None:
    (tmp_path / "base.toml").write_text('description = "b"\nseed = 5\n')
    beside = load_suite(written(tmp_path, PLAIN + 'scenario = "base.toml"\n' + SMALL))
    assert beside.base.seed == 5
    within = load_suite(written(tmp_path, PLAIN + SMALL + "[scenario]\ncontroller = 'statue'\n"))
    assert (within.base.controller.name, within.base.description) == ("statue", "x")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            PLAIN + "[axes]\ndelta_w = [1]\n",
            "axes.delta_w: unknown field; did you mean 'delta_v'?; allowed: robot, world",
        ),
        (PLAIN + "[axs]\n", "axs: unknown field; did you mean 'axes'?; allowed: description, tuned_on, scenario, axes"),
        (
            PLAIN + "[axes]\ndirection = []\ndelta_v = [0.1]\n",
            "axes.direction: [] has 0 entries; it must have at least 1",
        ),
        (PLAIN + "[axes]\ndirection = [0, 0]\ndelta_v = [0.1]\n", "axes.direction: [0, 0] must not hold 0.0 twice"),
        (PLAIN + '[axes]\ncontroller = ["supervisr"]\n', "did you mean 'supervisor'?"),
        (PLAIN + "[axes]\ndirection = [0]\n", "axes.delta_v: is missing"),
        (PLAIN + "[axes]\ndelta_v = [0.1]\n", "axes.direction: is missing"),
        (PLAIN + "[axes]\ndelta_v = [nan]\n", "axes.delta_v[0]: nan is not a finite number"),
        (PLAIN + "[axes]\ndelta_v = [-0.1]\n", "axes.delta_v[0]: -0.1 is not allowed; it must be >= 1e-06"),
        (PLAIN + "[axes]\ndelta_v = 0.1\n", "axes.delta_v: 0.1 is not a list"),
        (PLAIN + "[axes]\nimpulse = [1]\ndelta_v = [0.1]\n", "axes.impulse: give only one"),
        (
            PLAIN + SMALL + "relative = [1]\n",
            "axes.relative: give only one of delta_v [m/s], impulse [N s] and relative",
        ),
        (PLAIN + "[axes]\nrelative = [0]\n", "axes.relative[0]: 0 is not allowed; it must be >= 0.001"),
        (
            PLAIN
            + "[axes]\nrelative = [1]\n[scenario]\npushes = [{ start = 1.0, vector = [0, 0, 1], delta_v = 1.0 }]\n",
            "axes.relative: needs an axis direction",
        ),
        (PLAIN + TRAIN + "[axes]\nrelative = [1]\n", "axes.relative: the train draws its own"),
        (
            PLAIN + "[axes]\ndelta_v = { first = 1, last = 0, step = 0.1 }\n",
            "must have a positive step and last >= first",
        ),
        (PLAIN + "[axes]\ndelta_v = { first = 0, last = 1 }\n", "{first, last, step}"),
        (PLAIN + "[axes]\ndelta_v = { first = 0, last = 1e12, step = 1e-9 }\n", "at most 1000000 are allowed"),
        (PLAIN + "replicas = 0\n" + SMALL, "replicas: 0 is not allowed; it must be >= 1"),
        (PLAIN + 'scenario = "quite"\n' + SMALL, "did you mean 'quiet'?"),
        (PLAIN + 'scenario = "three_pushes"\n' + SMALL, "scenario: has 3 pushes; a suite's base has at most one"),
        (PLAIN + SMALL + "[scenario]\nsede = 1\n", "scenario.sede: unknown field; did you mean 'seed'?"),
        (PLAIN + SMALL + "[random]\ncount = 3\ndirection = [0, 1]\n", "random.direction: is an axis already"),
        (PLAIN + "[random]\ncount = 3\ndelta_v = [0.3, 0.1]\n", "random.delta_v: [0.3, 0.1] must be [lowest, highest]"),
        (
            PLAIN + 'scenario = "push_left"\nadaptive = { stop_after = 1 }\n',
            "adaptive: needs an axis delta_v, impulse or relative",
        ),
        (
            PLAIN + TRAIN.replace("growth", "grwth"),
            "train.grwth: unknown field; did you mean 'growth'?; allowed: count",
        ),
        (PLAIN + TRAIN.replace("interval = 1.0", ""), "train.interval: is missing; it must be given"),
        (PLAIN + TRAIN.replace("count = 3", "count = 1"), "train.count: 1 is not allowed; it must be >= 2"),
        (PLAIN + TRAIN.replace("first = 0.5", "first = 0"), "train.first: 0 is not allowed; it must be >= 0.001"),
        (PLAIN + TRAIN.replace("0.1 #", "-0.1 #"), "train.growth: -0.1 is not allowed; it must be >= 0"),
        (PLAIN + TRAIN + "direction = [9, 1]\n", "train.direction: [9, 1] must be [lowest, highest]"),
        (PLAIN + TRAIN + "[axes]\ndirection = [0]\n", "axes.direction: the train draws its own"),
        (PLAIN + TRAIN + "[axes]\nimpulse = [1]\n", "axes.impulse: the train draws its own"),
        (PLAIN + TRAIN + "[random]\ncount = 2\n", "random: does not go with a train"),
        (PLAIN + TRAIN + FIRST, "first: does not go with a train"),
        (PLAIN + TRAIN + "[adaptive]\nstop_after = 1\n", "adaptive: does not go with a train"),
        (PLAIN + TRAIN + "[replica]\ndirection = 5.0\n", "replica.direction: the train's directions are drawn"),
        (
            PLAIN + TRAIN + "[axes]\nduration = [0.1, 1.0]\n",
            "train.interval: 1.0 s must be longer than a push, 1 s, and a control period, 0.002 s",
        ),
        (PLAIN + SMALL + FIRST.replace("gap", "gaps"), "first.gaps: unknown field; did you mean 'gap'?"),
        (PLAIN + SMALL + FIRST.replace("1.2", "0"), "first.size: 0 is not allowed; it must be >= 0.001"),
        (PLAIN + SMALL + FIRST.replace("0.25", "0.002"), "first.gap: 0.002 s must be longer than the control period"),
        (
            PLAIN + SMALL + "start = [2.0, 0.3]\n" + FIRST,
            "axes.start: 0.3 s is too early; the first push begins 0.35 s before it",
        ),
        (
            PLAIN + SMALL + "start = [0.4]\n[replica]\ntime = 0.1\n" + FIRST,
            "axes.start: 0.3 s is too early; the first push begins 0.35 s before it",
        ),
        # What the base says is not passed over in silence.
        (PLAIN + 'scenario = "push_left"\n' + TRAIN, "scenario: has a push, and the train draws its own"),
        (PLAIN + 'scenario = "push_left"\n' + SMALL + "start = [1.0]\n", "a push of which the axes replace everything"),
        (
            PLAIN + SMALL + "[scenario]\npushes = [{ start = 1.0, vector = [0, 1, 1], delta_v = 1.0 }]\n",
            "axes.direction: the base scenario's push goes along a vector, [0.0, 1.0, 1.0], which none of them is",
        ),
        (
            PLAIN + SMALL + "[scenario]\npushes = [{ start = 1.0, torque = [0, 2, 0] }]\n",
            "scenario: pushes with a torque 2 N m about y on trunk; the pushes of a suite are forces",
        ),
        (PLAIN + SMALL + "[scenario]\nseed = 6\n", "scenario.seed: 6 is not allowed; the suite decides it"),
        (PLAIN + SMALL + "[scenario]\nduration = 9.0\n", "scenario.duration: 9.0 is not allowed; the suite decides it"),
        # Numbers at the rim.
        (PLAIN + "[axes]\ndelta_v = [1e9]\n", "axes.delta_v[0]: 1000000000.0 is not allowed; it must be <= 20"),
        (PLAIN + "[axes]\nstart = [1e308]\n", "axes.start[0]: 1e+308 is not allowed; it must be <= 3600"),
        (PLAIN + "[axes]\nduration = [1e-9]\n", "axes.duration[0]: 1e-09 is not allowed; it must be >= 0.0001"),
        (PLAIN + "[axes]\nmass_scale = [1e-300]\n", "axes.mass_scale[0]: 1e-300 is not allowed; it must be >= 0.1"),
        (PLAIN + TRAIN.replace("count = 3", "count = 1000000000"), "train.count: 1000000000 is not allowed"),
        (PLAIN + TRAIN.replace("1.0", "1000").replace("3", "9"), "axes.start: the last push begins as late as 8001 s"),
        (
            PLAIN + "replicas = 9\n" + SMALL + "[replica]\nshift = 1000\n",
            "axes.start: the last push begins as late as 8001 s, so that its episode lasts 8006.1 s; at most 3600 s",
        ),
        ("x = " + "[" * 2000 + "]" * 2000, "more than 20 deep"),
        (PLAIN + 'tuned_on = "a\\nb"\n' + SMALL, "tuned_on: 'a\\nb' is not one line of text"),
        ("description = ", "not a TOML file"),
        ("", "description: is missing"),
    ],
)
def test_bad_suites_are_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    assert_refused(written(tmp_path, text), words)


@pytest.mark.parametrize(
    ("name", "words"), [("trunk_pus", "did you mean 'trunk_push'?"), ("gone.toml", "suite: no file 'gone.toml'")]
)
def test_unknown_suites_are_refused(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words.replace("?", r"\?")):
        load_suite(name)
