"""Wires between the pins of a scheduler, and the levels on their way along those with a delay."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse


class PinName(NamedTuple):
    """A pin of a controller, or a terminal of an element."""

    controller: str
    pin: str

    def __str__(self) -> str:
        return f"{self.controller}.{self.pin}"


@dataclass(frozen=True, slots=True)
class Wire:
    """A wire from an output to an input. ``inverted``: the level is inverted; ``delay``: propagation delay, ns."""

    source: PinName
    target: PinName
    inverted: bool = False
    delay: Nanos = 0

    def __post_init__(self) -> None:
        if self.delay < 0:
            raise Misuse(f"wire to {self.target}: a delay of {self.delay} ns is negative")

    def transmitted(self, level: float) -> float:
        """The level at the target for a level of the source."""
        return (0.0 if level else 1.0) if self.inverted else level


class DelayedLevel(NamedTuple):
    """A level that reaches the end of a wire with delay at ``arrival``."""

    arrival: Nanos
    target: PinName
    level: float


class Wires:
    """``drive`` is called with an input and the level that a wire gives it."""

    __slots__ = ("_drive", "_from", "delayed")

    def __init__(self, drive: Callable[[PinName, float], None]) -> None:
        self._drive = drive
        self._from: dict[PinName, list[Wire]] = {}
        self.delayed: list[DelayedLevel] = []
        """Levels that have not arrived yet."""

    def __bool__(self) -> bool:
        return bool(self._from)

    def __iter__(self) -> Iterator[Wire]:
        for wires in self._from.values():
            yield from wires

    def add(self, wire: Wire) -> None:
        self._from.setdefault(wire.source, []).append(wire)

    def transmit(self, source: PinName, level: float, now: Nanos) -> None:
        """An output has another level, or its first one."""
        for wire in self._from.get(source, ()):
            if wire.delay:
                self.delayed.append(DelayedLevel(now + wire.delay, wire.target, wire.transmitted(level)))
            else:
                self._drive(wire.target, wire.transmitted(level))

    def arrive(self, now: Nanos) -> None:
        """Drive the targets of delayed levels that are due."""
        arrived = [one for one in self.delayed if one.arrival <= now]
        self.delayed = [one for one in self.delayed if one.arrival > now]
        for one in arrived:
            self._drive(one.target, one.level)

    def next_arrival(self) -> Nanos | None:
        return min(self.delayed).arrival if self.delayed else None
