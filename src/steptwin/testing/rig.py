"""What all rigs have in common: time and waiting, faults, what is told when a test fails."""

from __future__ import annotations

import textwrap
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, NamedTuple, NoReturn, Protocol, TypeAlias, TypeVar

import pytest

from steptwin.errors import Misuse
from steptwin.live.lines import ServedLine
from steptwin.machine import SECOND, Event, Nanos
from steptwin.served.faults import FaultDesk
from steptwin.testing.realtime import RealTime, WallTime
from steptwin.testing.virtualtime import VirtualTime
from steptwin.wire.slave import Direction
from steptwin.words.frames import FrameLine
from steptwin.world.kernel import Kernel

T = TypeVar("T")

TOLD = 24
"""So many of the last frames and events are shown when a test fails."""
WIDTH = 200
"""Of the meaning of a frame, there."""
WITHIN_S = 10.0
"""How long `Rig.until` waits, where nothing else is said."""


Time: TypeAlias = VirtualTime | RealTime | WallTime


class FaultSeen(NamedTuple):
    """A fault that is set. ``happened``: how often it has struck."""

    name: str
    fault: str
    happened: int


class Happened(NamedTuple):
    """Something that happened in a twin: ``code`` is stable, ``text`` is for people."""

    time_s: float
    code: str
    text: str

    def __str__(self) -> str:
        return f"{self.time_s:12.6f} s  {self.text}"


class Rig:
    """Base of the rigs. What is said to be *the twin's* skips the test where a device stands in its place (``--device``)."""

    def __init__(self, name: str, time: Time, device: str | None, directory: Path) -> None:
        self._name = name
        self._time = time
        self._device = device
        self._directory = directory
        self._told: deque[object] = deque(maxlen=TOLD)

    @property
    def is_twin(self) -> bool:
        """Whether this is a twin, not a device."""
        return self._device is None

    @property
    def time(self) -> float:
        """Seconds of the twin's clock, which begins at 0; of the wall's where this is a device."""
        return self._time.now() / SECOND

    def sleep(self, seconds: float) -> None:
        """Let time pass, in seconds of the twin: at once in virtual time, with ``speed`` in real time."""
        self._time.sleep(seconds)

    def until(self, condition: Callable[[], object], within_s: float = WITHIN_S, what: str = "") -> None:
        """Let time pass until a condition holds. The test fails where it does not within ``within_s`` seconds of the twin.

        ``what`` says in the message what was waited for.
        """
        __tracebackhide__ = True
        if not self._time.until(condition, within_s):
            pytest.fail(f"after {within_s:g} s not yet: {what or getattr(condition, '__name__', 'the condition')}")

    def later(self, seconds: float, act: Callable[[], object]) -> None:
        """Let something happen by itself in so many seconds of the twin, while a program waits: ``later(0.5, lambda:
        rig.set_pin("IN5", 1))``. ``act`` acts on the twin itself and must not use drivers. The twin's."""
        __tracebackhide__ = True
        if isinstance(self._time, WallTime):
            self.twin_only("later()")
        self._time.later(seconds, act)

    def story(self) -> str:
        """The last frames and events, one in a line."""
        return "\n".join(map(str, self._told))

    def twin_only(self, what: str) -> NoReturn:
        """Skip the test: a device stands where ``what`` would be needed."""
        __tracebackhide__ = True
        pytest.skip(f"{what} is there on a twin only, and --device says {self._device}")

    def begin(self) -> None:
        """Before the test: skip it where a device is not what it is for."""

    def close(self) -> None:
        """After the test."""
        self._time.close()

    def _at_present(self, act: Callable[[Nanos], T]) -> T:
        """Do something with the twin at the present moment, where it may be done."""
        __tracebackhide__ = True
        if isinstance(self._time, WallTime):
            raise TypeError("a device cannot be reached into")
        return self._time.call(act)


class Twins(ServedLine, Protocol):
    """What a rig needs of the controllers on a line."""

    kernel: Kernel
    faults: FaultDesk


L = TypeVar("L", bound=Twins)


class LineRig(Rig, Generic[L]):
    """A rig of one controller on a line; ``line`` is None where it is a device. ``machine`` is its name in the kernel."""

    def __init__(
        self, name: str, time: Time, device: str | None, directory: Path, *, line: L | None, machine: str, twin_only: bool
    ) -> None:
        super().__init__(name, time, device, directory)
        self._line = line
        self._machine = machine
        self._is_twin_only = twin_only
        self._events: list[Happened] = []
        if line is not None:
            line.frames.sinks.append(self._heard)
            line.faults.tell(self._told.append)
            line.watch_events(self._happened)

    def _happened(self, unit: int, event: Event) -> None:
        happened = Happened(event.time / SECOND, getattr(event, "code", ""), event.text)
        self._events.append(happened)
        self._told.append(happened)

    def _heard(self, frame: FrameLine) -> None:
        told = self._told
        told.append(frame)
        last = [one.meaning if isinstance(one, FrameLine) else None for one in list(told)[-4:]]
        if len(last) == 4 and None not in last and last[:2] == last[2:]:
            del told[-4], told[-3]  # the same was asked and answered before: a poll

    def story(self) -> str:
        return "\n".join(_shortened(told) for told in self._told)

    def begin(self) -> None:
        if self._line is None and self._is_twin_only:
            self.twin_only("what this test needs")

    def _on(self, what: str, act: Callable[[L, Nanos], T]) -> T:
        __tracebackhide__ = True
        line = self._line
        if line is None:
            self.twin_only(what)
        return self._at_present(lambda now: act(line, now))

    # ------------------------------------------------------------------ inputs, faults, power

    @property
    def pins(self) -> Mapping[str, float]:
        """The level of every pin: 0 or 1, analog ones in volts. The twin's."""
        __tracebackhide__ = True
        return self._on("pins", lambda line, _: dict(line.kernel.machines[self._machine].pins()))

    def _set_pin(self, pin: str, level: float) -> None:
        __tracebackhide__ = True
        # The kernel's machine has the faults before it: a switch that is stuck stays stuck.
        self._on(f"set_pin({pin!r})", lambda line, now: line.kernel.machines[self._machine].set_pin(pin, level, now))

    @property
    def events(self) -> list[Happened]:
        """What happened in it so far. The twin's."""
        __tracebackhide__ = True
        return self._on("events", lambda _, __: list(self._events))

    # ------------------------------------------------------------------ faults

    def fault(self, *faults: str) -> None:
        """Let something go wrong from now on: ``"no-answer lost=request every=3"``, ``"stuck pin=IN1 value=0 name=kl"``.

        ``steptwin fault --kinds`` lists all of them. Raises `Misuse`. The twin's.
        """
        __tracebackhide__ = True
        self._on("fault()", lambda line, _: line.faults.start(faults, line.faults.faults.seed))

    def clear_faults(self, *names: str) -> None:
        """Let it be well again; without names all of it. Raises `Misuse`. The twin's."""
        __tracebackhide__ = True

        def act(line: L, now: Nanos) -> None:
            faults = line.faults.faults
            for name in names or [active.name for active in faults.active]:
                faults.remove(name, now)

        self._on("clear_faults()", act)

    @property
    def faults(self) -> list[FaultSeen]:
        """The faults that are set, and how often each has struck. The twin's."""
        __tracebackhide__ = True
        return self._on("faults", lambda line, _: [FaultSeen(a.name, str(a.fault), a.struck) for a in line.faults.faults.active])


def _shortened(told: object) -> str:
    if not isinstance(told, FrameLine):
        return str(told)
    arrow = "→" if told.direction is Direction.IN else "←"
    return f"{told.time / SECOND:12.6f} s  {arrow} {textwrap.shorten(told.meaning, WIDTH, placeholder=' …')}"


def options_of(marker: str, kind: type[T], arguments: tuple[Any, ...], given: dict[str, Any]) -> T:
    """The options of a marker. Raises `Misuse` for those that are not there."""
    names = list(kind.__dataclass_fields__)  # type: ignore[attr-defined]
    positional = [name for name, field in kind.__dataclass_fields__.items() if not field.kw_only]  # type: ignore[attr-defined]
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
