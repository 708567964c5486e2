"""Values in JSON by the annotations of their classes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import pytest

from steptwin.jsonvalues import UNWRITTEN, Moment, Sentence, read, shape, to_json
from steptwin.messages import MessageText

GREETING = MessageText("hello b", "test.greeting", {"name": "b"})


class Corner(NamedTuple):
    x: int
    at_ns: Moment


@dataclass(slots=True)
class Shown:
    title: Sentence
    notes: tuple[Sentence, ...] = ()
    corners: list[Corner] = field(default_factory=list)
    inner: Annotated[object, UNWRITTEN] = None


def test_a_named_tuple_is_an_object_and_a_list_stays_one() -> None:
    value = Shown("a", (), [Corner(3, 10**18)])
    data = to_json(value)
    assert data["corners"] == [{"x": 3, "at_ns": "1000000000000000000"}]
    assert read(Shown, {**data, "notes": []}) == value


def test_what_is_not_written_is_not_described() -> None:
    assert "inner" not in to_json(Shown("a", inner=object()))
    assert "inner" not in shape(Shown)["properties"]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("value", "messages"),
    [
        (Shown("a"), None),
        (Shown(GREETING), {"title": {"id": "test.greeting", "values": {"name": "b"}}}),
        (Shown("a", (GREETING, "c")), {"notes": [{"id": "test.greeting", "values": {"name": "b"}}, None]}),
    ],
)
def test_sentences_have_their_messages_beside_them(value: Shown, messages: object) -> None:
    assert to_json(value).get("messages") == messages
    properties = shape(Shown)["properties"]["messages"]["properties"]  # type: ignore[index]
    assert set(properties) == {"title", "notes"}


def test_answers_are_lists_of_values() -> None:
    assert to_json([Corner(1, 2)]) == to_json((Corner(1, 2),)) == [{"x": 1, "at_ns": "2"}]
