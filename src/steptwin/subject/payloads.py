"""Payloads of events: one class for each kind, with its content as plain data and as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias, get_args

from steptwin.controller import Fact, Nanos
from steptwin.messages import Message, text_of
from steptwin.motion.divisions import Plan as MotionPlan
from steptwin.motion.divisions import profile_of
from steptwin.motion.plain import plain_plan


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

    def plain(self) -> dict[str, object]:
        return {"axis": self.axis, "position": self.position, "unit": self.unit, "velocity": self.velocity}


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
class FreePayload:
    """The motion of the load of an axis without current, until the next ``load`` or ``free`` of the axis."""

    kind: ClassVar[str] = "free"
    axis: str
    plan: MotionPlan

    @property
    def text(self) -> str:
        return f"axis {self.axis}: load moves without current"

    def plain(self) -> dict[str, object]:
        return {"axis": self.axis, "plan": plain_plan(self.plan)}


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
class WritePayload:
    """A request of a program on a line that is no read, or a line of characters that a host has sent to M1486 chips.

    ``client``: its place on the line; ``source``: who is there: an address, the owner of a certificate; ``script`` for scripts
    and commands of the world, ``pty`` for a pseudo terminal. ``outcome``: ``done``, ``refusal``; empty where there is no answer.
    """

    kind: ClassVar[str] = "write"
    axis: ClassVar[None] = None
    client: str
    source: str
    words: str
    outcome: str

    @property
    def text(self) -> str:
        return f"{self.source}: {self.words}{' (refused)' if self.outcome == 'refusal' else ''}"

    def plain(self) -> dict[str, object]:
        return {"client": self.client, "source": self.source, "words": self.words, "outcome": self.outcome}


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


NOT_ENABLED = "drive-off"
"""The code of the event of a controller that ignores a motion (`steptwin.datasheet.Datasheet.events`)."""


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


NOTE = Message("subject.note", "note: {note}")


@dataclass(frozen=True, slots=True)
class NotePayload:
    """A text of a script or an operator."""

    kind: ClassVar[str] = "note"
    axis: ClassVar[None] = None
    note: str

    @property
    def text(self) -> str:
        return NOTE(note=self.note)

    def plain(self) -> dict[str, object]:
        return {"note": self.note}


EXPECTATION = Message("subject.expectation", "expectation: {what}")
OVERDUE = Message("subject.overdue", "overdue: {what}")
REPORTS = {"expectation": EXPECTATION, "overdue": OVERDUE}
"""By the code of the report."""


@dataclass(frozen=True, slots=True)
class ReportPayload:
    """An expectation that does not hold, or what was waited for in vain (``code`` expectation or overdue)."""

    kind: ClassVar[str] = "report"
    axis: ClassVar[None] = None
    code: str
    what: str

    @property
    def text(self) -> str:
        return REPORTS[self.code](what=text_of(self.what))

    def plain(self) -> dict[str, object]:
        return {"code": self.code, "what": self.what}


PRESSED = Message("subject.button-pressed", "{button}: pressed")
RELEASED = Message("subject.button-released", "{button}: released")


@dataclass(frozen=True, slots=True)
class ButtonPayload:
    """A button is pressed or released."""

    kind: ClassVar[str] = "button"
    axis: ClassVar[None] = None
    button: str
    pressed: bool

    @property
    def text(self) -> str:
        return (PRESSED if self.pressed else RELEASED)(button=self.button)

    def plain(self) -> dict[str, object]:
        return {"button": self.button, "pressed": self.pressed}


INPUT = Message("subject.input", "{what}: {value}")
TURNED = Message("subject.turned", "{shaft} turned: {counts}")
POWER_CYCLE = Message("subject.power-cycle", "power-cycle:")
POWER_CYCLE_OF = Message("subject.power-cycle-of", "power-cycle: {what}")


@dataclass(frozen=True, slots=True)
class InputPayload:
    """Something else from outside: ``power-cycle``, ``request``, ``vision``, a turned shaft."""

    kind: ClassVar[str] = "input"
    axis: ClassVar[None] = None
    what: str
    value: object

    @property
    def text(self) -> str:
        value = self.value.hex(" ") if isinstance(self.value, bytes) else str(self.value)
        if self.what == "power-cycle":
            return POWER_CYCLE_OF(what=value) if value else POWER_CYCLE()
        if self.what.endswith(" turned"):
            return TURNED(shaft=self.what.removesuffix(" turned"), counts=value)
        return INPUT(what=self.what, value=value) if value else f"{self.what}:"

    def plain(self) -> dict[str, object]:
        return {"what": self.what, "value": {"hex": self.value.hex()} if isinstance(self.value, bytes) else self.value}


FAULT = Message("subject.fault", "{fault}: {effect}")


@dataclass(frozen=True, slots=True)
class FaultPayload:
    """A fault has struck, or does so no more."""

    kind: ClassVar[str] = "fault"
    axis: ClassVar[None] = None
    fault: str
    words: str

    @property
    def text(self) -> str:
        return FAULT(fault=self.fault, effect=text_of(self.words))

    def plain(self) -> dict[str, object]:
        return {"fault": self.fault, "words": self.words}


PAUSED = Message("subject.paused", "paused")
RUNNING = Message("subject.running", "running")
RUNNING_FAST = Message("subject.running-fast", "running as fast as possible")
RUNNING_AT = Message("subject.running-at", "running, {speed:g} virtual seconds per second")


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
            return PAUSED()
        if self.speed is None:
            return RUNNING_FAST()
        return RUNNING() if self.speed == 1.0 else RUNNING_AT(speed=self.speed)

    def plain(self) -> dict[str, object]:
        return {"paused": self.paused, "speed": "max" if self.speed is None else self.speed}


BACK_IN_TIME = Message("subject.back-in-time", "time went back to here")
BACK_AT_SNAPSHOT = Message("subject.back-at-snapshot", "back at snapshot {name}")


@dataclass(frozen=True, slots=True)
class RestoredPayload:
    """The world is as it was at the event's moment, which may be before those of earlier events: all values may be others. The
    plans of all axes follow."""

    kind: ClassVar[str] = "restored"
    axis: ClassVar[None] = None
    snapshot: str | None
    """Its name; None for a moment that was looked at."""

    @property
    def text(self) -> str:
        return BACK_IN_TIME() if self.snapshot is None else BACK_AT_SNAPSHOT(name=self.snapshot)

    def plain(self) -> dict[str, object]:
        return {"snapshot": self.snapshot}


@dataclass(frozen=True, slots=True)
class StoppedPayload:
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

    def plain(self) -> dict[str, object]:
        return {
            "reason": self.reason,
            "what": self.what,
            "breakpoints": list(self.breakpoints),
            "program": self.program,
            "line": self.line,
            "past": self.past,
        }


@dataclass(frozen=True, slots=True)
class LogPayload:
    """The text of a breakpoint that logs, when it was passed."""

    kind: ClassVar[str] = "log"
    axis: ClassVar[None] = None
    words: str
    program: str
    line: int

    @property
    def text(self) -> str:
        return f"{self.program}, line {self.line}: {self.words}"

    def plain(self) -> dict[str, object]:
        return {"words": self.words, "program": self.program, "line": self.line}


@dataclass(frozen=True, slots=True)
class BreakpointsPayload:
    """Time stops at these breakpoints and events from now on. ``breakpoints`` are as the command ``breakpoints`` gives them."""

    kind: ClassVar[str] = "breakpoints"
    axis: ClassVar[None] = None
    breakpoints: tuple[Mapping[str, object], ...]
    stop_on: tuple[str, ...]

    @property
    def text(self) -> str:
        return f"{len(self.breakpoints)} breakpoints; stops on {', '.join(self.stop_on) or 'no events'}"

    def plain(self) -> dict[str, object]:
        return {"breakpoints": [dict(one) for one in self.breakpoints], "stop_on": list(self.stop_on)}


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
KINDS: tuple[str, ...] = tuple(payload.kind for payload in get_args(Payload))
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
