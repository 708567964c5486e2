"""The chip's serial port: characters that take their time on the wire, in both directions.

Without line timing a character arrives and leaves at the moment at which it is handed over.
"""

from __future__ import annotations

from collections import deque

from steptwin.controller import SECOND, Nanos
from steptwin.state import Stateful
from steptwin.wire.line import CharacterClock, SerialLine

MOST_WAITING = 1 << 16
"""More characters than this never wait in one place: towards the chip, towards the host, or for a host that does not read."""


class Uart(Stateful):
    """8N1 at the baud rate that was read from the pins. ``sent`` are the characters that have left and were not fetched; of more
    than `MOST_WAITING` the last ones."""

    FIXED = ("_is_timed",)
    __slots__ = (*FIXED, "_arriving", "_incoming", "_leaving", "_outgoing", "overrun", "sent")

    def __init__(self, baud: int, *, is_timed: bool) -> None:
        self._is_timed = is_timed
        self._arriving: deque[tuple[Nanos, int]] = deque()
        self._leaving: deque[tuple[Nanos, int]] = deque()
        self.sent: deque[tuple[Nanos, int]] = deque(maxlen=MOST_WAITING)
        self.overrun = 0
        """Characters that found no room on the line, in either direction."""
        self.set_baud(baud)

    @property
    def baud(self) -> int:
        return self._incoming.line.baud

    @property
    def character_ns(self) -> Nanos:
        """At least so long after one character the next one ends."""
        line = self._outgoing.line
        return line.bits * SECOND // line.baud if self._is_timed else 0

    def set_baud(self, baud: int) -> None:
        """Change the rate. Characters on their way at the old rate are lost."""
        self._incoming = CharacterClock(SerialLine(baud))
        self._outgoing = CharacterClock(SerialLine(baud))
        self.clear()

    def clear(self) -> None:
        self._arriving.clear()
        self._leaving.clear()

    def receive(self, data: bytes, now: Nanos) -> None:
        """Characters are put on the line towards the chip at ``now``, or as soon as it is free."""
        room = MOST_WAITING - len(self._arriving)
        self.overrun += max(0, len(data) - room)
        for byte in data[:room]:
            self._arriving.append((self._incoming.send(1, now) if self._is_timed else now, byte))

    def send(self, byte: int, now: Nanos) -> bool:
        """Put a character on the line towards the host; True if it has left with that."""
        if not self._is_timed:
            self.sent.append((now, byte))
        elif len(self._leaving) < MOST_WAITING:
            self._leaving.append((self._outgoing.send(1, now), byte))
        else:
            self.overrun += 1
        return not self._is_timed

    def arrived(self, now: Nanos) -> int | None:
        """The next character that has arrived by ``now``."""
        if self._arriving and self._arriving[0][0] <= now:
            return self._arriving.popleft()[1]
        return None

    def take_arriving(self) -> bytes:
        """Remove and return the characters that are on their way to the chip."""
        arriving = bytes(byte for _, byte in self._arriving)
        self._arriving.clear()
        return arriving

    def leave(self, now: Nanos) -> bool:
        """Characters whose time is over by ``now`` have been sent; True if there are any."""
        if not self._leaving or self._leaving[0][0] > now:
            return False
        while self._leaving and self._leaving[0][0] <= now:
            self.sent.append(self._leaving.popleft())
        return True

    def take_sent(self) -> list[tuple[Nanos, int]]:
        sent = list(self.sent)
        self.sent.clear()
        return sent

    def arrival(self) -> Nanos | None:
        """When the next character arrives."""
        return self._arriving[0][0] if self._arriving else None

    def all_left(self) -> Nanos | None:
        """When the last character that waits to leave will have left; None if none does."""
        return self._leaving[-1][0] if self._leaving else None

    def departure(self) -> Nanos | None:
        """When the next character has left."""
        return self._leaving[0][0] if self._leaving else None
