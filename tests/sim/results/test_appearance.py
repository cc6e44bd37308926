"""How controllers are shown: as the sweep says, and else always alike."""

from __future__ import annotations

from sim.results.appearance import looks


def test_listed_come_first_in_their_order_and_as_they_say() -> None:
    listed = {
        "z": {"label": "Z", "colour": "#123456", "marker": "*", "source": "ab"},
        "gone": {"label": "gone", "colour": "#000000", "marker": "o", "source": None},
        "a": {"label": "A", "colour": "#0072b2", "marker": "s", "source": None},
    }
    found = looks(["m", "a", "z", "a", "b"], {"controllers": listed})
    assert list(found) == ["z", "a", "b", "m"]
    assert found["z"].as_dict() == listed["z"]
    assert [found[name].label for name in ("b", "m")] == ["b", "m"]


def test_others_get_the_colour_and_the_marker_of_their_place() -> None:
    listed = {"x": {"label": "x", "colour": "#0072b2", "marker": "o", "source": None}}
    found = looks(["x", "b", "c"], {"controllers": listed})
    assert len({look.colour for look in found.values()}) == 3
    assert len({look.marker for look in found.values()}) == 3
    assert looks(["c", "x", "b", "b"], {"controllers": listed}) == found
    assert len(looks([f"c{i:02}" for i in range(30)], {})) == 30


def test_two_of_one_label_are_called_by_their_names_too() -> None:
    listed = {name: {"label": "CapturePoint"} for name in ("a.py:CapturePoint", "b.py:CapturePoint")}
    labels = [look.label for look in looks(listed, {"controllers": listed}).values()]
    assert labels == ["CapturePoint (a.py:CapturePoint)", "CapturePoint (b.py:CapturePoint)"]
