from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from models.errors import InputError
from sim.analysis.baseline import Baseline, BaselineError, of_sweep, read_baseline, write_baseline
from sim.analysis.check import Comparison, NotComparable, compare
from tests.sim.analysis.sweep_tables import Law, adaptive, folder_of, frame, row, threshold_law

LIMITS = {"supervisor": 1.5, "regulator": 0.8, "statue": 0.5}


def sweep(rows: list[dict[str, Any]], **changes: Any) -> Baseline:
    facts = {"suite": "made_up", "seed": 0, "robots": ("utmu2",), "versions": {"mujoco": "3.17.0"}, "commit": "0"}
    return Baseline(rows=frame(rows), **(facts | changes))


def against(law: Law, *, old: Law | None = None, **options: Any) -> Comparison:
    before = adaptive(old or threshold_law(LIMITS), **options)
    return compare(sweep(before), sweep(adaptive(law, **options)))


def test_identical_passes() -> None:
    result = against(threshold_law(LIMITS))
    assert not result.worse
    assert (result.lost, result.gained, result.shifts, result.p) == ([], [], [], 1.0)
    assert result.before == result.after > 0
    assert result.unpaired == 0


def test_weakened_fails_and_names_whom_it_lost() -> None:
    result = against(threshold_law(LIMITS | {"supervisor": 1.1}))
    assert result.worse
    assert result.worse_overall
    assert result.p < 1e-6
    assert result.gained == []
    assert {one["controller"] for one in result.lost} == {"supervisor"}
    assert len(result.dropped) == 8
    assert result.lost[0]["delta_v"] == min(one["delta_v"] for one in result.lost)
    # Its series end sooner: what the baseline recovered beyond is lost as well, though nobody ran it.
    assert result.before - result.after == len(result.lost)
    assert 0 < len(result.unreached) < len(result.lost)


def test_better_passes_with_what_it_gained() -> None:
    result = against(threshold_law(LIMITS | {"supervisor": 1.9}))
    assert not result.worse
    assert result.lost == []
    assert len(result.gained) == result.after - result.before > 0
    assert result.p < 1e-6
    assert all(shift.levels > 0 for shift in result.shifts)


def test_a_fall_or_two_are_chance() -> None:
    rows = adaptive(threshold_law(LIMITS))
    fallen = [dict(one) for one in rows]
    recovered = [one for one in fallen if one["outcome"] == "recovered" and one["replica"] == 0]
    for one in recovered[::12][:5]:
        one["outcome"] = "fell"
    result = compare(sweep(rows), sweep(fallen))
    # The exact p of 5 to 0 is 1/16; 6 to 0 is the first beyond chance, at 1/32.
    assert (len(result.lost), result.worse_overall) == (5, False)
    recovered[6]["outcome"] = "fell"
    assert compare(sweep(rows), sweep(fallen)).worse_overall


def test_threshold_may_drop_by_one_step_in_one_direction_but_not_by_two() -> None:
    def weaker(steps: float) -> Law:
        law = threshold_law(LIMITS)

        def recovers(asked: Any) -> bool:
            hit = asked["controller"] == "supervisor" and asked["direction_deg"] == 90.0 and asked["replica"] < 2
            return law(asked) and not (hit and asked["delta_v"] > 0.45 - 0.05 * steps + 1e-6)

        return recovers

    once, twice = against(weaker(1)), against(weaker(2))
    assert [shift.levels for shift in once.shifts] == [-1]
    assert not once.worse
    assert [shift.levels for shift in twice.dropped] == [-2]
    assert twice.worse
    # A threshold can fall without the pairs as a whole saying so.
    assert not twice.worse_overall


def test_episodes_that_the_baseline_never_had_count_for_nothing() -> None:
    law = threshold_law(LIMITS)
    old = adaptive(law, directions=[0.0, 90.0])
    new = adaptive(law, directions=[0.0, 45.0, 90.0])
    result = compare(sweep(old), sweep(new))
    assert result.pairs == len(old)
    assert result.unpaired == len(new) - len(old)
    assert not result.worse


def test_higher_levels_of_a_grid_are_no_gain() -> None:
    old = adaptive(lambda _: True, controllers=["supervisor"], levels=4)
    new = adaptive(lambda _: True, controllers=["supervisor"], levels=6)
    result = compare(sweep(old), sweep(new))
    assert result.gained == []
    assert result.unpaired == len(new) - len(old)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"suite": "other"}, "suite"), ({"robots": ("other",)}, "robot"), ({"seed": 1}, "seed")],
)
def test_what_differs_is_named(changes: dict[str, Any], words: str) -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0])
    with pytest.raises(NotComparable, match=words):
        compare(sweep(rows), sweep(rows, **changes))


def test_a_sweep_that_lacks_episodes_is_not_comparable() -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"])
    with pytest.raises(NotComparable, match="was not run now"):
        compare(sweep(rows), sweep([one for one in rows if one["direction_deg"] != 90.0]))
    with pytest.raises(NotComparable, match="was not run now"):
        compare(sweep(rows), sweep(rows[:-7] + rows[-6:]))


def test_other_seed_of_an_episode_is_not_comparable() -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0])
    changed = [rows[0] | {"seed": rows[0]["seed"] + 1}, *rows[1:]]
    with pytest.raises(NotComparable, match="another seed"):
        compare(sweep(rows), sweep(changed))


def test_baseline_survives_its_file(tmp_path: Path) -> None:
    law = threshold_law(LIMITS, pockets=[(0.7, 2)])
    folder = folder_of(tmp_path / "sweep", adaptive(law))
    made = of_sweep(folder)
    path = tmp_path / "baselines" / "made_up.json"
    write_baseline(made, path)
    read = read_baseline(path)
    assert len(read.rows) > 0
    result = compare(read, made)
    assert (result.lost, result.gained, result.shifts, result.unpaired) == ([], [], [], 0)
    assert result.pairs == len(made.rows)
    assert (read.suite, read.robots, read.versions, read.commit) == (
        made.suite,
        made.robots,
        made.versions,
        made.commit,
    )
    again = tmp_path / "again.json"
    write_baseline(read, again)
    assert again.read_bytes() == path.read_bytes()


def test_changed_file_of_a_controller_is_told(tmp_path: Path) -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0])
    made = [
        of_sweep(folder_of(tmp_path / source, rows, controllers={"mine.py:A": {"source": source * 64}, "b": {}}))
        for source in "12"
    ]
    assert compare(*made).versions == {"mine.py:A": ("1" * 12, "2" * 12)}
    assert compare(made[0], made[0]).versions == {}


def test_baseline_is_reviewable(tmp_path: Path) -> None:
    rows = adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0])
    path, changed = tmp_path / "a.json", tmp_path / "b.json"
    write_baseline(sweep(rows), path)
    rows[20]["outcome"] = "not_settled"
    write_baseline(sweep(rows), changed)
    before, after = path.read_text().splitlines(), changed.read_text().splitlines()
    differing = [pair for pair in zip(before, after, strict=True) if pair[0] != pair[1]]
    # One outcome is one line, and the count of those recovered another.
    assert len(differing) == 2
    assert max(map(len, before)) < 400


def test_damaged_baselines_are_named(tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    with pytest.raises(BaselineError, match="cannot be read"):
        read_baseline(path)
    write_baseline(sweep(adaptive(threshold_law(LIMITS), controllers=["supervisor"], directions=[0.0])), path)
    content = json.loads(path.read_text())
    path.write_text(path.read_text()[:-300])
    with pytest.raises(BaselineError, match="not a baseline"):
        read_baseline(path)
    for broken, words in (
        ({"kind": "else"}, "not a baseline"),
        ({"thresholds": []}, "its thresholds"),
        ({"episodes": [{"episode": "a"}]}, "lacks 'seed'"),
        ({"episodes": []}, "no episode"),
        ({"parameters": None}, "damaged"),
    ):
        path.write_text(json.dumps(content | broken))
        with pytest.raises(BaselineError, match=words) as caught:
            read_baseline(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_unfinished_or_damaged_sweeps_make_no_baseline(tmp_path: Path) -> None:
    rows = [row(lambda _: True, replica=i) for i in range(4)]
    with pytest.raises(BaselineError, match="not finished"):
        of_sweep(folder_of(tmp_path / "unfinished", rows, finished=0))
    folder = folder_of(tmp_path / "damaged", rows)
    whole = (folder / "results.parquet").read_bytes()
    (folder / "results.parquet").write_bytes(whole[:-100])
    with pytest.raises(InputError, match=r"results\.parquet"):
        of_sweep(folder)
    with pytest.raises(InputError, match="folder of a sweep"):
        of_sweep(tmp_path)
