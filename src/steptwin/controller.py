"""The contracts of a pure machine with the shell that gives it time and bytes; times, pins and events.

A controller never reads a clock, a file or a socket. Time is an argument, the next deadline a return value.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, TypeAlias, TypeGuard, runtime_checkable

Nanos: TypeAlias = int
"""A moment or a duration in whole nanoseconds of virtual time."""

MICROSECOND: Nanos = 1_000
MILLISECOND: Nanos = 1_000_000
SECOND: Nanos = 1_000_000_000


Fact: TypeAlias = tuple[str, Any]
"""A name and its plain value, such as the number of an axis: a part of the text of an event, for programs."""


class PinEdge(NamedTuple):
    """A pin of a controller took a new value."""

    time: Nanos
    pin: str
    value: float
    """0.0 or 1.0 on digital pins; volts on analog pins."""


class ControllerEvent(Protocol):
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


class Controller(Protocol):
    """A pure machine in virtual time.

    ``advance(now)`` runs every internal event with time <= now, in order; an input at ``now`` is applied after them.
    ``advance(a); advance(b)`` equals ``advance(b)``. ``deadline()`` after ``advance(now)`` is strictly later than ``now``
    or None. Going back in time raises `steptwin.errors.TimeReversal`.
    """

    def advance(self, now: Nanos) -> None: ...
    def deadline(self) -> Nanos | None: ...


class Port(Protocol):
    """The serial or network face of controllers, for one link, connection or program.

    Controllers are at ``now`` in every call.
    """

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
    """Whether a port is a `SendingPort`. `isinstance` would search for every attribute, in each branch of a world."""
    return hasattr(port, "on_output")


@runtime_checkable
class SourcedPort(Port, Protocol):
    """A port for which it matters who uses it."""

    def used_by(self, source: str) -> None:
        """``source``: the program at the other end, as far as the link knows it: an address, the owner of a certificate."""
        ...
