"""Every event of a controller, in every test, has the facts that its data sheet says."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import Any

from steptwin.controller import ControllerEvent
from steptwin.datasheet import EventDescription, FactType
from steptwin.m1486 import events as m1486_events
from steptwin.m1486.chip import M1486Chip
from steptwin.mic488 import events as mic488_events
from steptwin.mic488.core import ControllerCore

TYPES: Mapping[FactType, tuple[type, ...]] = {
    FactType.WHOLE: (int,),
    FactType.NUMBER: (int, float),
    FactType.TRUTH: (bool,),
    FactType.TEXT: (str,),
    FactType.WHOLES: (tuple,),
    FactType.NAMED: (dict,),
}


def check_facts(event: ControllerEvent, events: Mapping[str, EventDescription]) -> None:
    known = {fact.name: fact for fact in events[event.code].facts}
    given = dict(event.facts)
    assert len(given) == len(event.facts), event
    needed = {name for name, fact in known.items() if not fact.is_optional}
    assert needed <= given.keys() <= known.keys(), f"{event}: the data sheet says {', '.join(known) or 'none'}"
    for name, value in given.items():
        assert type(value) in TYPES[known[name].type], f"{event}: {name} is to be a {known[name].type.value}"


@contextmanager
def checked_facts() -> Generator[None]:
    chip, core = M1486Chip.event, ControllerCore._record

    def chip_event(self: M1486Chip, code: str, text: str, now: int, *facts: Any) -> None:
        chip(self, code, text, now, *facts)
        check_facts(self.events[-1], m1486_events.EVENTS)

    def core_record(self: ControllerCore, event: Any) -> None:
        check_facts(event, mic488_events.EVENTS)
        core(self, event)

    places: tuple[tuple[Any, str, Callable[..., None], Callable[..., None]], ...] = (
        (M1486Chip, "event", chip_event, chip),
        (ControllerCore, "_record", core_record, core),
    )
    for owner, name, checked, _ in places:
        setattr(owner, name, checked)
    try:
        yield
    finally:
        for owner, name, _, before in places:
            setattr(owner, name, before)
