"""How long characters take on an asynchronous serial line."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.state import Stateful


@dataclass(frozen=True, slots=True)
class SerialLine:
    """An asynchronous line: ``baud`` bit/s and ``bits`` per character with start, parity and stop bits (8N1: 10)."""

    baud: int
    bits: int = 10

    def __post_init__(self) -> None:
        if self.baud < 1:
            raise Misuse(f"baud rate {self.baud} bit/s is not positive")
        if not 7 <= self.bits <= 13:
            raise Misuse(f"a character of {self.bits} bits on the wire is outside 7 to 13")

    def duration(self, characters: int) -> Nanos:
        """Time of that many characters without pause, rounded up to the next nanosecond.

        Rounding happens once: ask for the whole run, do not add durations.
        """
        return -(-characters * self.bits * SECOND // self.baud)

    def characters(self, time: Nanos) -> int:
        """Characters that have begun before ``time`` when the first begins at 0: the least count whose duration reaches it."""
        return (time - 1) * self.baud // (self.bits * SECOND) + 1 if time > 0 else 0


class CharacterClock(Stateful):
    """When the characters of one direction of a line end, however they were handed over.

    What is handed over while the line is busy follows without pause.
    """

    __slots__ = ("_begin", "_count", "end", "line")

    def __init__(self, line: SerialLine) -> None:
        self.line = line
        self.end: Nanos = 0
        """When the last character ends."""
        self._begin: Nanos = 0
        self._count = 0

    def send(self, characters: int, now: Nanos) -> Nanos:
        """Put characters on the line at ``now`` or as soon as it is free; returns when the last one ends."""
        if now >= self.end:
            self._begin, self._count = now, 0
        self._count += characters
        self.end = self._begin + self.line.duration(self._count)
        return self.end

    def end_before(self, characters: int) -> Nanos:
        """When the character ends that is followed by the last ``characters``, as far as they are one run."""
        return self._begin + self.line.duration(max(0, self._count - characters))

    def waiting(self, now: Nanos) -> int:
        """Characters handed over and not yet at their end at ``now``."""
        return self.line.characters(self.end - now)
