"""A device behind a driver as a subject (`steptwin.subject.contract`): the same commands, points and events as a twin has.

with Mic488("/dev/ttyUSB0", config="machine.cfg") as mic:
    subject = mic.subject("table")
    subject.do(Move("table", 1, to=20.0))

Drivers execute the commands, with their own safety (ADR 12). Values that no register or command shows have the quality
`UNKNOWN`. Commands for twins only (pins, faults, time, power) raise `Refusal`. Events come from polling, and only while there
are subscribers.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from enum import Enum
from types import TracebackType
from typing import Any, Protocol, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.controllerstate import ControllerState, parts_of
from steptwin.datasheet import Datasheet
from steptwin.diagnostics import SourceText
from steptwin.drivers.blocking import Blocking, blocking, finish
from steptwin.drivers.line import DriverLine
from steptwin.drivers.lineframes import FRAMES, LineFrames, SeenFrame
from steptwin.errors import Misuse, Refusal
from steptwin.jsonvalues import to_json
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.simulation.script import steps
from steptwin.subject import commands as command
from steptwin.subject.commands import COMMANDS, Command, type_of
from steptwin.subject.contract import GOOD, UNKNOWN, ControllerDescription, Description, LineDescription, Reading, Result
from steptwin.subject.controls import controls_of
from steptwin.subject.devicetwin import DeviceTwin
from steptwin.subject.events import Event, Numbering
from steptwin.subject.payloads import FramePayload, Payload, SamplePayload
from steptwin.subject.subscriptions import EventBatch, Filter, Subscription, Subscriptions

PERIOD_S = 0.2
PERIODS_S = (0.02, 60.0)
CLIENT = "steptwin"
"""The only client of a device whose frames are seen."""
DeviceAction: TypeAlias = Callable[[Any], Awaitable[object]]
ValueAndUnit: TypeAlias = tuple[float | None, str]
"""The value of a point, None if unknown; and its unit."""


class RawEffect(Enum):
    """Effect of a raw request, or of a write of registers."""

    LOOK = "look"
    WRITE = "write"
    STOP = "stop"


class DevicePart(Protocol):
    """One controller behind an open driver."""

    @property
    def line(self) -> DriverLine[Any, Any]: ...

    @property
    def line_kind(self) -> str: ...

    @property
    def address(self) -> int | None:
        """The address on its line; None for a single chip."""
        ...

    @property
    def datasheet(self) -> Datasheet:
        """The data sheet, with axes in the units of the driver."""
        ...

    async def values(self, points: Sequence[str]) -> Mapping[str, ValueAndUnit]:
        """The values by name. Raises `Misuse` for an unknown point."""
        ...

    async def state(self) -> ControllerState:
        """Its present state, as of a twin; what no exchange shows is None."""
        ...

    @property
    def answers_in_motion(self) -> bool:
        """Whether its values are known while it moves."""
        ...

    async def reconnect(self) -> None:
        """After the line was lost: whether the same device is there. Raises `LineFailure`, and `Refusal` for another one."""
        ...

    def unit_of(self, point: str) -> str:
        """The unit of a point. Raises `Misuse` for an unknown point."""
        ...

    def selected(self, data: bytes) -> int | None:
        """The address on the line that characters begin with selecting; None without one."""
        ...

    def effect_of(self, wanted: steps.Request | steps.Write) -> RawEffect:
        """Effect of a raw request, of which nothing else is known, or of a write of registers. Raises `Misuse` for an unknown
        register."""
        ...

    def ended_by(self, wanted: steps.Request | steps.Write) -> frozenset[int]:
        """Motions that it ends if it is a stop: numbers of axes, 0 for the program. Raises `Misuse` for an unknown register."""
        ...

    async def ignoring(self, request: steps.Request) -> frozenset[int]:
        """The axes that ignore the motions of a raw request now, because their drives are off. None for a request that cannot be
        decoded. Raises `LineFailure`, `Refusal`."""
        ...

    def actions(self) -> Mapping[type, DeviceAction]:
        """The commands that the device can execute; names of controller and line have been checked."""
        ...

    async def look(self, kinds: frozenset[str]) -> list[Payload]:
        """The changes since the last call, and samples, of the wanted kinds."""
        ...

    def unknown(self) -> list[SamplePayload]:
        """A sample for each axis that says that nothing is known of it."""
        ...

    def forget(self) -> None:
        """Forget the last call of `look`: the next one gives samples of all axes."""
        ...

    def dead_man_jog(self, wanted: command.Jog) -> DeviceJog:
        """A jog of bounded motions that lasts while it is held. Raises `Misuse`."""
        ...

    async def settings_text(self) -> str:
        """Settings that can be read and written, as JSON, to keep them before they are changed."""
        ...

    def configuration(self) -> SourceText | None:
        """The configuration file that the user has named; None without one. It may block. Raises `Misuse`."""
        ...

    @property
    def no_twin(self) -> str:
        """Why there can be no twin of it; empty if there can be one while it is at rest."""
        ...

    async def twin(self, name: str) -> DeviceTwin:
        """A twin called ``name``. Raises `Refusal` where there can be none, or not now."""
        ...


class DeviceJog(Protocol):
    """A jog that has to be held: ``async with jog: while ...: await jog.hold()``. At the end of the block the axis brakes."""

    @property
    def end(self) -> object:
        """Why the axis has stopped, as text; None while it runs."""
        ...

    async def __aenter__(self) -> object: ...

    async def hold(self) -> bool:
        """The axis runs on for a short time, after which this returns; False when it has stopped. It may be cancelled."""
        ...

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None, /
    ) -> None: ...


WRONG_PERIOD = Message("drivers.wrong-period", "period_s = {period_s:g}: permitted are {least:g} to {most:g} s")
UNKNOWN_OWNER = Message("drivers.unknown-owner", "nothing is called {owner!r}{hint}; there are {name}, time")
COMMAND_IS_NOT_POSSIBLE = Message(
    "drivers.command-is-not-possible", "{command} is not possible for this device ({place}); possible are {names}"
)
UNKNOWN_NAME = Message("drivers.unknown-name", "no {what} is called {name!r}{hint}; there are {there}")


class AsyncDeviceSubject:
    """The controller ``name`` as a subject. Other programs may drive it over the same line. `poll` makes the events; `run`
    polls repeatedly.

    Times begin with the subject, or are those of ``clock``; subjects that are shown together share a ``numbering``. An event has
    a cause only if a command leads to it at once.
    """

    def __init__(
        self,
        name: str,
        device: DevicePart,
        period_s: float = PERIOD_S,
        *,
        clock: Callable[[], Nanos] | None = None,
        numbering: Numbering | None = None,
    ) -> None:
        if not PERIODS_S[0] <= period_s <= PERIODS_S[1]:
            raise Misuse(WRONG_PERIOD(period_s=period_s, least=PERIODS_S[0], most=PERIODS_S[1]))
        self.name = name
        self.period_ns: Nanos = round(period_s * SECOND)
        self._device = device
        self._line = device.line
        begin = self._line.now()
        self.now = (lambda: self._line.now() - begin) if clock is None else clock
        """The present moment, ns."""
        self._actions: dict[type, DeviceAction] = {
            **device.actions(),
            command.Describe: self._describe,
            command.ReadPoints: self._read,
            command.ReadPins: self._pins,
            command.ReadState: self._state,
            command.Time: self._time,
        }
        self.description = self._described()
        self._end_frames: Callable[[], None] | None = None
        self.subscribers = Subscriptions(self._subscribe_to_frames)
        self._numbering = Numbering({}) if numbering is None else numbering
        self._samples: dict[str, Event] = {}

    def _described(self) -> Description:
        place = self._line.place
        sheet = self._device.datasheet
        controls, no_twin = controls_of(sheet, self._actions), self._device.no_twin
        controller = ControllerDescription(self.name, sheet, place, self._device.address, controls, is_real=True, no_twin=no_twin)
        names = tuple(row.name for row in COMMANDS.values() if row.kind in self._actions)
        return Description(
            self.name, (controller,), lines=(LineDescription(place, self._device.line_kind, None),), commands=names
        )

    # ------------------------------------------------------------------ what a subject is

    async def read(self, *points: str) -> tuple[Reading, ...]:
        """Read points, in as few exchanges as possible."""
        paths = {point: self._path(point) for point in points if point != "time"}
        values = await self._device.values(tuple(dict.fromkeys(paths.values()))) if paths else {}
        found: dict[str, ValueAndUnit] = {point: values[path] for point, path in paths.items()}
        found["time"] = self.now() / SECOND, "s"
        return tuple(Reading(point, *found[point], UNKNOWN if found[point][0] is None else GOOD) for point in points)

    def unit_of(self, point: str) -> str:
        """The unit of a point, without asking the device. Raises `Misuse` for an unknown one."""
        return "s" if point == "time" else self._device.unit_of(self._path(point))

    def _path(self, point: str) -> str:
        owner, _, path = point.partition(".")
        if owner != self.name:
            raise Misuse(UNKNOWN_OWNER(owner=owner, hint=NearMiss().hint(owner, (self.name,)), name=self.name))
        return path

    async def do(self, wanted: Command) -> Result:
        """Raises `Misuse`, `Refusal`, `LineFailure`."""
        action = self._actions.get(type(wanted))
        if action is None:
            raise Refusal(
                COMMAND_IS_NOT_POSSIBLE(
                    command=type_of(wanted).name, place=self._line.place, names=list(self.description.commands)
                )
            )
        self._check_names(wanted)
        number = self._numbering.command(self.now())
        try:
            value = await action(wanted)
        finally:
            self._numbering.done()
        return Result(value, self.now(), number)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self.subscribers.subscribe(what, bound)

    async def poll(self) -> None:
        """Poll once, if there are subscribers, and make events of the changes. Raises `LineFailure`."""
        if self.subscribers.all:
            for payload in await self._device.look(self.subscribers.kinds):
                self.publish(payload)

    def publish(self, payload: Payload) -> None:
        """Send subscribers an event of now."""
        event = self._numbering.event(self.now(), self.name, payload)
        if type(payload) is SamplePayload:
            self._samples[payload.axis] = event
        self.subscribers.publish(event)

    def _subscribe_to_frames(self) -> None:
        """Observe the frames of the device while somebody subscribes to them."""
        frames: LineFrames | None = self._line.shared.get(FRAMES)
        is_wanted = "frame" in self.subscribers.kinds
        if is_wanted and self._end_frames is None and frames is not None:
            self._end_frames = frames.subscribe(self._framed)
        elif not is_wanted and self._end_frames is not None:
            self._end_frames()
            self._end_frames = None

    def _framed(self, seen: SeenFrame) -> None:
        if seen.device == self._device.address:
            payload = FramePayload(CLIENT, seen.direction.value, seen.raw, seen.meaning)
            self.subscribers.publish(self._numbering.event(self.now(), self._line.place, payload))

    def samples(self) -> list[Event]:
        """The newest sample of each axis that there is one of."""
        return list(self._samples.values())

    def forget(self) -> None:
        """Nothing is known of the device until it is polled again."""
        for payload in self._device.unknown():
            self.publish(payload)
        self._device.forget()

    async def run(self) -> None:
        """Poll until cancelled. Raises `LineFailure`."""
        while True:
            await self.poll()
            await self._line.sleep(self.period_ns / SECOND)

    # ------------------------------------------------------------------ commands

    def _check_names(self, wanted: Command) -> None:
        """Check the names of controllers and lines in a command."""
        for field in type_of(wanted).fields:
            value: Any = getattr(wanted, field.key)
            if field.name == "controller":
                self._check_name("controller", value, self.name)
            elif field.name == "line":
                self._check_name("line", value, self._line.place)
            elif field.name == "values":
                for controller, _, _ in value:
                    self._check_name("controller", controller, self.name)

    def _check_name(self, what: str, name: str | None, there: str) -> None:
        if name is not None and name != there:
            raise Misuse(UNKNOWN_NAME(what=what, name=name, hint=NearMiss().hint(name, (there,)), there=there))

    async def _describe(self, _: command.Describe) -> object:
        return self.description.to_json()

    async def _read(self, wanted: command.ReadPoints) -> object:
        return [reading._asdict() for reading in await self.read(*wanted.points)]

    async def _pins(self, _: command.ReadPins) -> object:
        pins = (f"{self.name}.{pin.name}" for pin in self._device.datasheet.pins)
        return {one.point: one.value for one in await self.read(*pins)}

    async def _state(self, wanted: command.ReadState) -> object:
        found = await self._device.state()
        return to_json(found) if wanted.parts is None else parts_of(found, self._device.datasheet, wanted.parts)

    async def _time(self, _: command.Time) -> object:
        now = self.now()
        return {"world": self.name, "time_ns": str(now), "time_s": now / SECOND, "paused": False, "speed": 1.0, "stopped": None}


class DeviceSubject(Blocking):
    """The same for threads: a `Subject`. Taking events polls the device, at most once per period."""

    _driver: AsyncDeviceSubject

    @property
    def description(self) -> Description:
        return self._driver.description

    read = blocking(AsyncDeviceSubject.read)
    do = blocking(AsyncDeviceSubject.do)

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        subscription = _Polled(self._driver, what, bound)
        finish(self._driver.poll())  # changes are changes from now on
        return subscription


class _Polled(Subscription):
    """Events of a device, which is polled when they are taken."""

    __slots__ = ("_due", "_subject")

    def __init__(self, subject: AsyncDeviceSubject, what: Filter, bound: int) -> None:
        super().__init__(what, bound, subject.subscribers.remove)
        self._subject = subject
        self._due = subject.now() + subject.period_ns
        subject.subscribers.add(self)

    def take(self, most: int | None = None) -> EventBatch:
        now = self._subject.now()
        if now >= self._due:
            self._due = now + self._subject.period_ns
            finish(self._subject.poll())
        return super().take(most)
