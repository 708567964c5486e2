"""Payloads of events: one class for each kind, with its content as plain data and as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self, TypeAlias, get_args

from steptwin.controller import Fact, Nanos
from steptwin.jsonvalues import FLAG, MOMENT, NUMBER, TEXT, WHOLE, Hexadecimal, JsonForm, list_of, members, or_null, read, to_json
from steptwin.messages import Message, read_message_text, text_of
from steptwin.motion.divisions import Plan as MotionPlan
from steptwin.motion.divisions import profile_of
from steptwin.motion.planjson import plan_to_json, read_plan

_NUMBERS = list_of({"type": ["number", "null"]})
_ARC = members(
    {
        "end_s": {"type": ["number", "null"]},
        "direction": WHOLE,
        "way": _NUMBERS,
        "course": _NUMBERS,
        "half": WHOLE,
        "end_p": NUMBER,
    }
)
_PLAN = {
    "type": "object",
    "description": "Numbers for the position at any moment; docs/control.md has the formulas.",
    "properties": {
        "start_ns": MOMENT,
        "base": WHOLE,
        "final": NUMBER,
        "segments": list_of({"anyOf": [_NUMBERS, _ARC]}),
        "microstepping": _NUMBERS,
        "divisions": list_of(list_of(WHOLE)),
    },
    "required": ["start_ns", "base", "final", "segments"],
    "additionalProperties": False,
}
_JsonPlan: TypeAlias = Annotated[MotionPlan, JsonForm(_PLAN, read_plan, plan_to_json)]


class JsonPayload:
    """Payload of an event, written and read by the annotations of its class (`steptwin.jsonvalues`)."""

    __slots__ = ()

    def to_json(self) -> dict[str, object]:
        return to_json(self)

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Self:
        """The payload of an event in JSON. Raises `TypeError`, `ValueError` or `LookupError`."""
        return read(cls, data)


@dataclass(frozen=True, slots=True)
class PlanPayload(JsonPayload):
    """A new plan of an axis, which holds from the event's moment. Position shown = (position of the plan + origin) / scale."""

    kind: ClassVar[str] = "plan"
    axis: str
    plan: _JsonPlan
    origin: int | None = None
    """Pulses by which the position shown is above that of the plan; None where it is as before."""

    @property
    def text(self) -> str:
        return f"axis {self.axis} {'moves' if profile_of(self.plan).segments else 'stands'}"


@dataclass(frozen=True, slots=True)
class CoordinatePayload(JsonPayload):
    """From now on the position shown is ``origin`` pulses above that of the plan."""

    kind: ClassVar[str] = "coordinate"
    axis: str
    origin: int

    @property
    def text(self) -> str:
        return f"axis {self.axis}: zero moved, {self.origin:+d} pulses from power-on"


@dataclass(frozen=True, slots=True)
class SamplePayload(JsonPayload):
    """Where an axis of a device was at the event's moment, in its unit: a device gives samples where a twin gives plans.

    Position and velocity (units/s) are None where they are not known.
    """

    kind: ClassVar[str] = "sample"
    axis: str
    position: float | None
    unit: str
    velocity: float | None = None

    @property
    def text(self) -> str:
        if self.position is None:
            return f"axis {self.axis}: the position is not known"
        return f"axis {self.axis} at {self.position:g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class LoadPayload(JsonPayload):
    """Where the load of an axis is from now on: (moment, whether it goes with the pulses, how many from them or at which)."""

    kind: ClassVar[str] = "load"
    axis: str
    pieces: Annotated[
        tuple[tuple[Nanos, bool, int], ...],
        JsonForm(
            list_of(members({"time_ns": MOMENT, "follows": FLAG, "pulses": WHOLE})),
            lambda pieces: tuple([(int(one["time_ns"]), one["follows"], one["pulses"]) for one in pieces]),
            lambda pieces: [{"time_ns": str(time), "follows": follows, "pulses": pulses} for time, follows, pulses in pieces],
        ),
    ]

    @property
    def text(self) -> str:
        return f"axis {self.axis}: load {'follows' if self.pieces and self.pieces[-1][1] else 'is held'}"


@dataclass(frozen=True, slots=True)
class FreePayload(JsonPayload):
    """The motion of the load of an axis without current, until the next ``load`` or ``free`` of the axis."""

    kind: ClassVar[str] = "free"
    axis: str
    plan: _JsonPlan

    @property
    def text(self) -> str:
        return f"axis {self.axis}: load moves without current"


@dataclass(frozen=True, slots=True)
class EdgePayload(JsonPayload):
    """A pin has a new level: 0, 1, volts."""

    kind: ClassVar[str] = "edge"
    axis: ClassVar[None] = None
    pin: str
    level: float

    @property
    def text(self) -> str:
        return f"{self.pin}: {self.level:g}"


@dataclass(frozen=True, slots=True)
class FramePayload(JsonPayload):
    """A frame, or characters, on a line, from (``in``) or to (``out``) a client. ``words`` have its meaning, in a running world.

    Bytes that belong to no frame have words alone.
    """

    kind: ClassVar[str] = "frame"
    axis: ClassVar[None] = None
    client: str
    direction: Annotated[str, JsonForm({"enum": ["in", "out"]})]
    data: Annotated[Hexadecimal, "Hexadecimal; empty for bytes that belong to no frame."]
    words: Annotated[str, "Its meaning."] = ""

    @property
    def text(self) -> str:
        return f"{self.client} {self.direction}: {self.words or self.data.hex(' ')}"


@dataclass(frozen=True, slots=True)
class WritePayload(JsonPayload):
    """A request of a program on a line that is no read, or a line of characters that a host has sent to M1486 chips.

    ``client``: its place on the line; ``source``: who is there: an address, the owner of a certificate; ``script`` for scripts
    and commands of the world, ``pty`` for a pseudo terminal. ``outcome``: ``done``, ``refusal``; empty where there is no answer.
    """

    kind: ClassVar[str] = "write"
    axis: ClassVar[None] = None
    client: Annotated[str, "Its place on the line."]
    source: Annotated[str, "Who is there: an address, the owner of a certificate, a path, or script."]
    words: Annotated[str, "What was written."]
    outcome: Annotated[str, JsonForm({"enum": ["done", "refusal", ""]}), "Empty where there is no answer."]

    @property
    def text(self) -> str:
        return f"{self.source}: {self.words}{' (refused)' if self.outcome == 'refusal' else ''}"


@dataclass(frozen=True, slots=True)
class StatementPayload(JsonPayload):
    """A program executes the statement in a line of its source."""

    kind: ClassVar[str] = "statement"
    axis: ClassVar[None] = None
    program: str
    line: int

    @property
    def text(self) -> str:
        return f"{self.program}: line {self.line}"


NOT_ENABLED = "drive-off"
"""The code of the event of a controller that ignores a motion (`steptwin.datasheet.Datasheet.events`)."""


@dataclass(frozen=True, slots=True)
class StatusPayload(JsonPayload):
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

    def to_json(self) -> dict[str, object]:
        """Its text is that of the event, and its axis one of the facts."""
        return {"code": self.code, "axis": self.axis, "facts": dict(self.facts)}

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> StatusPayload:
        return cls(data["code"], read_message_text(data, "text"), tuple(data["facts"].items()))


NOTE = Message("subject.note", "note: {note}")


@dataclass(frozen=True, slots=True)
class NotePayload(JsonPayload):
    """A text of a script or an operator."""

    kind: ClassVar[str] = "note"
    axis: ClassVar[None] = None
    note: str

    @property
    def text(self) -> str:
        return NOTE(note=self.note)


EXPECTATION = Message("subject.expectation", "expectation: {what}")
OVERDUE = Message("subject.overdue", "overdue: {what}")
REPORTS = {"expectation": EXPECTATION, "overdue": OVERDUE}
"""By the code of the report."""


@dataclass(frozen=True, slots=True)
class ReportPayload(JsonPayload):
    """An expectation that does not hold, or what was waited for in vain (``code`` expectation or overdue)."""

    kind: ClassVar[str] = "report"
    axis: ClassVar[None] = None
    code: str
    what: str

    @property
    def text(self) -> str:
        return REPORTS[self.code](what=text_of(self.what))


PRESSED = Message("subject.button-pressed", "{button}: pressed")
RELEASED = Message("subject.button-released", "{button}: released")


@dataclass(frozen=True, slots=True)
class ButtonPayload(JsonPayload):
    """A button is pressed or released."""

    kind: ClassVar[str] = "button"
    axis: ClassVar[None] = None
    button: str
    pressed: bool

    @property
    def text(self) -> str:
        return (PRESSED if self.pressed else RELEASED)(button=self.button)


INPUT = Message("subject.input", "{what}: {value}")
TURNED = Message("subject.turned", "{shaft} turned: {counts}")
POWER_CYCLE = Message("subject.power-cycle", "power-cycle:")
POWER_CYCLE_OF = Message("subject.power-cycle-of", "power-cycle: {what}")


def _read_value(value: Any) -> object:
    if isinstance(value, dict):
        return bytes.fromhex(value["hex"])
    return tuple(value) if isinstance(value, list) else value


@dataclass(frozen=True, slots=True)
class InputPayload(JsonPayload):
    """Something else from outside: ``power-cycle``, ``request``, ``vision``, a turned shaft."""

    kind: ClassVar[str] = "input"
    axis: ClassVar[None] = None
    what: str
    value: Annotated[
        object,
        JsonForm(
            {},
            _read_value,
            lambda value: {"hex": value.hex()} if isinstance(value, bytes) else value,
        ),
    ]

    @property
    def text(self) -> str:
        value = self.value.hex(" ") if isinstance(self.value, bytes) else str(self.value)
        if self.what == "power-cycle":
            return POWER_CYCLE_OF(what=value) if value else POWER_CYCLE()
        if self.what.endswith(" turned"):
            return TURNED(shaft=self.what.removesuffix(" turned"), counts=value)
        return INPUT(what=self.what, value=value) if value else f"{self.what}:"


FAULT = Message("subject.fault", "{fault}: {effect}")


@dataclass(frozen=True, slots=True)
class FaultPayload(JsonPayload):
    """A fault has struck, or does so no more."""

    kind: ClassVar[str] = "fault"
    axis: ClassVar[None] = None
    fault: str
    words: str

    @property
    def text(self) -> str:
        return FAULT(fault=self.fault, effect=text_of(self.words))


PAUSED = Message("subject.paused", "paused")
RUNNING = Message("subject.running", "running")
RUNNING_FAST = Message("subject.running-fast", "running as fast as possible")
RUNNING_AT = Message("subject.running-at", "running, {speed:g} virtual seconds per second")


@dataclass(frozen=True, slots=True)
class PacePayload(JsonPayload):
    """From the event's moment time stands, or goes at a speed: virtual seconds in a second, None as many as there can be."""

    kind: ClassVar[str] = "pace"
    axis: ClassVar[None] = None
    paused: bool
    speed: Annotated[
        float | None,
        JsonForm(
            {"anyOf": [NUMBER, {"const": "max"}, {"type": "null"}]},
            lambda speed: None if speed == "max" else speed,
            lambda speed: "max" if speed is None else speed,
        ),
    ]

    @property
    def text(self) -> str:
        if self.paused:
            return PAUSED()
        if self.speed is None:
            return RUNNING_FAST()
        return RUNNING() if self.speed == 1.0 else RUNNING_AT(speed=self.speed)


BACK_IN_TIME = Message("subject.back-in-time", "time went back to here")
BACK_AT_SNAPSHOT = Message("subject.back-at-snapshot", "back at snapshot {name}")


@dataclass(frozen=True, slots=True)
class RestoredPayload(JsonPayload):
    """The world is as it was at the event's moment, which may be before those of earlier events: all values may be others. The
    plans of all axes follow."""

    kind: ClassVar[str] = "restored"
    axis: ClassVar[None] = None
    snapshot: Annotated[str | None, "Its name; null without one."]
    """None for a moment that was shown."""

    @property
    def text(self) -> str:
        return BACK_IN_TIME() if self.snapshot is None else BACK_AT_SNAPSHOT(name=self.snapshot)


@dataclass(frozen=True, slots=True)
class StoppedPayload(JsonPayload):
    """A debugger stands at the event's moment, which may be in the past while time stands at the present.

    ``reason``: ``entry``, ``step``, ``breakpoint``, ``function breakpoint`` (a label), ``data breakpoint``, ``exception`` (an
    event), ``pause``, ``begin`` (the oldest moment that is kept). ``breakpoints``: those that were hit. ``program`` and ``line``
    of the statement that comes next, of the event's controller; None where no program is the reason.
    """

    kind: ClassVar[str] = "stopped"
    axis: ClassVar[None] = None
    reason: str
    what: str = ""
    breakpoints: tuple[int, ...] = ()
    program: str | None = None
    line: int | None = None
    past: bool = False

    @property
    def text(self) -> str:
        where = "" if self.line is None else f" in line {self.line} of {self.program}"
        return f"stopped: {self.reason}{where}{', ' if self.what else ''}{self.what}"


@dataclass(frozen=True, slots=True)
class LogPayload(JsonPayload):
    """The text of a breakpoint that logs, when it was passed."""

    kind: ClassVar[str] = "log"
    axis: ClassVar[None] = None
    words: str
    program: str
    line: int

    @property
    def text(self) -> str:
        return f"{self.program}, line {self.line}: {self.words}"


@dataclass(frozen=True, slots=True)
class BreakpointsPayload(JsonPayload):
    """Time stops at these breakpoints and events from now on. ``breakpoints`` are as the command ``breakpoints`` gives them."""

    kind: ClassVar[str] = "breakpoints"
    axis: ClassVar[None] = None
    breakpoints: Annotated[
        tuple[Mapping[str, object], ...],
        JsonForm(
            list_of(
                members(
                    {
                        "number": WHOLE,
                        **dict.fromkeys(("controller", "program"), or_null(TEXT)),
                        "line": or_null(WHOLE),
                        **dict.fromkeys(("label", "value", "condition", "hits", "log", "problem"), or_null(TEXT)),
                    }
                )
            ),
            tuple,
            lambda breakpoints: list(map(dict, breakpoints)),
        ),
    ]
    stop_on: tuple[str, ...]

    @property
    def text(self) -> str:
        return f"{len(self.breakpoints)} breakpoints; stops on {', '.join(self.stop_on) or 'no events'}"


Payload: TypeAlias = (
    PlanPayload
    | CoordinatePayload
    | SamplePayload
    | LoadPayload
    | FreePayload
    | EdgePayload
    | FramePayload
    | WritePayload
    | StatementPayload
    | StatusPayload
    | NotePayload
    | ReportPayload
    | ButtonPayload
    | InputPayload
    | FaultPayload
    | PacePayload
    | RestoredPayload
    | StoppedPayload
    | LogPayload
    | BreakpointsPayload
)
PAYLOADS: Mapping[str, type[JsonPayload]] = {payload.kind: payload for payload in get_args(Payload)}
KINDS: tuple[str, ...] = tuple(PAYLOADS)
SHOWN_KINDS = frozenset({"status", "note", "report", "button", "input", "fault", "pace", "restored"})
"""Kinds that are shown to a user; the others are as frequent as requests."""
STEP_KINDS = SHOWN_KINDS | {"edge", "plan"}
"""Kinds in the answer to a step to the next event."""


def is_shown(payload: Payload) -> bool:
    return payload.kind in SHOWN_KINDS and not (isinstance(payload, InputPayload) and payload.what == "request")


def named_in(payload: Payload) -> Sequence[str]:
    """The names of buttons, pins, signals and elements that it is about, besides its controller."""
    match payload:
        case EdgePayload():
            return (payload.pin,)
        case ButtonPayload():
            return (payload.button,)
        case InputPayload():
            return (payload.what,)
        case StatusPayload():
            return [fact for _, fact in payload.facts if isinstance(fact, str)]
    return ()
