"""Scripts: sequences of steps that an operator takes. A script is a generator of steps, which are plain values. Their times are
whole nanoseconds: ``Wait(SECOND // 2)``, or ``Wait(duration("500 ms"))`` with `steptwin.durations`.

The result of a step is sent to the generator: for `Read` a number, for `Request` the answer (bytes), for `Until` whether the
condition became true in time. A generator must have no side effects, so that it can be restored by sending it the same results
again. A fixed sequence of steps is a `Walk`, whose state is its place in the sequence.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias, cast

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.fields import CHARACTERS, HEX, TIME, AxisNumber, ControllerName, Meaning, choice, number, whole
from steptwin.messages import Message
from steptwin.simulation.faults import Fault
from steptwin.simulation.script.command import FAULT, LEVELS, UNITS, command
from steptwin.simulation.script.control import Home, Move, Seek

COUPLINGS = ("drive", "free", "blocked")
"""Couplings of an axis's encoder shaft: turned by the drive, free, or blocked together with the drive."""


def _check_ns(value: object) -> None:
    """Raises `Misuse` unless a time is in whole nanoseconds; the rest of the interface takes seconds."""
    if value is not None and (not isinstance(value, int) or isinstance(value, bool) or value < 0):
        raise Misuse(f"{value!r}: steps take whole nanoseconds, such as SECOND // 2, or duration('500 ms')")


@dataclass(frozen=True, slots=True)
class Wait:
    """Wait for a duration, ns."""

    duration: Nanos

    def __post_init__(self) -> None:
        _check_ns(self.duration)


@dataclass(frozen=True, slots=True)
class At:
    """Wait until a moment, ns of the world's time; no wait if it has passed."""

    time: Nanos

    def __post_init__(self) -> None:
        _check_ns(self.time)


@dataclass(frozen=True, slots=True)
class Until:
    """Wait until a condition is true, at most for ``within``. Result: whether it is true."""

    condition: str
    within: Nanos | None = None

    def __post_init__(self) -> None:
        _check_ns(self.within)


@command("set", "Inputs take levels, all of them or none.")
@dataclass(frozen=True, slots=True)
class Set:
    """Set inputs (controller, pin, level): 0, 1 or volts."""

    levels: Annotated[tuple[tuple[str, str, float], ...], Meaning("0, 1, volts.", LEVELS)]


@command("press", "Press a button.")
@dataclass(frozen=True, slots=True)
class Press:
    """Press a button for ``duration``, or until it is released. A later press or release of it cancels the timed release."""

    button: Annotated[str, Meaning("The name of a button.")]
    duration: Annotated[Nanos | None, Meaning("How long; until it is released without.", TIME, unit="ns", name="for_ns")] = None

    def __post_init__(self) -> None:
        _check_ns(self.duration)


@command("release", "Release a button.")
@dataclass(frozen=True, slots=True)
class Release:
    button: Annotated[str, Meaning("The name of a button.")]


@command("put", "Put a workpiece on a conveyor or into a nest: one as it is fed or filled with.")
@dataclass(frozen=True, slots=True)
class Put:
    """Put a new workpiece on a conveyor or into a nest. Refused where there is no room for it."""

    on: Annotated[str, Meaning("The name of a conveyor, or of a nest with the size of its workpieces: into its first free cell.")]
    front: Annotated[
        float | None, Meaning("Of a conveyor: where its front is, from the beginning; 0 without.", number(0.0), unit="mm")
    ] = None


@command("remove", "Take a workpiece away.")
@dataclass(frozen=True, slots=True)
class Remove:
    """Take a workpiece out of the world, from wherever it is."""

    workpiece: Annotated[str, Meaning("The name of a workpiece, such as infeed.3.")]


@command("write", "Registers take values by name, as a Modbus master writes them.")
@dataclass(frozen=True, slots=True)
class Write:
    """Write registers by name (controller, register, value in configured units), as a Modbus master does."""

    values: Annotated[tuple[tuple[str, str, float], ...], Meaning("Registers by CONTROLLER.REGISTER.", LEVELS, unit=UNITS)]


@command("send", "Characters go to a line.")
@dataclass(frozen=True, slots=True)
class Send:
    """Send bytes to a line."""

    line: Annotated[str, Meaning("The name of a line.")]
    data: Annotated[bytes, Meaning("Characters, one byte each.", CHARACTERS, name="text")]


@command(
    "request",
    "A Modbus request on a line.",
    "pdu: that of the answer, null where it has not come at once; a frame event has it then",
)
@dataclass(frozen=True, slots=True)
class Request:
    """Send a Modbus request on a line. Result: the PDU of the answer; b"" if none arrives in time."""

    line: Annotated[str, Meaning("The name of a line.")]
    unit: Annotated[int, Meaning("The slave address.", whole(0, 255))]
    pdu: Annotated[bytes, Meaning("Function code and data.", HEX)]
    within: Annotated[Nanos, Meaning("How long the answer is waited for.", TIME, unit="ns", name="within_ns")] = SECOND

    def __post_init__(self) -> None:
        _check_ns(self.within)


@command("power_cycle", "Switch a controller off and on again.")
@dataclass(frozen=True, slots=True)
class PowerCycle:
    controller: ControllerName


@command("turn", "Turn the encoder shaft of an axis.")
@dataclass(frozen=True, slots=True)
class Turn:
    """Turn the encoder shaft of an axis by counts."""

    controller: ControllerName
    axis: AxisNumber
    counts: Annotated[int, Meaning("By how much.", whole(-(2**31), 2**31 - 1), unit="encoder counts")]


UNKNOWN_COUPLING = Message("simulation.unknown-coupling", "{coupling!r}: an encoder shaft is turned by {names}")


@command("couple", "What turns the encoder shaft of an axis without mechanics.")
@dataclass(frozen=True, slots=True)
class Couple:
    """Choose what turns the encoder shaft of an axis without mechanics: one of `COUPLINGS`."""

    controller: ControllerName
    axis: AxisNumber
    coupling: Annotated[str, Meaning("What turns it.", choice(*COUPLINGS), name="to")]

    def __post_init__(self) -> None:
        if self.coupling not in COUPLINGS:
            raise Misuse(UNKNOWN_COUPLING(coupling=self.coupling, names=list(COUPLINGS)))


@command("fault", "Something goes wrong from now on.", "name")
@dataclass(frozen=True, slots=True)
class SetFault:
    fault: Annotated[Fault, Meaning("Which.", FAULT)]


@command("clear_fault", "Remove a fault.")
@dataclass(frozen=True, slots=True)
class ClearFault:
    name: Annotated[str, Meaning("The name of a fault.")]


@command("expect", "A condition must hold; else that is reported.", "holds")
@dataclass(frozen=True, slots=True)
class Expect:
    """Check a condition; if it is false, it is reported and the run fails."""

    condition: Annotated[str, Meaning("Which.")]


@command("note", "A text for the record.")
@dataclass(frozen=True, slots=True)
class Note:
    """Write a text into the trace."""

    text: Annotated[str, Meaning("The text.")]


@dataclass(frozen=True, slots=True)
class Stop:
    """End the run after all steps of this moment. If the world continues, the next step is due a nanosecond later."""

    reason: str


@dataclass(frozen=True, slots=True)
class Read:
    """Read a signal. Result: its value."""

    signal: str


@dataclass(frozen=True, slots=True)
class Call:
    """Call Python code, which may read and change the world."""

    function: Callable[[], object]


@dataclass(frozen=True, slots=True)
class Order:
    """Command an axis as the master of its controller does, and wait for the answer."""

    command: Move | Home | Seek


@dataclass(frozen=True, slots=True)
class UntilOver:
    """Wait until an axis (from 1) has no motion to a target in progress, at most for ``within``. Result: whether it is so."""

    controller: str
    axis: int
    within: Nanos | None = None

    def __post_init__(self) -> None:
        _check_ns(self.within)


@dataclass(frozen=True, slots=True)
class ExpectReached:
    """Expect that the last motion of an axis (from 1) has come to its target; ``seek``: to the end of this one."""

    controller: str
    axis: int
    seek: Seek | None = None


@dataclass(frozen=True, slots=True)
class Repeat:
    """``is_one``: a description has the steps as one, the first of which has all names."""

    times: int
    steps: tuple[Step, ...]
    is_one: bool = False


Step: TypeAlias = (
    Wait
    | At
    | Until
    | Set
    | Press
    | Release
    | Put
    | Remove
    | Write
    | Send
    | Request
    | PowerCycle
    | Turn
    | Couple
    | SetFault
    | ClearFault
    | Expect
    | Note
    | Stop
    | Read
    | Call
    | Order
    | UntilOver
    | ExpectReached
    | Repeat
)
Steps: TypeAlias = Generator[Step, Any, None]
"""A script in Python: its steps may depend on the results of earlier steps."""


def flat(steps: Iterable[Step]) -> Iterator[Step]:
    """Steps with those that are repeated instead of each `Repeat`, once."""
    for step in steps:
        if isinstance(step, Repeat):
            yield from flat(step.steps)
        else:
            yield step


@dataclass(frozen=True, slots=True)
class _Turn:
    """The first step of a periodic `Walk`: waits for the begin of the next period."""

    begin: Nanos
    period: Nanos


class Walk:
    """Steps in order, repeated ``times`` times; None: without end. It is used like a generator; `place` is its complete state."""

    __slots__ = ("_levels", "_steps", "_times")

    def __init__(self, steps: Iterable[Step | _Turn], times: int | None = 1) -> None:
        self._steps = _without_empty(steps)
        self._times = times
        self._levels = [(self._steps, 0, 0)] if self._steps and times != 0 else []
        """For the walk and each active `Repeat`, outermost first: steps, index of the next one, number of completed passes."""

    @property
    def place(self) -> tuple[tuple[int, int], ...]:
        """For the walk and each active `Repeat`, outermost first: index of the next step, number of completed passes."""
        return tuple((index, done) for _, index, done in self._levels)

    @place.setter
    def place(self, place: tuple[tuple[int, int], ...]) -> None:
        self._levels = []
        for index, done in place:
            steps = self._steps if not self._levels else self._repeat().steps
            self._levels.append((steps, index, done))

    def _repeat(self) -> Repeat:
        """The innermost active `Repeat`."""
        steps, index, _ = self._levels[-1]
        return cast(Repeat, steps[index - 1])

    def __iter__(self) -> Walk:
        return self

    def __next__(self) -> Step:
        return self.send(None)

    def send(self, value: object) -> Step:
        """The next step; the result of the previous one is ignored. Raises `StopIteration` after the last."""
        while self._levels:
            steps, index, done = self._levels.pop()
            if index == len(steps):
                times = self._repeat().times if self._levels else self._times
                if times is None or done + 1 < times:
                    self._levels.append((steps, 0, done + 1))
                continue
            self._levels.append((steps, index + 1, done))
            step = steps[index]
            if isinstance(step, Repeat):
                self._levels.append((step.steps, 0, 0))
            elif isinstance(step, _Turn):
                return At(step.begin + step.period * (done + 1))
            else:
                return step
        raise StopIteration

    def close(self) -> None:
        self._levels = []


def _without_empty(steps: Iterable[Step | _Turn]) -> tuple[Step | _Turn, ...]:
    """Steps without empty repetitions, which could loop without end."""
    kept: list[Step | _Turn] = []
    for step in steps:
        if not isinstance(step, Repeat):
            kept.append(step)
        elif step.times > 0 and (inner := _without_empty(step.steps)):
            kept.append(Repeat(step.times, cast("tuple[Step, ...]", inner)))
    return tuple(kept)


def run_through(steps: Iterable[Step], times: int = 1) -> Walk:
    """The steps in order, repeated ``times`` times."""
    return Walk(steps, times)


def run_every(steps: tuple[Step, ...], period: Nanos, begin: Nanos) -> Walk:
    """The steps at ``begin`` + ``period``, and again after each period."""
    return Walk((_Turn(begin, period), *steps), None)


def run_when(steps: tuple[Step, ...], condition: str, *, once: bool) -> Walk:
    """The steps each time the condition becomes true; ``once``: only the first time."""
    if once:
        return Walk((Until(condition), *steps))
    return Walk((Until(condition), *steps, Until(f"not ({condition})")), None)
