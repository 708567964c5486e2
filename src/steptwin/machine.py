"""The contracts of a pure machine: with the shell that gives it time, the wires at its pins, mechanics, faults and snapshots.

A machine never reads a clock, a file or a socket. Time is an argument, the next deadline a return value.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, TypeGuard, runtime_checkable

if TYPE_CHECKING:
    from steptwin.motion.divisions import Plan

Nanos: TypeAlias = int
"""A moment or a duration in whole nanoseconds of virtual time."""

MICROSECOND: Nanos = 1_000
MILLISECOND: Nanos = 1_000_000
SECOND: Nanos = 1_000_000_000


Fact: TypeAlias = tuple[str, Any]
"""A name and its plain value, such as the number of an axis: a part of the text of an event, for programs."""


class PinEdge(NamedTuple):
    """A pin of a machine took a new value."""

    time: Nanos
    pin: str
    value: float
    """0.0 or 1.0 on digital pins; volts on analog pins."""


class MachineEvent(Protocol):
    """Something that happened in a controller, for traces and for people. Controllers add fields of their own."""

    @property
    def time(self) -> Nanos: ...
    @property
    def code(self) -> str:
        """The kind of event; stable."""
        ...

    @property
    def text(self) -> str: ...
    @property
    def facts(self) -> tuple[Fact, ...]:
        """The contents of the text, for programs."""
        ...


class Machine(Protocol):
    """A pure machine in virtual time.

    ``advance(now)`` runs every internal event with time <= now, in order; an input at ``now`` is applied after them.
    ``advance(a); advance(b)`` equals ``advance(b)``. ``deadline()`` after ``advance(now)`` is strictly later than ``now``
    or None. Going back in time raises `steptwin.errors.TimeReversal`.
    """

    def advance(self, now: Nanos) -> None: ...
    def deadline(self) -> Nanos | None: ...


class Drive(Protocol):
    """An axis of a controller, as its motion is followed."""

    @property
    def plan(self) -> Plan:
        """The source of its pulses, from now on."""
        ...

    @property
    def revision(self) -> int:
        """Counts replacements of ``plan``."""
        ...

    @property
    def is_energised(self) -> bool:
        """Whether its motor has current. A change is followed by `MotionController.changed`."""
        ...

    @property
    def offset_p(self) -> int:
        """The position that the controller shows, less the pulses counted since power-on; 0 where it is not traced."""
        ...


class MotionController(Machine, Protocol):
    """A machine with named pins and axes: the interface of a controller to kernel, mechanics, faults and snapshots.

    Inputs take timestamped changes, outputs give timestamped edges. STEP is never an edge: it stays a plan of its axis.
    """

    changed: Callable[[], None]
    """Hook: called whenever the next deadline, an output or a plan may have changed."""

    @property
    def axes(self) -> Sequence[Drive]:
        """The drives, the same objects throughout."""
        ...

    def advance_to_change(self, until: Nanos) -> Nanos:
        """Advance to the first moment at which an output, a plan or anything else outside a program may have changed, or to
        ``until``; returns that moment.

        Nothing may come in before ``until``: a program that only calculates may have been executed up to there already.
        """
        ...

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Apply an input change after everything that happens at ``now``. Unknown names raise with the permitted ones."""
        ...

    def pins(self) -> Mapping[str, float]:
        """Present value of every pin, inputs and outputs."""
        ...

    def pin(self, name: str) -> float:
        """Present value of one of `pins`."""
        ...

    def take_edges(self) -> list[PinEdge]:
        """Output edges since the last call, in order."""
        ...

    def power_off(self, now: Nanos) -> None:
        """Drives and outputs off. Until `power_cycle` no request or character is given to the controller."""
        ...

    def power_cycle(self, now: Nanos) -> None:
        """Switch off and on again, as after power-on; shafts, the levels at its inputs and stored memory stay as they are."""
        ...

    def snapshot(self) -> Any:
        """All state at the present moment, hooks excepted; it is immutable and can be pickled."""
        ...

    def restore(self, snapshot: Any) -> None:
        """Take the state of a snapshot, its moment too. `steptwin.errors.Misuse` when it is of a different controller."""
        ...


class Port(Protocol):
    """The serial or network face of machines, for one link, connection or program. Machines are at ``now`` in every call."""

    @property
    def broken(self) -> str | None:
        """The reason for which the connection has to be closed, or None. A shell reads it after `exchange`."""
        ...

    def exchange(self, data: bytes, now: Nanos, /) -> bytes:
        """Receive bytes at ``now``; returns the bytes sent at that moment."""
        ...

    def to_send(self, now: Nanos, /) -> list[tuple[Nanos, bytes]]:
        """Further bytes sent until ``now``, with their moments. A shell calls it at every `deadline`."""
        ...

    def deadline(self) -> Nanos | None:
        """The next moment at which there may be bytes to send, if it is known; later than the ``now`` of the last call."""
        ...

    def close(self) -> None:
        """The other end has closed; there are no further calls."""
        ...


class SendingPort(Port, Protocol):
    """A port that also sends without a request: it calls ``on_output`` when there are bytes for `to_send`."""

    @property
    def on_output(self) -> Callable[[], None] | None: ...
    @on_output.setter
    def on_output(self, call: Callable[[], None] | None) -> None: ...


def sends_by_itself(port: Port) -> TypeGuard[SendingPort]:
    """Whether a port is a `SendingPort`. `isinstance` would look at every attribute, in each branch of a world."""
    return hasattr(port, "on_output")


@runtime_checkable
class SourcedPort(Port, Protocol):
    """A port for which it matters who uses it."""

    def used_by(self, source: str) -> None:
        """``source``: the program at the other end, as far as the link knows it: an address, the owner of a certificate."""
        ...
