"""The interface of a subject: a description, present values, commands, and events.

There are three: a world in this process (`steptwin.subject.world`), a world in another process (`steptwin.live.remote`), and a
device behind a driver (`steptwin.drivers.subject`). Unknown values have the quality `UNKNOWN`; an unsupported command is a
`Refusal`. Commands raise `Misuse`, `Refusal` or `LineFailure`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.datasheet import Datasheet
from steptwin.jsonvalues import read, to_json
from steptwin.messages import read_message_text, with_messages
from steptwin.subject.commands import VERSION, Command
from steptwin.subject.controls import ControlDescription
from steptwin.subject.events import Event
from steptwin.subject.scene import NO_SCENE, SceneDescription, WorkpieceState
from steptwin.subject.standing import StandingState
from steptwin.subject.subscriptions import Filter, Subscription

GOOD, UNKNOWN = "good", "unknown"


class Reading(NamedTuple):
    """The value of a point at a moment; None if it is unknown or write-only."""

    point: str
    value: float | None
    unit: str
    quality: str = GOOD


class Result(NamedTuple):
    """The result of a command. ``number`` identifies it as the cause of events; ``time``: the moment of execution."""

    value: Any
    time: Nanos
    number: int


@dataclass(frozen=True, slots=True)
class ControllerDescription:
    """A controller. The position of an axis is (pulses of its plan + origin) / ``pulses_per_unit`` of its data sheet."""

    name: str
    datasheet: Datasheet
    line: str | None = None
    unit: int | None = None
    """Slave address, or address of a chip."""
    takes: tuple[ControlDescription, ...] = ()
    """Its commands for controllers, for each axis, with their arguments."""
    is_real: bool = False
    """Whether it is a device behind a driver: its positions come as samples, and it may move something."""
    is_moved: bool = False
    """Whether encoders of it may turn without an event of it: by an axis of another controller, or by a load that its drive
    does not hold."""
    no_twin: str = ""
    """Why a studio can put no twin beside this device; empty if it can while the device is at rest."""

    @property
    def controls(self) -> tuple[str, ...]:
        """The names of these commands: ``enable``, ``jog``."""
        return tuple(dict.fromkeys(one.command for one in self.takes))

    @property
    def points(self) -> tuple[str, ...]:
        """The names of its pins and of its other points."""
        paths = (*(pin.name for pin in self.datasheet.pins), *(point.path for point in self.datasheet.points))
        return tuple(dict.fromkeys(f"{self.name}.{path}" for path in paths))


@dataclass(frozen=True, slots=True)
class SwitchDescription:
    """A switch at an axis: on from ``low`` to ``high``, in units of the axis, and again after each ``period``.

    ``low`` or ``high`` is None if it is unbounded on that side.
    """

    pin: str
    low: float | None
    high: float | None
    period: float | None = None


@dataclass(frozen=True, slots=True)
class MechanicsDescription:
    """The mechanics of an axis of a controller."""

    name: str
    controller: str
    axis: str
    unit: str
    points: tuple[str, ...]
    kind: str = "linear"
    """``linear`` or ``rotary``."""
    travel: tuple[float, float] | None = None
    """Hard stops, in units of the axis."""
    switches: tuple[SwitchDescription, ...] = ()
    pulses_per_unit: float = 1.0
    """Pulses per unit of its drive; negative if positive pulses move it in the negative direction."""
    brake: str | None = None
    """The brake on its motor."""
    pitch: float | None = None
    """mm in a revolution of the motor, of a screw or a belt."""


@dataclass(frozen=True, slots=True)
class SignalDescription:
    """A value of an element that changes, with its unit and range where they are known."""

    name: str
    unit: str
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class DrawingDescription:
    """How an element is drawn: a track of ``length`` from ``low`` on with what moves along it."""

    shape: str
    """``rod``: the place is that of the end of a rod, which comes out of its body at 0. ``belt``: places are those of the fronts
    of workpieces on a belt that moves away from 0. ``slide``: the place is that of a slide on a rail. ``dial``: the place is the
    angle of a hand, ``length`` is a turn. ``plane``: the two places are those of a tool in a plane ``across`` high."""
    length: float
    places: tuple[str, ...]
    """Signals of the element, places on the track in their unit; unknown where there is nothing."""
    size: float
    """Length of a body: it ends so far before its place."""
    switches: tuple[SwitchDescription, ...]
    low: float = 0.0
    across: float = 0.0
    across_low: float = 0.0
    """As ``length`` and ``low``, of the other direction of a plane; the width of a belt."""
    feeds: bool = False
    """Whether workpieces come onto a belt by themselves; they wait before its beginning."""


@dataclass(frozen=True, slots=True)
class ElementDescription:
    """An element around the controllers that is no axis and no button. Its terminals and signals are read as ``NAME.SIGNAL``."""

    name: str
    kind: str
    """The name of its table, such as ``cylinder``."""
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    signals: tuple[SignalDescription, ...]
    """Those that are no terminals."""
    drawing: DrawingDescription | None = None
    function: str | None = None
    """Function among those of its kind: ``and`` of a gate, ``on-delay`` of a timer."""


@dataclass(frozen=True, slots=True)
class ConnectionDescription:
    """One of the sources of an input."""

    source: str
    """An output or terminal (``table.OUT1``, ``cup.held``), a switch of an axis or an element (``x.switch1``), a button, another
    element."""
    target: str
    """An input of a controller or an element: ``table.IN3``, ``cup.ejector``."""
    inverted: bool
    """Whether the input is 0 while the source is 1: an inverted wire, a contact that is normally closed."""
    delay_ns: int
    join: str | None
    """``parallel`` or ``series`` where several contacts share the input."""


@dataclass(frozen=True, slots=True)
class LineDescription:
    """A line with controllers on it."""

    name: str
    kind: str
    baud: int | None
    """None if unknown."""


@dataclass(frozen=True, slots=True)
class Description:
    """The constant description of a subject."""

    name: str
    controllers: tuple[ControllerDescription, ...]
    axes: tuple[MechanicsDescription, ...] = ()
    buttons: tuple[str, ...] = ()
    elements: tuple[ElementDescription, ...] = ()
    connections: tuple[ConnectionDescription, ...] = ()
    lines: tuple[LineDescription, ...] = ()
    commands: tuple[str, ...] = ()
    """Names of the supported commands."""
    scene: SceneDescription = NO_SCENE
    version: int = VERSION

    def to_json(self) -> dict[str, object]:
        """As JSON. Data sheets are in a separate list, because controllers may share them."""
        sheets = {id(part.datasheet): part.datasheet for part in self.controllers}
        numbers = {key: number for number, key in enumerate(sheets)}
        controllers = [
            with_messages(
                {
                    "name": part.name,
                    "datasheet": numbers[id(part.datasheet)],
                    "line": part.line,
                    "unit": part.unit,
                    "controls": part.controls,
                    "takes": [to_json(taken) for taken in part.takes],
                    "real": part.is_real,
                    "moved": part.is_moved,
                    "no_twin": part.no_twin,
                }
            )
            for part in self.controllers
        ]
        sheets_of_all = [to_json(sheet) for sheet in sheets.values()]
        return {**to_json(replace(self, controllers=())), "controllers": controllers, "datasheets": sheets_of_all}


def read_description(data: Mapping[str, Any]) -> Description:
    """The description in JSON. Raises `TypeError`, `ValueError` or `LookupError`."""
    sheets = [read(Datasheet, sheet) for sheet in data["datasheets"]]
    controllers = [
        ControllerDescription(
            one["name"],
            sheets[one["datasheet"]],
            one["line"],
            one["unit"],
            tuple([read(ControlDescription, taken) for taken in one["takes"]]),
            is_real=one["real"],
            is_moved=one["moved"],
            no_twin=read_message_text(one, "no_twin"),
        )
        for one in data["controllers"]
    ]
    return replace(read(Description, {**data, "controllers": ()}), controllers=tuple(controllers))


class Subject(Protocol):
    """Subject of a face, which does not know what is behind it. Commands are answered at once."""

    @property
    def description(self) -> Description: ...

    def read(self, *points: str) -> tuple[Reading, ...]:
        """Present values. `Misuse` for points that are not there."""
        ...

    def do(self, wanted: Command, /) -> Result: ...

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        """Events from now on, at most ``bound`` of them waiting. `Subscription.close` ends it."""
        ...


class PlannedSubject(Subject, Protocol):
    """A world in this process, or what lets its time go on."""

    async def answer(self, wanted: Command, /) -> Result:
        """As `do`, also for commands that are answered later. Awaits only `steptwin.later.Later`."""
        ...

    def plans(self, what: Filter) -> list[Event]:
        """The present plan of every axis that ``what`` selects, as events of now."""
        ...

    def workpieces(self) -> Sequence[WorkpieceState]:
        """Those in space: the same object while none comes or goes, and none is carried by something else."""
        ...

    def standing(self) -> Sequence[StandingState]:
        """Things that stand: programs that wait, alarms, elements, faults that are set."""
        ...


class AsyncSubject(Protocol):
    """A world, devices, or both. Reading returns the values known now; commands may be answered later."""

    @property
    def description(self) -> Description:
        """A new object after devices were connected or disconnected."""
        ...

    def read(self, *points: str) -> tuple[Reading, ...]:
        """The newest known values. Points that are read repeatedly are polled from devices. Raises `Misuse`."""
        ...

    async def do(self, wanted: Command, /) -> Result:
        """Execute a command. Raises `Misuse`, `Refusal`, `LineFailure`."""
        ...

    def subscribe(self, what: Filter, bound: int) -> Subscription: ...

    def plans(self, what: Filter) -> list[Event]:
        """The present plans of axes as events of now, and the newest samples of those that have none."""
        ...
