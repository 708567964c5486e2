"""Events of a chip that no pin or register shows. Codes are stable."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from steptwin.controller import Fact, Nanos
from steptwin.datasheet import EventDescription, EventSeverity, FactDescription, FactType
from steptwin.m1486.microsteps import UNIT

EVENTS_KEPT = 1000
"""Number of events of a chip that are kept."""


def _fact(name: str, type: FactType = FactType.WHOLE, unit: str = "", *, is_optional: bool = False) -> FactDescription:  # noqa: A002
    return FactDescription(name=name, type=type, unit=unit, is_optional=is_optional)


_AXIS, _LINE, _DIRECTION = _fact("axis"), _fact("line"), _fact("direction")


_INFORMATION, _WARNING, _ALARM = EventSeverity.INFORMATION, EventSeverity.WARNING, EventSeverity.ALARM


def _event(code: str, meaning: str, *facts: FactDescription, severity: EventSeverity = _INFORMATION) -> EventDescription:
    return EventDescription(code=code, meaning=meaning, facts=facts, severity=severity)


EVENTS: Mapping[str, EventDescription] = {
    event.code: event
    for event in (
        _event(
            "moves",
            "R has started a move; one without end has no distance.",
            _AXIS,
            _DIRECTION,
            _fact("distance", unit=UNIT, is_optional=True),
        ),
        _event("seeks", "A seek has started.", _AXIS, _DIRECTION, _LINE),
        _event("stops", "A motion is being stopped by K or LIMIT.", _AXIS, _fact("why", FactType.TEXT)),
        _event("stands", "A motion has ended.", _AXIS, _fact("counter", unit=UNIT), _fact("is_valid", FactType.TRUTH)),
        _event(
            "wait",
            "W waits for a time, O or Z for the level of a line.",
            _fact("duration", unit="ns", is_optional=True),
            _fact("line", is_optional=True),
            _fact("level", is_optional=True),
        ),
        _event("output", "An output has changed.", _LINE, _fact("level")),
        _event("upload", "U sends a byte.", _fact("command"), _fact("byte")),
        _event("kill", "K was received."),
        _event("clear-kill", "C75 was received."),
        _event(
            "wrong-data",
            "A command was dropped (M-11).",
            _fact("why", FactType.TEXT),
            _fact("stops", FactType.TRUTH),
            severity=_ALARM,
        ),
        _event("file", "] has closed a file.", _fact("size", unit="bit")),
        _event("file-refused", "A file was larger than the memory (M-12).", _fact("memory", unit="bit"), severity=_ALARM),
        _event("reset", "Defaults, by \\ or RST."),
        _event("restart", "The program begins again, by RST."),
        _event("power-on", "Off and on again."),
        _event("shutdown", "SD is low.", severity=_WARNING),
        _event("store-failed", "The EEPROM's new content could not be kept.", _fact("why", FactType.TEXT), severity=_ALARM),
    )
}


class M1486Event(NamedTuple):
    """An event. ``code`` is stable, one of `EVENTS`; ``text`` is for users."""

    time: Nanos
    code: str
    text: str
    facts: tuple[Fact, ...] = ()
    """The contents of the text as fields, as defined in `EVENTS`."""
