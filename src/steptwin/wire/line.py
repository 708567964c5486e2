"""Duration of characters on an asynchronous serial line."""

from __future__ import annotations

from dataclasses import dataclass

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
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
        """Duration of ``characters`` without pause, rounded up to the next nanosecond.

        Durations are not to be added, since each is rounded: the duration of a run is that of all its characters.
        """
        return -(-characters * self.bits * SECOND // self.baud)

    def characters(self, time: Nanos) -> int:
        """Characters that have begun before ``time`` when the first begins at 0: the least count whose duration reaches it."""
        return (time - 1) * self.baud // (self.bits * SECOND) + 1 if time > 0 else 0


class CharacterClock(Stateful):
    """The ends of the characters in one direction of a line, independent of the pieces in which they are sent.

    Characters that are sent while the line is busy follow without pause.
    """

    __slots__ = ("_begin", "_count", "end", "line")

    def __init__(self, line: SerialLine) -> None:
        self.line = line
        self.end: Nanos = 0
        """The end of the last character."""
        self._begin: Nanos = 0
        self._count = 0

    def send(self, characters: int, now: Nanos) -> Nanos:
        """Send characters from ``now`` on, or as soon as the line is free. Returns the end of the last one."""
        if now >= self.end:
            self._begin, self._count = now, 0
        self._count += characters
        self.end = self._begin + self.line.duration(self._count)
        return self.end

    def end_before(self, characters: int) -> Nanos:
        """The end of the character before the last ``characters``; the beginning of the run if it has no more than these."""
        return self._begin + self.line.duration(max(0, self._count - characters))

    def waiting(self, now: Nanos) -> int:
        """Number of characters whose end is later than ``now``."""
        return self.line.characters(self.end - now)
