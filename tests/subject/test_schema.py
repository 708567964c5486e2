"""The schema of events and descriptions against what worlds give, with an independent validator."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest

from steptwin import World
from steptwin.jsonvalues import shape
from steptwin.subject.payloads import KINDS
from steptwin.subject.schema import definitions
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

WORLDS = sorted((Path(__file__).parents[2] / "examples/worlds").glob("*.toml"))


def validator(name: str) -> jsonschema_rs.Draft202012Validator:
    defs: dict[str, Any] = json.loads(json.dumps(definitions()))
    return jsonschema_rs.Draft202012Validator({**defs[name], "$defs": defs})


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_what_worlds_give_is_as_the_schema_says(path: Path) -> None:
    event = validator("(event)")
    with World.load(path) as world:
        subject = WorldSubject(world)
        plain = json.loads(json.dumps(subject.description.to_json()))
        assert list(validator("(description)").iter_errors(plain)) == []
        subscription = subject.subscribe(filter_of(KINDS), 100_000)
        plans = subject.plans(filter_of())
        world.run(for_=20)
        events = [*plans, *subscription.take().events]
    assert {"plan", "edge"} <= {one.kind for one in events}
    for one in events[:5000]:
        assert list(event.iter_errors(json.loads(json.dumps(one.to_json())))) == [], one


def test_a_member_too_many_is_noticed() -> None:
    given = {
        "number": 1,
        "time_ns": "5",
        "controller": "a",
        "kind": "edge",
        "pin": "IN1",
        "level": 1.0,
        "cause": None,
        "text": "x",
    }
    event = validator("(event)")
    assert event.is_valid(given)
    assert not event.is_valid({**given, "colour": "red"})
    assert not event.is_valid({**given, "level": "1"})


def test_what_has_no_shape_is_named() -> None:
    with pytest.raises(TypeError, match="complex"):
        shape(complex)
