"""The present state of one controller: one shape for all kinds. What is not known is None.

`steptwin.jsonvalues` makes JSON of it, and reads that. The data sheet has what does not change: title, units, pins,
and what each of the ``details`` means.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar, cast

from steptwin.controller import SECOND, Nanos
from steptwin.datasheet import AxisDescription, Datasheet, Detail
from steptwin.errors import Misuse
from steptwin.jsonvalues import to_json
from steptwin.messages import Message
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss

M = TypeVar("M", bound=MotionController)
DetailValue: TypeAlias = bool | int | float | str | tuple[int, ...] | Mapping[str, int] | None
"""Value of the type that its `Detail` has."""


class StatusLevel(enum.Enum):
    OK = "ok"
    WARNING = "warning"
    """It does not do what it was commanded to: at a limit, shut down, program halted."""
    ERROR = "error"


class ProgramActivity(enum.Enum):
    STOPPED = "stopped"
    RUNNING = "running"
    WAITING = "waiting"
    """For a moment, an input, or the end of a motion."""
    PAUSED = "paused"
    """It can go on where it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StateStatus:
    """Status that a controller or an axis reports of itself."""

    code: int | None = None
    """The number that it shows; None where it has no numbers."""
    text: str
    level: StatusLevel = StatusLevel.OK


@dataclass(frozen=True, slots=True, kw_only=True)
class StateProgram:
    """The program that is executed at present, or was last."""

    state: ProgramActivity | None
    text: str
    """The same in words, with what it waits for, or why it was stopped."""
    file: str | None = None
    """None where the source is not known."""
    line: int | None = None
    """In the source, from 1."""
    statement: str | None = None
    """The one that is executed or comes next."""
    variables: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateAxis:
    """``number``, ``name`` and ``unit`` are those of the data sheet."""

    number: int
    name: str
    unit: str
    position: float | None
    """In ``unit``, at this moment of a motion, too."""
    velocity: float | None
    """In ``unit`` per second."""
    moving: bool | None
    enabled: bool | None
    """Whether its drive is on; None where the controller does not switch it."""
    encoder: int | None
    """Counts; None without an encoder."""
    status: StateStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerState:
    kind: str
    """The name of the kind of controller, as in its data sheet."""
    variant: str
    time_s: float | None
    """Time of its clock, which begins at 0."""
    status: StateStatus
    program: StateProgram
    axes: tuple[StateAxis, ...]
    pins: Mapping[str, float | None]
    """Levels: 0, 1, volts."""
    details: Mapping[str, DetailValue]
    """Details that only this kind has, by the names of ``details`` in its data sheet."""


@dataclass(frozen=True, slots=True)
class DetailRow(Generic[M]):
    """A detail of a kind of controller, and how it is read at the present moment of the controller."""

    detail: Detail
    read: Callable[[M, Nanos], DetailValue]


class StateReader(ABC, Generic[M]):
    """Reads the state of a kind of controller at the present moment of the controller: all of it, or some of its parts, which are
    ``status``, ``program``, ``pins``, ``details`` and its axes by name."""

    details: Sequence[DetailRow[M]] = ()

    @abstractmethod
    def datasheet(self, controller: M, /) -> Datasheet: ...

    @abstractmethod
    def status(self, controller: M, now: Nanos, /) -> StateStatus: ...

    @abstractmethod
    def program(self, controller: M, now: Nanos, /) -> StateProgram: ...

    @abstractmethod
    def axis(self, controller: M, described: AxisDescription, now: Nanos, /) -> StateAxis: ...

    def pins(self, controller: M, now: Nanos, /) -> Mapping[str, float]:
        """The levels of all pins."""
        return controller.pins()

    def pin(self, controller: M, name: str, now: Nanos, /) -> float:
        return controller.pin(name)

    def __call__(self, controller: M, now: Nanos) -> ControllerState:
        sheet = self.datasheet(controller)
        return ControllerState(
            kind=sheet.kind,
            variant=sheet.variant,
            time_s=now / SECOND,
            status=self.status(controller, now),
            program=self.program(controller, now),
            axes=tuple([self.axis(controller, axis, now) for axis in sheet.axes]),
            pins=dict(self.pins(controller, now)),
            details=details_of(self.details, controller, now),
        )

    def parts(self, controller: M, now: Nanos, wanted: Collection[str]) -> dict[str, object]:
        """As JSON, as far as there is anything of them. Raises `Misuse` for a name that is none."""
        sheet = self.datasheet(controller)
        found: dict[str, object] = {}
        if "status" in wanted:
            found["status"] = to_json(self.status(controller, now))
        if "program" in wanted:
            found["program"] = to_json(self.program(controller, now))
        found["axes"] = [to_json(self.axis(controller, axis, now)) for axis in sheet.axes if axis.name in wanted]
        if "pins" in wanted:
            found["pins"] = dict(self.pins(controller, now))
        if "details" in wanted:
            found["details"] = to_json(details_of(self.details, controller, now))
        if len(found) - 1 + len(cast("list[object]", found["axes"])) != len(wanted):
            check_parts(sheet, wanted)
        return found


PARTS = ("status", "program", "pins", "details")
"""Parts of a state beside its axes."""


UNKNOWN_PART = Message("controllerstate.unknown-part", "parts: a state has no part {name!r}{hint}; there are {names}")


def check_parts(sheet: Datasheet, wanted: Collection[str]) -> None:
    """Raises `Misuse` for what is no part of a state."""
    known = (*PARTS, *(axis.name for axis in sheet.axes))
    for name in wanted:
        if name not in known:
            raise Misuse(UNKNOWN_PART(name=name, hint=NearMiss().hint(name, known), names=list(known)))


def parts_of(state: ControllerState, sheet: Datasheet, wanted: Collection[str]) -> dict[str, object]:
    """As `StateReader.parts`, of a state that has been read."""
    check_parts(sheet, wanted)
    whole = to_json(state)
    found = {name: whole[name] for name in PARTS if name in wanted}
    return {**found, "axes": [to_json(axis) for axis in state.axes if axis.name in wanted]}


def details_of(rows: Iterable[DetailRow[M]], controller: M, now: Nanos) -> dict[str, DetailValue]:
    return {row.detail.name: row.read(controller, now) for row in rows}


def detail_text(value: DetailValue) -> str:
    """For people."""
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case tuple():
            return " ".join(map(str, value)) or "none"
        case str() | int() | float():
            return str(value)
    return ", ".join(f"{name} = {number}" for name, number in value.items()) or "none"
