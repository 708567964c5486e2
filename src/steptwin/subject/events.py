"""Events as values: what happened, with a typed payload and a cause. The text is a projection of the payload.

They are made from the records of a world (`steptwin.world.trace`). Events and commands of a subject are numbered together; a
cause is the number of the command or the event that led to it, None where it is not known.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias, get_args

from steptwin.machine import SECOND, Fact, Nanos
from steptwin.motion.divisions import Plan as MotionPlan
from steptwin.motion.divisions import profile_of
from steptwin.motion.plain import plain_plan, read_plan
from steptwin.tables import complete
from steptwin.world.trace import KINDS as RECORDS
from steptwin.world.trace import TraceRecord


@dataclass(frozen=True, slots=True)
class PlanPayload:
    """A new plan of an axis, which holds from the event's moment. Position shown = (position of the plan + origin) / scale."""

    kind: ClassVar[str] = "plan"
    axis: str
    plan: MotionPlan
    origin: int | None = None
    """Pulses by which the position shown is above that of the plan; None where it is as before."""

    @property
    def text(self) -> str:
        return f"axis {self.axis} {'moves' if profile_of(self.plan).segments else 'stands'}"

    def plain(self) -> dict[str, object]:
        return {"axis": self.axis, "plan": plain_plan(self.plan), "origin": self.origin}


@dataclass(frozen=True, slots=True)
class CoordinatePayload:
    """From now on the position shown is ``origin`` pulses above that of the plan."""

    kind: ClassVar[str] = "coordinate"
    axis: str
    origin: int

    @property
    def text(self) -> str:
        return f"axis {self.axis}: zero moved, {self.origin:+d} pulses from power-on"

    def plain(self) -> dict[str, object]:
        return {"axis": self.axis, "origin": self.origin}


@dataclass(frozen=True, slots=True)
class SamplePayload:
    """Where an axis of a device was at the event's moment, in its unit: a device gives samples where a twin gives plans."""

    kind: ClassVar[str] = "sample"
    axis: str
    position: float
    unit: str

    @property
    def text(self) -> str:
        return f"axis {self.axis} at {self.position:g} {self.unit}".rstrip()

    def plain(self) -> dict[str, object]:
        return {"axis": self.axis, "position": self.position, "unit": self.unit}


@dataclass(frozen=True, slots=True)
class LoadPayload:
    """Where the load of an axis is from now on: (moment, whether it goes with the pulses, how many from them or at which)."""

    kind: ClassVar[str] = "load"
    axis: str
    pieces: tuple[tuple[Nanos, bool, int], ...]

    @property
    def text(self) -> str:
        return f"axis {self.axis}: load {'follows' if self.pieces and self.pieces[-1][1] else 'is held'}"

    def plain(self) -> dict[str, object]:
        pieces = [{"time_ns": str(time), "follows": follows, "pulses": pulses} for time, follows, pulses in self.pieces]
        return {"axis": self.axis, "pieces": pieces}


@dataclass(frozen=True, slots=True)
class EdgePayload:
    """A pin has a new level: 0, 1, volts."""

    kind: ClassVar[str] = "edge"
    axis: ClassVar[None] = None
    pin: str
    level: float

    @property
    def text(self) -> str:
        return f"{self.pin}: {self.level:g}"

    def plain(self) -> dict[str, object]:
        return {"pin": self.pin, "level": self.level}


@dataclass(frozen=True, slots=True)
class FramePayload:
    """A frame, or characters, on a line, from (``in``) or to (``out``) a client. ``words`` have its meaning, in a running world.

    Bytes that belong to no frame have words alone.
    """

    kind: ClassVar[str] = "frame"
    axis: ClassVar[None] = None
    client: str
    direction: str
    data: bytes
    words: str = ""

    @property
    def text(self) -> str:
        return f"{self.client} {self.direction}: {self.words or self.data.hex(' ')}"

    def plain(self) -> dict[str, object]:
        return {"client": self.client, "direction": self.direction, "data": self.data.hex(), "words": self.words}


@dataclass(frozen=True, slots=True)
class StatementPayload:
    """A program executes the statement in a line of its source."""

    kind: ClassVar[str] = "statement"
    axis: ClassVar[None] = None
    program: str
    line: int

    @property
    def text(self) -> str:
        return f"{self.program}: line {self.line}"

    def plain(self) -> dict[str, object]:
        return {"program": self.program, "line": self.line}


@dataclass(frozen=True, slots=True)
class StatusPayload:
    """Something happened in a controller or to its mechanics. ``code`` is stable; ``facts`` have the content of its text."""

    kind: ClassVar[str] = "status"
    code: str
    words: str
    facts: tuple[Fact, ...] = ()

    @property
    def axis(self) -> str | None:
        found = dict(self.facts).get("axis")
        return None if found is None else str(found)

    @property
    def text(self) -> str:
        return self.words

    def plain(self) -> dict[str, object]:
        return {"code": self.code, "axis": self.axis, "facts": dict(self.facts)}


@dataclass(frozen=True, slots=True)
class NotePayload:
    """A text of a script or an operator."""

    kind: ClassVar[str] = "note"
    axis: ClassVar[None] = None
    note: str

    @property
    def text(self) -> str:
        return f"note: {self.note}"

    def plain(self) -> dict[str, object]:
        return {"note": self.note}


@dataclass(frozen=True, slots=True)
class ReportPayload:
    """An expectation that does not hold, or what was waited for in vain (``code`` expectation or overdue)."""

    kind: ClassVar[str] = "report"
    axis: ClassVar[None] = None
    code: str
    what: str

    @property
    def text(self) -> str:
        return f"{self.code}: {self.what}"

    def plain(self) -> dict[str, object]:
        return {"code": self.code, "what": self.what}


@dataclass(frozen=True, slots=True)
class ButtonPayload:
    """A button is pressed or released."""

    kind: ClassVar[str] = "button"
    axis: ClassVar[None] = None
    button: str
    pressed: bool

    @property
    def text(self) -> str:
        return f"{self.button}: {'pressed' if self.pressed else 'released'}"

    def plain(self) -> dict[str, object]:
        return {"button": self.button, "pressed": self.pressed}


@dataclass(frozen=True, slots=True)
class InputPayload:
    """Something else from outside: ``power-cycle``, ``request``, ``vision``, a turned shaft."""

    kind: ClassVar[str] = "input"
    axis: ClassVar[None] = None
    what: str
    value: object

    @property
    def text(self) -> str:
        value = self.value.hex(" ") if isinstance(self.value, bytes) else self.value
        return f"{self.what}: {value}".rstrip()

    def plain(self) -> dict[str, object]:
        return {"what": self.what, "value": {"hex": self.value.hex()} if isinstance(self.value, bytes) else self.value}


@dataclass(frozen=True, slots=True)
class FaultPayload:
    """A fault has struck, or does so no more."""

    kind: ClassVar[str] = "fault"
    axis: ClassVar[None] = None
    fault: str
    words: str

    @property
    def text(self) -> str:
        return f"{self.fault}: {self.words}"

    def plain(self) -> dict[str, object]:
        return {"fault": self.fault, "words": self.words}


@dataclass(frozen=True, slots=True)
class PacePayload:
    """From the event's moment time stands, or goes at a speed: virtual seconds in a second, None as many as there can be."""

    kind: ClassVar[str] = "pace"
    axis: ClassVar[None] = None
    paused: bool
    speed: float | None

    @property
    def text(self) -> str:
        if self.paused:
            return "time stands"
        if self.speed is None:
            return "time goes on as fast as possible"
        return "time goes on" + ("" if self.speed == 1.0 else f", {self.speed:g} virtual seconds a second")

    def plain(self) -> dict[str, object]:
        return {"paused": self.paused, "speed": "max" if self.speed is None else self.speed}


@dataclass(frozen=True, slots=True)
class RestoredPayload:
    """The world is as it was at the event's moment, which may be before those of earlier events: all values may be others. The
    plans of all axes follow."""

    kind: ClassVar[str] = "restored"
    axis: ClassVar[None] = None
    snapshot: str

    @property
    def text(self) -> str:
        return f"back at snapshot {self.snapshot}"

    def plain(self) -> dict[str, object]:
        return {"snapshot": self.snapshot}


Payload: TypeAlias = (
    PlanPayload
    | CoordinatePayload
    | SamplePayload
    | LoadPayload
    | EdgePayload
    | FramePayload
    | StatementPayload
    | StatusPayload
    | NotePayload
    | ReportPayload
    | ButtonPayload
    | InputPayload
    | FaultPayload
    | PacePayload
    | RestoredPayload
)
KINDS: tuple[str, ...] = tuple(payload.kind for payload in get_args(Payload))
SHOWN_KINDS = frozenset({"status", "note", "report", "button", "input", "fault", "pace", "restored"})
"""Kinds that are shown to a user; the others are as frequent as requests."""
STEP_KINDS = SHOWN_KINDS | {"edge", "plan"}
"""Kinds in the answer to a step to the next event."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a machine, to a line, or to the world."""

    number: int
    time: Nanos
    machine: str
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

    def __str__(self) -> str:
        return line_of(self.time, self.machine, self.text)

    def plain(self) -> dict[str, object]:
        """As JSON. ``text`` describes it; it adds nothing to the rest."""
        head = {"number": self.number, "time_ns": str(self.time), "machine": self.machine, "kind": self.kind}
        return {**head, **self.payload.plain(), "cause": self.cause, "text": self.text}


def is_shown(payload: Payload) -> bool:
    return payload.kind in SHOWN_KINDS and not (isinstance(payload, InputPayload) and payload.what == "request")


def line_of(time: Nanos, machine: str, text: str) -> str:
    """What happened, in one line."""
    return f"{time / SECOND:12.6f} s  {machine:<10} {text}".rstrip()


# ---------------------------------------------------------------------- from records


def _of_event(record: TraceRecord) -> Payload:
    text = str(record.value)
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
        "coordinate": lambda record: CoordinatePayload(record.subject, _value(record)),
        "edge": lambda record: EdgePayload(record.subject, _value(record)),
        "frame": _of_frame,
        "statement": lambda record: StatementPayload(record.subject, _value(record)),
        "event": _of_event,
        "input": _of_input,
        "fault": lambda record: FaultPayload(record.subject, str(record.value)),
    },
)


def payload_of(record: TraceRecord) -> Payload:
    """The payload of a record."""
    return _MAKE[record.kind](record)


def shown(record: TraceRecord) -> str:
    """A record in one line."""
    return line_of(record.time, record.machine, payload_of(record).text)


# ---------------------------------------------------------------------- from JSON


def _read_input(data: Mapping[str, Any]) -> InputPayload:
    value = data["value"]
    if isinstance(value, dict):
        return InputPayload(data["what"], bytes.fromhex(value["hex"]))
    return InputPayload(data["what"], tuple(value) if isinstance(value, list) else value)


def _read_load(data: Mapping[str, Any]) -> LoadPayload:
    pieces = ((int(piece["time_ns"]), piece["follows"], piece["pulses"]) for piece in data["pieces"])
    return LoadPayload(data["axis"], tuple(pieces))


def _read_pace(data: Mapping[str, Any]) -> PacePayload:
    return PacePayload(data["paused"], None if data["speed"] in ("max", None) else data["speed"])


_READ: Mapping[str, Callable[[Mapping[str, Any]], Payload]] = complete(
    "kind of event",
    KINDS,
    "reading",
    {
        "plan": lambda data: PlanPayload(data["axis"], read_plan(data["plan"]), data["origin"]),
        "coordinate": lambda data: CoordinatePayload(data["axis"], data["origin"]),
        "sample": lambda data: SamplePayload(data["axis"], data["position"], data["unit"]),
        "load": _read_load,
        "edge": lambda data: EdgePayload(data["pin"], data["level"]),
        "frame": lambda data: FramePayload(data["client"], data["direction"], bytes.fromhex(data["data"]), data["words"]),
        "statement": lambda data: StatementPayload(data["program"], data["line"]),
        "status": lambda data: StatusPayload(data["code"], data["text"], tuple(data["facts"].items())),
        "note": lambda data: NotePayload(data["note"]),
        "report": lambda data: ReportPayload(data["code"], data["what"]),
        "button": lambda data: ButtonPayload(data["button"], data["pressed"]),
        "input": _read_input,
        "fault": lambda data: FaultPayload(data["fault"], data["words"]),
        "pace": _read_pace,
        "restored": lambda data: RestoredPayload(data["snapshot"]),
    },
)


def read_event(data: Mapping[str, Any]) -> Event:
    """The event in JSON. Raises `TypeError`, `ValueError` or `LookupError` for what `Event.plain` does not give."""
    return Event(data["number"], int(data["time_ns"]), data["machine"], _READ[data["kind"]](data), data["cause"])


class Numbering:
    """Numbers commands and events, and finds causes: what came last to the same machine at the same moment and can be one.

    ``line_of`` gives the line of a machine: what arrives there can be the cause of what its machines do.
    """

    __slots__ = ("_command", "_last", "_line_of", "_next")

    def __init__(self, line_of: Mapping[str, str]) -> None:
        self._next = 1
        self._command: tuple[Nanos, int] | None = None
        self._last: dict[str, tuple[Nanos, int]] = {}
        self._line_of = line_of

    def command(self, now: Nanos) -> int:
        """The number of a command that is done now: the cause of what follows at this moment, until `done`."""
        self._command = now, self._take()
        return self._command[1]

    def done(self) -> None:
        self._command = None

    def moved(self, now: Nanos) -> None:
        """Time was set to another moment: only the command that did it can be a cause there."""
        self._last.clear()
        if self._command is not None:
            self._command = now, self._command[1]

    def event(self, time: Nanos, machine: str, payload: Payload) -> Event:
        number = self._take()
        event = Event(number, time, machine, payload, self._cause(time, machine))
        if isinstance(payload, StatementPayload | ButtonPayload | InputPayload | FaultPayload) or (
            isinstance(payload, FramePayload) and payload.direction == "in"
        ):
            self._last[machine] = time, number
        return event

    def _take(self) -> int:
        number = self._next
        self._next += 1
        return number

    def _cause(self, time: Nanos, machine: str) -> int | None:
        candidates = [self._last.get(machine), self._last.get(self._line_of.get(machine, "")), self._command]
        return max((number for found in candidates if found is not None for at, number in [found] if at == time), default=None)
