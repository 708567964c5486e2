"""Common parts of all rigs: time and waiting, faults, the report of a failed test."""

from __future__ import annotations

import textwrap
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import fields
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, TypeAlias, TypeVar

import pytest

from steptwin.controller import SECOND, Nanos, Port
from steptwin.controllerstate import ControllerState
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.jsonvalues import read
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.live.world_frames import subscribe_to_frames
from steptwin.simulation.describe.generated import LINE
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.records import describe
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, type_of
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.virtualtime import VirtualTime
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from steptwin.campaign.case import Verdict

T = TypeVar("T")
D = TypeVar("D", bound="DataclassInstance")

MOST_SHOWN = 24
"""So many of the last frames and events are shown when a test fails."""
WIDTH = 200
"""Most characters of the meaning of a frame."""
WITHIN_S = 10.0
"""How long `Rig.until` waits, where no other limit is given."""


RigTime: TypeAlias = VirtualTime | RealTime | WallTime


Observe: TypeAlias = Callable[[World, Path], object]
"""Called with the world of a twin before anything happens in it, and with the folder to which names of its files are relative."""


class FaultSeen(NamedTuple):
    """A fault that is set. ``happened``: how often it has made a difference."""

    name: str
    fault: str
    happened: int


class TwinEvent(NamedTuple):
    """Something that happened in a twin: ``code`` is stable, ``text`` describes it."""

    time_s: float
    code: str
    text: str

    def __str__(self) -> str:
        return f"{self.time_s:12.6f} s  {self.text}"


class Rig(ABC):
    """Base of the rigs. What is marked as *the twin's* skips the test where a device replaces it (``--device``)."""

    def __init__(self, name: str, time: RigTime, device: str | None, directory: Path) -> None:
        self._name = name
        self._time = time
        self._device = device
        self._directory = directory
        self._shown: deque[object] = deque(maxlen=MOST_SHOWN)
        self._verdicts: list[Callable[[], Verdict]] = []

    @property
    def time(self) -> float:
        """Seconds of the twin's clock, which begins at 0; of the wall's where this is a device."""
        return self._time.now() / SECOND

    def sleep(self, seconds: float) -> None:
        """Let time advance, in seconds of the twin: immediately in virtual time, with ``speed`` in real time."""
        self._time.sleep(seconds)

    def until(self, condition: Callable[[], object], within_s: float = WITHIN_S, what: str = "") -> None:
        """Wait until a condition is true. The test fails if it is not within ``within_s`` seconds of the twin.

        ``what`` is named in the message.
        """
        __tracebackhide__ = True
        if not self._time.until(condition, within_s):
            pytest.fail(f"after {within_s:g} s not yet: {what or getattr(condition, '__name__', 'the condition')}")

    def later(self, seconds: float, act: Callable[[], object]) -> None:
        """Call a function after so many seconds of the twin, while a program waits: ``later(0.5, lambda:
        rig.set_pin("IN5", 1))``. ``act`` acts on the twin itself and must not use drivers. The twin's."""
        __tracebackhide__ = True
        if isinstance(self._time, WallTime):
            self.twin_only("later()")
        self._time.later(seconds, act)

    def must_hold(self, text: str, name: str = "") -> Callable[[], Verdict]:
        """Watch a property (`steptwin.campaign.properties`) from now on; the test fails if it is violated at its end.

        What is returned gives the verdict so far, with its robustness. Raises `Misuse`. The twin's.
        """
        __tracebackhide__ = True
        from steptwin.campaign.properties import read_property

        watch = self._in_world(lambda world: read_property(text, name).watch(world))

        def verdict() -> Verdict:
            return self._in_world(lambda _: watch.verdict())

        self._verdicts.append(verdict)
        return verdict

    def violated(self) -> list[str]:
        """Which of `must_hold` are violated, and why; each is a line."""
        said = [verdict() for verdict in self._verdicts]
        return [f"property violated: {one.name}: {one.why}" for one in said if not one.holds]

    @abstractmethod
    def _in_world(self, act: Callable[[World], T]) -> T:
        """The result of ``act``, which gets the world while no other thread changes it."""

    def log(self) -> str:
        """The last frames and events, one in a line."""
        return "\n".join(map(str, self._shown))

    def twin_only(self, what: str) -> NoReturn:
        """Skip the test: ``what`` needs a twin, and there is a device."""
        __tracebackhide__ = True
        pytest.skip(f"{what} exists on a twin only, and --device names {self._device}")

    @abstractmethod
    def begin(self) -> None:
        """Skip the test before it begins if the device does not fit its marker."""

    def close(self) -> None:
        """After the test."""
        self._time.close()

    def _at_present(self, act: Callable[[Nanos], T]) -> T:
        """Do something with the twin at the present moment, where it may be done."""
        __tracebackhide__ = True
        if isinstance(self._time, WallTime):
            raise TypeError("a device cannot be reached into")
        return self._time.call(act)


class LineRig(Rig):
    """A rig of one controller on a line, alone in a world; ``live`` is None where it is a device. ``controller`` is its name."""

    def __init__(
        self,
        name: str,
        time: RigTime,
        device: str | None,
        directory: Path,
        *,
        live: LiveWorld | None,
        controller: str,
        twin_only: bool,
    ) -> None:
        super().__init__(name, time, device, directory)
        self._live = live
        self._controller = controller
        self._is_twin_only = twin_only
        self._events: list[TwinEvent] = []
        self._places = count(1)
        if live is not None:
            for record in live.world.trace.events(controller):  # what power-on had to say
                self._happened(record)
            live.world.stop_recording()
            subscribe_to_frames(live, self._log_frame)
            live.world.trace.subscribers.append(self._happened)

    def _happened(self, record: TraceRecord) -> None:
        if record.kind == "event" and record.controller == self._controller:
            happened = TwinEvent(record.time / SECOND, record.subject, str(record.value))
            self._events.append(happened)
            self._shown.append(happened)
        elif record.kind == "fault":
            self._shown.append(describe(record))

    def _log_frame(self, frame: FrameLine) -> None:
        shown = self._shown
        shown.append(frame)
        last = [one.meaning if isinstance(one, FrameLine) else None for one in list(shown)[-4:]]
        if len(last) == 4 and None not in last and last[:2] == last[2:]:
            del shown[-4], shown[-3]  # the same request and answer as before: a poll

    def log(self) -> str:
        return "\n".join(_shortened(item) for item in self._shown)

    def begin(self) -> None:
        if self._live is None and self._is_twin_only:
            self.twin_only("what this test needs")

    def _on(self, what: str, act: Callable[[World], T]) -> T:
        __tracebackhide__ = True
        live = self._live or self.twin_only(what)

        def at(_: Nanos) -> T:
            scheduler = live.world.sync(self._controller)
            try:
                return act(live.world)
            finally:
                scheduler.notify(
                    self._controller
                )  # what acted on the controller itself has changed it behind the scheduler's back
                live.is_dirty = True

        return self._at_present(at)

    def _in_world(self, act: Callable[[World], T]) -> T:
        __tracebackhide__ = True
        return self._on("must_hold()", act)

    def _place(self, link: str, kind: str) -> Port:
        """A place on its line for one more program."""
        live = self._live or self.twin_only("a port")
        return ClientPort(live, LINE, f"{link}-{next(self._places)}", kind)

    # ------------------------------------------------------------------ inputs, faults, power

    def do(self, wanted: Command) -> Any:
        """Do a command (`steptwin.subject.commands`), as over the control endpoint; its answer. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        return self._do(type_of(wanted).name, wanted)

    def _do(self, what: str, wanted: Command) -> Any:
        __tracebackhide__ = True
        live = self._live or self.twin_only(what)
        return self._on(what, lambda _: live.subject.do(wanted).value)

    @property
    def state(self) -> ControllerState:
        """Its status, program, axes, pins and details at present. The twin's."""
        __tracebackhide__ = True
        return read(ControllerState, self._do("state", command.ReadState(self._controller)))

    @property
    def pins(self) -> Mapping[str, float]:
        """The level of every pin: 0 or 1, analog ones in volts. The twin's."""
        __tracebackhide__ = True
        levels: Mapping[str, float] = self._do("pins", command.ReadPins(self._controller))
        return {name.partition(".")[2]: level for name, level in levels.items()}

    def _set_pin(self, pin: str, level: float) -> None:
        __tracebackhide__ = True
        self._do(f"set_pin({pin!r})", do.Set(((self._controller, pin, level),)))

    @property
    def events(self) -> list[TwinEvent]:
        """Its events so far. The twin's."""
        __tracebackhide__ = True
        return self._on("events", lambda _: list(self._events))

    def power_cycle(self) -> None:
        """Switch it off and on again. Connections stay. The twin's."""
        __tracebackhide__ = True
        self._do("power_cycle()", do.PowerCycle(self._controller))

    # ------------------------------------------------------------------ faults

    def fault(self, *faults: str) -> None:
        """Set a fault: ``"no-answer lost=request every=3"``, ``"stuck pin=IN1 value=0 name=kl"``.

        ``steptwin fault --kinds`` lists all of them. Raises `Misuse`. The twin's.
        """
        __tracebackhide__ = True
        for fault in map(read_fault, faults):
            self._do("fault()", do.SetFault(fault))

    def clear_faults(self, *names: str) -> None:
        """Clear faults by name; all without names. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True
        for name in names or [fault.name for fault in self.faults]:
            self._do("clear_faults()", do.ClearFault(name))

    @property
    def faults(self) -> list[FaultSeen]:
        """The faults that are set, and how often each has made a difference. The twin's."""
        __tracebackhide__ = True
        return [FaultSeen(one["name"], one["fault"], one["acted"]) for one in self._do("faults", command.ListFaults())]


def _shortened(item: object) -> str:
    if not isinstance(item, FrameLine):
        return str(item)
    arrow = "→" if item.direction is FrameDirection.IN else "←"
    return f"{item.time / SECOND:12.6f} s  {arrow} {textwrap.shorten(item.meaning, WIDTH, placeholder=' …')}"


def options_of(marker: str, kind: type[D], arguments: tuple[Any, ...], given: dict[str, Any]) -> D:
    """The options of a marker. Raises `Misuse` for those that are not there."""
    names = [field.name for field in fields(kind)]
    positional = [field.name for field in fields(kind) if not field.kw_only]
    if len(arguments) > len(positional):
        raise Misuse(f"@pytest.mark.{marker}: {arguments[len(positional)]!r} needs a name: there are {', '.join(names)}")
    given = dict(zip(positional, arguments, strict=False)) | given
    for name in given:
        if name not in names:
            raise Misuse(f"@pytest.mark.{marker}: no option {name!r}: there are {', '.join(names)}")
    return kind(**given)


def check_time(marker: str, value: str) -> None:
    check_word(marker, "time", value, ("real", "virtual"))


def check_word(marker: str, name: str, value: object, permitted: tuple[str, ...]) -> None:
    if value not in permitted:
        raise Misuse(f"@pytest.mark.{marker}: {name} = {value!r}: permitted are {', '.join(map(repr, permitted))}")
