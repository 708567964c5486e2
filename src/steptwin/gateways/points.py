"""The values of a controller that gateways show: from its data sheet, alike for every protocol (docs/gateways.md).

The paths are those of its state: ``M1.position``, ``program.text``, ``pins.IN3``, ``details.baud``; registers that a gateway's
table names follow under ``registers``.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, TypeAlias, cast

from steptwin.controllerstate import StatusLevel
from steptwin.datasheet import Access, AxisDescription, Detail, FactType, Limits, Pin, PinDirection
from steptwin.errors import Misuse
from steptwin.nearmiss import NearMiss
from steptwin.simulation.script.steps import Set, Write
from steptwin.subject.commands import Command
from steptwin.subject.contract import ControllerDescription, Description

PointValue: TypeAlias = bool | int | float | str | None
"""None where it is not known."""
State: TypeAlias = Mapping[str, Any]
"""The state of a controller as JSON (`steptwin.controllerstate`), with ``registers`` by name besides."""


class PointType(enum.Enum):
    TRUTH = "true or false"
    WHOLE = "whole number"
    NUMBER = "number"
    TEXT = "text"


@dataclass(frozen=True, slots=True, kw_only=True)
class GatewayPoint:
    """One value of a controller. ``path``: under the controller, such as ``("M1", "position")``."""

    path: tuple[str, ...]
    meaning: str
    type: PointType
    unit: str = ""
    limits: Limits | None = None
    """Limits of its values; None where they are not known."""
    part: Callable[[State], Any]
    """The part of a state in which it is, which it shares with the others of its `group`."""
    of: Callable[[Any], PointValue]
    """Its value in that part."""
    write: Callable[[float], Command] | None = None
    """The command that gives it another value; None where it cannot be written."""

    @property
    def name(self) -> str:
        return ".".join(self.path)

    @property
    def group(self) -> str:
        """Group below its controller: an axis, ``pins`` …; empty for the controller itself."""
        return self.path[0] if len(self.path) > 1 else ""

    def read(self, state: State) -> PointValue:
        return self.of(self.part(state))

    def typed_value(self, state: State) -> PointValue:
        """Its value, of its type."""
        return self.typed_in(self.part(state))

    def typed_in(self, part: Any) -> PointValue:
        return self.typed(self.of(part))

    def typed(self, value: PointValue) -> PointValue:
        """``value``, which `of` has given, of its type."""
        if value is None:
            return None
        return bool(value) if self.type is PointType.TRUTH else float(value) if self.type is PointType.NUMBER else value


_BY_NAME = ("program", "pins", "details", "registers")
"""Groups whose values have the names of the points in their part."""


def values_of(points: Sequence[GatewayPoint]) -> Callable[[Any], tuple[PointValue, ...]]:
    """Function that reads the points of one group in their part, all at once."""
    if len(points) > 1 and points[0].group in _BY_NAME:
        return itemgetter(*(point.path[-1] for point in points))
    reads = [point.of for point in points]
    return lambda part: tuple([read(part) for read in reads])


def points_of(part: ControllerDescription, description: Description, registers: Iterable[str] = ()) -> tuple[GatewayPoint, ...]:
    """Those of a controller, in the order in which they are shown. ``registers``: the names of further points to show."""
    return tuple(_points(part, description, registers))


def _points(part: ControllerDescription, description: Description, registers: Iterable[str]) -> Iterator[GatewayPoint]:
    yield from _CONTROLLER
    yield from _PROGRAM
    for index, axis in enumerate(part.datasheet.axes):
        yield from _axis(index, axis)
    can_set = "set" in description.commands
    writable = {point.path for point in part.datasheet.points if point.access is not Access.READ}
    for pin in part.datasheet.pins:
        yield _pin(part.name, pin, can_set=can_set, is_writable=pin.name in writable)
    for detail in part.datasheet.details:
        if detail.type in _DETAIL_TYPES:
            yield _detail(detail)
    for name in registers:
        yield _register(part, name)


# ---------------------------------------------------------------------- the state


def whole_state(state: State) -> State:
    """The `GatewayPoint.part` of a value that is in no part."""
    return state


_STATUS, _PROGRAM_PART, _PINS, _DETAILS, _REGISTERS = map(itemgetter, ("status", "program", "pins", "details", "registers"))


def _of_status(key: str) -> Callable[[Any], PointValue]:
    """Reader of a status of an axis."""
    return lambda axis: cast("PointValue", axis["status"][key])


_LEVELS = ", ".join(level.value for level in StatusLevel)

_CONTROLLER = (
    GatewayPoint(path=("status",), meaning="Its status in words.", type=PointType.TEXT, part=_STATUS, of=itemgetter("text")),
    GatewayPoint(
        path=("status_code",), meaning="The number of its status.", type=PointType.WHOLE, part=_STATUS, of=itemgetter("code")
    ),
    GatewayPoint(
        path=("status_level",),
        meaning=f"How serious that is: {_LEVELS}.",
        type=PointType.TEXT,
        part=_STATUS,
        of=itemgetter("level"),
    ),
)
_PROGRAM = (
    GatewayPoint(
        path=("program", "state"),
        meaning="stopped, running, waiting or paused.",
        type=PointType.TEXT,
        part=_PROGRAM_PART,
        of=itemgetter("state"),
    ),
    GatewayPoint(
        path=("program", "text"),
        meaning="The same in words, with what it waits for.",
        type=PointType.TEXT,
        part=_PROGRAM_PART,
        of=itemgetter("text"),
    ),
    GatewayPoint(
        path=("program", "line"),
        meaning="The line that is executed.",
        type=PointType.WHOLE,
        part=_PROGRAM_PART,
        of=itemgetter("line"),
    ),
    GatewayPoint(
        path=("program", "statement"),
        meaning="The statement there.",
        type=PointType.TEXT,
        part=_PROGRAM_PART,
        of=itemgetter("statement"),
    ),
)


def _axis(index: int, axis: AxisDescription) -> Iterator[GatewayPoint]:
    def point(
        name: str,
        meaning: str,
        kind: PointType,
        of: Callable[[Any], PointValue] | None = None,
        unit: str = "",
        limits: Limits | None = None,
    ) -> GatewayPoint:
        of = itemgetter(name) if of is None else of
        return GatewayPoint(path=(axis.name, name), meaning=meaning, type=kind, unit=unit, limits=limits, part=part, of=of)

    def part(state: State) -> Any:
        return state["axes"][index]

    number, whole, truth, text = PointType.NUMBER, PointType.WHOLE, PointType.TRUTH, PointType.TEXT
    yield point("position", "Counted position.", number, unit=axis.unit, limits=axis.positions)
    yield point("velocity", "Velocity with its sign.", number, unit=f"{axis.unit}/s", limits=axis.velocities)
    yield point("moving", "Whether it moves.", truth)
    yield point("enabled", "Whether its drive is on.", truth)
    yield point("encoder", "Counts of its encoder.", whole)
    yield point("status", "Its status in words.", text, _of_status("text"))
    yield point("status_code", "The number of its status.", whole, _of_status("code"))
    yield point("status_level", f"How serious that is: {_LEVELS}.", text, _of_status("level"))


def _pin(controller: str, pin: Pin, *, can_set: bool, is_writable: bool) -> GatewayPoint:
    """Inputs of a twin take levels; outputs are written where the controller has a register for them."""
    write: Callable[[float], Command] | None = None
    if is_writable:
        write = lambda level: Write(((controller, pin.name, level),))  # noqa: E731
    elif can_set and pin.direction is not PinDirection.OUTPUT:
        write = lambda level: Set(((controller, pin.name, level),))  # noqa: E731
    return GatewayPoint(
        path=("pins", pin.name),
        meaning=f"Level of an {pin.direction.value}.",
        type=PointType.NUMBER if pin.is_analog else PointType.TRUTH,
        unit=pin.unit,
        limits=pin.limits,
        part=_PINS,
        of=itemgetter(pin.name),
        write=write,
    )


_DETAIL_TYPES = {
    FactType.WHOLE: PointType.WHOLE,
    FactType.NUMBER: PointType.NUMBER,
    FactType.TRUTH: PointType.TRUTH,
    FactType.TEXT: PointType.TEXT,
}


def _detail(detail: Detail) -> GatewayPoint:
    return GatewayPoint(
        path=("details", detail.name),
        meaning=f"{detail.meaning}.",
        type=_DETAIL_TYPES[detail.type],
        unit=detail.unit,
        part=_DETAILS,
        of=itemgetter(detail.name),
    )


# ---------------------------------------------------------------------- the clock

CLOCK = "time"
"""The name under which the time of a subject is shown, beside its controllers."""
CLOCK_POINTS = (
    GatewayPoint(
        path=("virtual_time",),
        meaning="Time of the twins since they began.",
        type=PointType.NUMBER,
        unit="s",
        part=whole_state,
        of=itemgetter("time_s"),
    ),
    GatewayPoint(
        path=("paused",), meaning="Whether it is paused.", type=PointType.TRUTH, part=whole_state, of=itemgetter("paused")
    ),
    GatewayPoint(
        path=("speed",),
        meaning="Virtual seconds in a second; unknown where it is as fast as it can be.",
        type=PointType.NUMBER,
        part=whole_state,
        of=lambda state: state["speed"] if isinstance(state["speed"], int | float) else None,
    ),
)
"""Read from the answer to the command ``time``."""


# ---------------------------------------------------------------------- registers


def _register(part: ControllerDescription, name: str) -> GatewayPoint:
    """A point of the data sheet, or an element of one that is a list (``USER_REGISTER[5]``)."""
    point = part.datasheet.point(name.partition("[")[0])
    controller = part.name
    return GatewayPoint(
        path=("registers", name),
        meaning=f"{point.meaning.removesuffix('.')}.",
        type=PointType.TRUTH if point.type == "switch" else PointType.NUMBER,
        unit=point.unit,
        limits=point.limits,
        part=_REGISTERS,
        of=itemgetter(name),
        write=None if point.access is Access.READ else lambda value: Write(((controller, name, value),)),
    )


def registers_by_controller(table: str, names: Iterable[str], description: Description) -> dict[str, list[str]]:
    """``CONTROLLER.POINT`` by controller, from the key ``registers`` of a table. Raises `Misuse` for a name that is not there."""
    parts = {part.name: part for part in description.controllers}
    found: dict[str, list[str]] = {name: [] for name in parts}
    for name in names:
        controller, _, point = name.partition(".")
        if controller not in parts:
            hint = NearMiss().hint(controller, parts)
            raise Misuse(f"{table}: registers: no controller is called {controller!r}{hint}; expected CONTROLLER.POINT")
        sheet = parts[controller].datasheet
        try:
            sheet.point(point.partition("[")[0])
        except KeyError:
            hint = NearMiss().hint(point.partition("[")[0], [one.path for one in sheet.points])
            raise Misuse(f"{table}: registers: no point is called {name!r}{hint}") from None
        found[controller].append(point)
    return found
