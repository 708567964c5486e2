"""Requests as annotated dataclasses: what is made of an attribute, and what is no declaration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple

import pytest

from steptwin.errors import Misuse
from steptwin.fields import MISSING, TIME, ControllerName, Meaning, RequestType, fields_of, whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    controller: ControllerName
    depth: Annotated[float, Meaning("How deep.", unit="mm")] = 0.5
    passes: Annotated[int, Meaning("How often.", whole(1, 9))]
    pause: Annotated[int | None, Meaning("Between two of them.", TIME, unit="ns", name="pause_ns")] = None
    tools: Annotated[tuple[str, ...], Meaning("Which.")] = field(default_factory=tuple)


class Mark(NamedTuple):
    text: Annotated[str, Meaning("Which.")]
    loud: Annotated[bool, Meaning("Whether it is heard.")] = False


CUT = RequestType("cut", Cut, "Cut.", fields_of(Cut))


def test_fields_are_what_the_attributes_say() -> None:
    assert [(one.name, one.key, one.default, one.unit) for one in CUT.fields] == [
        ("controller", "controller", MISSING, ""),
        ("depth", "depth", 0.5, "mm"),
        ("passes", "passes", MISSING, ""),
        ("pause_ns", "pause", None, "ns"),
        ("tools", "tools", (), ""),
    ]
    assert CUT.fields[1].schema()["description"] == "How deep. [mm]"
    assert CUT.fields[2].schema() == {"type": "integer", "minimum": 1, "maximum": 9, "description": "How often."}
    assert [(one.name, one.is_required) for one in fields_of(Mark)] == [("text", True), ("loud", False)]


def test_a_request_is_read_with_the_defaults_of_its_class() -> None:
    assert CUT.read({"controller": "a", "passes": 2}) == Cut(controller="a", passes=2)
    assert CUT.read({"controller": "a", "passes": 2, "pause_ns": "70"}) == Cut(controller="a", passes=2, pause=70)
    assert CUT.read({"controller": "a", "passes": 2, "pause_ns": None}) == Cut(controller="a", passes=2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"controller": "a"}, "cut: passes is missing, expected a whole number from 1 to 9: How often."),
        ({"controller": "a", "passes": 10}, "cut: passes: 10: expected a whole number from 1 to 9"),
        ({"controller": "a", "passes": 1, "depth": None}, "cut: depth: None: expected a number from -1e+300 to 1e+300"),
        ({"speed": 1}, "cut: no field 'speed'; fields are controller, depth, passes, pause_ns, tools"),
    ],
)
def test_wrong_fields_are_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(Misuse) as refused:
        CUT.read(given)
    assert str(refused.value) == message


def test_what_is_no_declaration_is_refused() -> None:
    plain: Any = NamedTuple("Plain", [("axis", int)])
    formless: Any = NamedTuple("Formless", [("axis", Annotated[int, Meaning("Which.")])])
    unset: Any = NamedTuple("Unset", [("axis", Annotated[int | None, Meaning("Which.", whole(1, 9))])])
    never: Any = dataclass(
        type("Never", (), {"__annotations__": {"axis": Annotated[int, Meaning("Which.", whole(1, 9))]}, "axis": None})
    )

    with pytest.raises(TypeError, match=r"Plain\.axis has no meaning"):
        fields_of(plain)
    with pytest.raises(TypeError, match=r"Formless\.axis needs a form"):
        fields_of(formless)
    for kind in (unset, never):
        with pytest.raises(TypeError, match="None is the default of what may be None"):
            fields_of(kind)
