"""The contract between a pure machine and the shell that gives it time.

A machine never reads a clock, a file or a socket. It is told the time and says when it wants to be told next.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol, TypeAlias

Nanos: TypeAlias = int
"""A moment or a duration in whole nanoseconds of virtual time."""

NANOSECOND: Nanos = 1
MICROSECOND: Nanos = 1_000
MILLISECOND: Nanos = 1_000_000
SECOND: Nanos = 1_000_000_000


class Edge(NamedTuple):
    """A pin of a machine took a new value."""

    time: Nanos
    pin: str
    value: float
    """0.0 or 1.0 on digital pins; volts on analog pins."""


class Machine(Protocol):
    """A pure machine in virtual time.

    ``advance(now)`` runs every internal event with time <= now, in order; an input at ``now`` is applied after them.
    ``advance(a); advance(b)`` equals ``advance(b)``. ``deadline()`` after ``advance(now)`` is strictly later than ``now``
    or None. Going back in time raises `steptwin.errors.TimeReversal`.
    """

    def advance(self, now: Nanos) -> None: ...
    def deadline(self) -> Nanos | None: ...


class PinMachine(Machine, Protocol):
    """A machine with named pins.

    Inputs take timestamped changes, outputs give timestamped edges. STEP is never an edge: it stays a profile.
    """

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Apply an input change after everything that happens at ``now``. Unknown names raise with the permitted ones."""
        ...

    def pins(self) -> Mapping[str, float]:
        """Present value of every pin, inputs and outputs."""
        ...

    def take_edges(self) -> list[Edge]:
        """Output edges since the last call, in order."""
        ...


class WirePort(Protocol):
    """The serial or network face of a machine."""

    def receive(self, data: bytes, now: Nanos) -> None: ...
    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]: ...
    def deadline(self) -> Nanos | None: ...
