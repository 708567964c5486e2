"""Values that replace those of a description."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.simulation.describe.overrides import override, place_of, read_overrides

DATA: dict[str, Any] = {
    "world": {"seed": 1},
    "axis": [{"name": "x", "pitch": 2.0}, {"name": "y", "motor": {"load": 1.0}}, {"pitch": 9.0}, {"name": 7}],
}


@pytest.mark.parametrize(
    ("key", "place"),
    [
        ("world.seed", ("world", "seed")),
        ("axis.x.pitch", ("axis", 0, "pitch")),
        ("axis.0.pitch", ("axis", 0, "pitch")),
        ("axis.y.motor.load", ("axis", 1, "motor", "load")),
        ("axis.2.pitch", ("axis", 2, "pitch")),
        ("axis.y.new", ("axis", 1, "new")),
    ],
)
def test_a_value_is_put_where_its_key_says(key: str, place: tuple[str | int, ...]) -> None:
    found, expected = deepcopy(DATA), deepcopy(DATA)
    inner: Any = expected
    for part in place[:-1]:
        inner = inner[part]
    inner[place[-1]] = 5.5
    override(found, {key: 5.5})
    assert found == expected


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("seed", "override 'seed': expected TABLE.KEY or TABLE.NAME.KEY, such as 'axis.x.pitch'"),
        ("axis.pitch", "override 'axis.pitch': expected TABLE.KEY or TABLE.NAME.KEY"),
        ("axes.x.pitch", r"override 'axes\.x\.pitch': there is no 'axes' \(did you mean 'axis'\?\)$"),
        ("axis.zzzz.pitch", r"override 'axis\.zzzz\.pitch': there is no 'zzzz'; there are 0, 1, 2, 3, x, y$"),
        ("axis.4.pitch", r"there is no '4'"),
        ("axis.x.pitch.more", r"override 'axis\.x\.pitch\.more': expected TABLE\.KEY"),
        ("axis.x.pitch.more.most", r"override 'axis\.x\.pitch\.more\.most': there is no 'more'$"),
    ],
)
def test_a_key_that_leads_nowhere_is_refused(key: str, message: str) -> None:
    found = deepcopy(DATA)
    with pytest.raises(Misuse, match=message):
        override(found, {key: 1.0})
    assert found == DATA


def test_values_as_they_are_typed() -> None:
    typed = ["x.pitch=4.0", " y.n = 3 ", "a.b=true", "c.d=[1, 2]", "e.f=M1", "g.h=", "i.j=a=b", "k.l='4'"]
    assert read_overrides(typed) == {
        "x.pitch": 4.0,
        "y.n": 3,
        "a.b": True,
        "c.d": [1, 2],
        "e.f": "M1",
        "g.h": "",
        "i.j": "a=b",
        "k.l": "4",
    }


@pytest.mark.parametrize("text", ["x.pitch", "=4", " =4"])
def test_what_is_no_override_as_typed(text: str) -> None:
    with pytest.raises(Misuse, match=r"expected NAME\.KEY=VALUE, such as x\.pitch=4\.0"):
        read_overrides([text])


PIECES: dict[str, Any] = {
    "use": [{"name": "left", "with": {"width": 1}}, {"name": "right"}],
    "axis": [{"name": "x"}, {"name": "y"}],
    "line": [{"name": "x"}],
}


@pytest.mark.parametrize(
    ("key", "place"),
    [
        ("left.width", ("use", 0, "with", "width")),
        ("left.with.width", ("use", 0, "with", "width")),
        ("right.width", ("use", 1, "with", "width")),
        ("right.with.width", ("use", 1, "with", "width")),
        ("use.right.file", ("use", 1, "file")),
    ],
)
def test_parameters_of_pieces(key: str, place: tuple[str | int, ...]) -> None:
    """The table of parameters may be left out, also where the description has none."""
    found = deepcopy(PIECES)
    assert override(found, {key: 7, "y.pitch": 2, "axis.x.pitch": 3}, "use") == {"y.pitch": 2, "axis.x.pitch": 3}
    inner: Any = found
    for part in place:
        inner = inner[part]
    assert inner == 7
    assert found["axis"] == PIECES["axis"]


def test_the_kind_of_table_may_be_left_out() -> None:
    found = deepcopy(PIECES)
    assert override(found, {"y.pitch": 2}) == {}
    assert found["axis"] == [{"name": "x"}, {"name": "y", "pitch": 2}]
    with pytest.raises(Misuse, match=r"^override 'x\.pitch': 'x' is in axis and line: begin with one of these$"):
        override(found, {"x.pitch": 2})


@pytest.mark.parametrize("key", ["axis.x.pitch", "axis.0.pitch", "x.pitch"])
def test_a_place_is_the_same_in_whatever_way_its_tables_are_chosen(key: str) -> None:
    assert place_of(DATA, key) == ("axis", "x", "pitch")


@pytest.mark.parametrize(("key", "place"), [("axis.2.pitch", ("axis", "2", "pitch")), ("no.thing.here", ("no", "thing", "here"))])
def test_a_place_without_a_name_is_as_it_is_written(key: str, place: tuple[str, ...]) -> None:
    assert place_of(DATA, key) == place
