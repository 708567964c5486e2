"""Events as values: what happened, with a typed payload and a cause. The text is a projection of the payload.

They are made from the records of a world (`steptwin.simulation.scheduler.trace`). Events and commands of a subject are numbered
together; a cause is the number of the command or the event that led to it, None where it is not known.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

from steptwin.controller import SECOND, Nanos
from steptwin.messages import with_messages
from steptwin.simulation.scheduler.trace import KINDS as RECORDS
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.world.records import owner_of
from steptwin.subject.payloads import (
    PAYLOADS,
    ButtonPayload,
    CoordinatePayload,
    EdgePayload,
    FaultPayload,
    FramePayload,
    FreePayload,
    InputPayload,
    LoadPayload,
    NotePayload,
    Payload,
    PlanPayload,
    ReportPayload,
    StatementPayload,
    StatusPayload,
    is_shown,
)
from steptwin.tables import complete


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a controller, to a line, or to the world."""

    number: int
    time: Nanos
    controller: str
    payload: Payload
    cause: int | None = None

    @property
    def kind(self) -> str:
        return self.payload.kind

    @property
    def axis(self) -> str | None:
        return self.payload.axis

    @property
    def text(self) -> str:
        return self.payload.text

    @property
    def is_shown(self) -> bool:
        """Whether it is shown to a user. Requests are not: they are as frequent as frames."""
        return is_shown(self.payload)

    @property
    def owner(self) -> str:
        """Who it is about, for people: the element, where one reports it."""
        return _owner(self.controller, self.payload)

    def __str__(self) -> str:
        return line_of(self.time, self.owner, self.text)

    def to_json(self) -> dict[str, object]:
        """As JSON. ``text`` describes it; it adds nothing to the rest."""
        head = {"number": self.number, "time_ns": str(self.time), "controller": self.controller, "kind": self.kind}
        return with_messages({**head, **self.payload.to_json(), "cause": self.cause, "text": self.text})


def line_of(time: Nanos, controller: str, text: str) -> str:
    """Line that says what happened."""
    return f"{time / SECOND:12.6f} s  {controller:<10} {text}".rstrip()


# ---------------------------------------------------------------------- from records


def _of_event(record: TraceRecord) -> Payload:
    text: str = _value(record)
    if record.subject == "note":
        return NotePayload(text)
    if record.subject in ("expectation", "overdue"):
        return ReportPayload(record.subject, text)
    return StatusPayload(record.subject, text, record.facts)


def _of_input(record: TraceRecord) -> Payload:
    if record.value in ("pressed", "released"):
        return ButtonPayload(record.subject, record.value == "pressed")
    return InputPayload(record.subject, record.value)


def _of_frame(record: TraceRecord) -> Payload:
    client, _, direction = record.subject.rpartition("/")
    return FramePayload(client, direction, _value(record))


def _value(record: TraceRecord) -> Any:
    return record.value


_MAKE: Mapping[str, Callable[[TraceRecord], Payload]] = complete(
    "kind of record",
    RECORDS,
    "event",
    {
        "plan": lambda record: PlanPayload(record.subject, _value(record)),
        "load": lambda record: LoadPayload(record.subject, _value(record)),
        "free": lambda record: FreePayload(record.subject, _value(record)),
        "coordinate": lambda record: CoordinatePayload(record.subject, _value(record)),
        "edge": lambda record: EdgePayload(record.subject, _value(record)),
        "frame": _of_frame,
        "statement": lambda record: StatementPayload(record.subject, _value(record)),
        "event": _of_event,
        "input": _of_input,
        "fault": lambda record: FaultPayload(record.subject, _value(record)),
    },
)


def payload_of(record: TraceRecord) -> Payload:
    """The payload of a record."""
    return _MAKE[record.kind](record)


def format_record(record: TraceRecord) -> str:
    """A record in one line."""
    payload = payload_of(record)
    return line_of(record.time, _owner(record.controller, payload), payload.text)


def _owner(controller: str, payload: Payload) -> str:
    return owner_of(controller, payload.facts) if isinstance(payload, StatusPayload) else controller


def read_event(data: Mapping[str, Any]) -> Event:
    """The event in JSON. Raises `TypeError`, `ValueError` or `LookupError` for what `Event.to_json` does not give."""
    payload: Any = PAYLOADS[data["kind"]].read(data)
    return Event(data["number"], int(data["time_ns"]), data["controller"], payload, data["cause"])


_CAUSES = (StatementPayload, ButtonPayload, InputPayload, FaultPayload)
"""Possible causes of what follows at the same moment, besides frames that come in."""


class Numbering:
    """Numbers commands and events, and finds causes: what came last to the same controller at the same moment and can be one.

    ``line_of`` gives the line of a controller: what arrives there can be the cause of what its controllers do.
    """

    __slots__ = ("_command", "_last", "_line_of", "_numbers")

    def __init__(self, line_of: Mapping[str, str]) -> None:
        self._numbers = count(1)
        self._command: tuple[Nanos, int] | None = None
        self._last: dict[str, tuple[Nanos, int]] = {}
        self._line_of = line_of

    def command(self, now: Nanos) -> int:
        """The number of a command that is done now: the cause of what follows at this moment, until `done`."""
        number = next(self._numbers)
        self._command = now, number
        return number

    def look(self) -> int:
        """The number of a command from which nothing follows."""
        return next(self._numbers)

    def done(self) -> None:
        self._command = None

    def moved(self, now: Nanos) -> None:
        """Time was set to another moment: only the command that did it can be a cause there."""
        self._last.clear()
        if self._command is not None:
            self._command = now, self._command[1]

    def event(self, time: Nanos, controller: str, payload: Payload) -> Event:
        number = next(self._numbers)
        event = Event(number, time, controller, payload, self._cause(time, controller))
        if isinstance(payload, _CAUSES) or (isinstance(payload, FramePayload) and payload.direction == "in"):
            self._last[controller] = time, number
        return event

    def _cause(self, time: Nanos, controller: str) -> int | None:
        cause = 0
        for found in (self._last.get(controller), self._last.get(self._line_of.get(controller, "")), self._command):
            if found is not None and found[0] == time and found[1] > cause:
                cause = found[1]
        return cause or None
