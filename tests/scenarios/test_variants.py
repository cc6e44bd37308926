"""A suite's variants are scenarios that differ by what they name, or are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.schema import Scenario
from scenarios.suite_catalogue import load_suite
from scenarios.variants import CHANGEABLE, DECIDED, changed
from tests.scenarios.test_suite import PLAIN, SMALL, assert_refused, written

VARIANTS = PLAIN + SMALL + '[variants]\n"full" = {}\n'


def test_ablation_compares_each_part_with_the_full_design() -> None:
    suite = load_suite("ablation").suite
    assert suite.variants is not None
    assert next(iter(suite.variants)) == "full design"
    assert suite.variants["full design"] == {}
    assert len(suite.variants) == 9
    assert suite.episodes == 9 * 8 * 6 * 2
    assert suite.axes.direction == tuple(22.5 + 45 * k for k in range(8))
    assert suite.axes.relative == (1.0, 1.3, 1.6, 1.9, 2.2, 2.5)
    assert "which are this suite's" in (suite.tuned_on or "")
    # The first alone changes nothing: of every other a field differs from the base's.
    base = load_suite("ablation").base
    for name, changes in suite.variants.items():
        same = Scenario.model_validate(changed(base.as_dict(), changes)) == base
        assert same == (name == "full design")


def test_tables_and_dotted_fields_are_the_same(tmp_path: Path) -> None:
    dotted = load_suite(written(tmp_path, VARIANTS + 'a = { "stepping.replan" = false }\n')).suite
    table = load_suite(written(tmp_path, VARIANTS + "a = { stepping.replan = false }\n")).suite
    assert dotted.variants == table.variants == {"full": {}, "a": {"stepping.replan": False}}


def test_gain_is_changed_in_a_field_or_as_a_whole() -> None:
    base = Scenario(description="x").as_dict()
    assert Scenario.model_validate(changed(base, {"gain.k": 2.0})).as_dict()["gain"] == {"kind": "dcm", "k": 2.0}
    lqr = {"kind": "lqr", "q": [1.0, 1.0], "r": 1.0}
    assert Scenario.model_validate(changed(base, {"gain": lqr})).as_dict()["gain"] == lqr
    assert base == Scenario(description="x").as_dict()


def test_every_field_of_a_scenario_is_the_suite_s_or_may_be_changed() -> None:
    assert {*CHANGEABLE, *DECIDED} == set(Scenario.model_fields)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            '"sets off" = { "stepping.rul" = "polygon" }',
            "variants.\"sets off\".stepping.rul: unknown field; did you mean 'rule'?; allowed: rule, step_times",
        ),
        (
            '"sets off" = { "stepping.rule" = "polygn" }',
            "variants.\"sets off\".stepping.rule: 'polygn' is not 'sets' or 'polygon'; did you mean 'polygon'?",
        ),
        ('a = { "stepping.max_steps" = 0 }', 'variants."a".stepping.max_steps: 0 is not allowed; it must be >= 1'),
        ('a = { "steping.rule" = "sets" }', "variants.\"a\".steping: unknown field; did you mean 'stepping'?"),
        ('a = { "controller.kind" = 1 }', "variants.\"a\".controller.kind: unknown option of 'supervisor'"),
        ("a = { seed = 3 }", 'variants."a".seed: 3 is not allowed; the suite decides it, a variant may change robot'),
        ('a = { world = "pendulum" }', "variants.\"a\".world: 'pendulum' is not allowed; the suite decides it"),
        ("a = { pushes = [] }", 'variants."a".pushes: [] is not allowed; the suite decides it'),
        ("a = 3", "variants.a: 3 is not a table"),
        ('" " = {}', "variants: {'full': {}, ' ': {}} has a variant named ' '; a name must be one line"),
        (
            'a = { "stepping.replan" = true, stepping = { replan = false } }',
            "gives stepping.replan of 'a' twice",
        ),
    ],
)
def test_bad_variants_are_refused_in_one_line(line: str, words: str, tmp_path: Path) -> None:
    assert_refused(written(tmp_path, VARIANTS + line + "\n"), words)


@pytest.mark.parametrize(
    ("axis", "change", "words"),
    [
        (
            'controller = ["statue"]',
            'controller = "regulator"',
            "controller: 'regulator' is not allowed; axes.controller",
        ),
        ("latency = [0.0]", '"sensing.latency" = 0.002', "sensing.latency: 0.002 is not allowed; axes.latency varies"),
    ],
)
def test_what_the_axes_vary_is_left_to_them(axis: str, change: str, words: str, tmp_path: Path) -> None:
    text = PLAIN + SMALL + axis + f"\n[variants]\nfull = {{}}\na = {{ {change} }}\n"
    assert_refused(written(tmp_path, text), f'variants."a".{words}')


def test_there_is_a_variant_at_least(tmp_path: Path) -> None:
    words = "variants: {} has 0 entries; it must have at least 1"
    assert_refused(written(tmp_path, PLAIN + SMALL + "[variants]\n"), words)
