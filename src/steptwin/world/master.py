"""The master of a Modbus line that scripts share: one request at a time, the next one after the answer to the one before."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import ClassVar

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.state import Stateful

ANSWER_NS: Nanos = SECOND
"""How long a write waits for its answer, which is what masters are commonly set to."""

MOST_WAITING = 10_000
"""Requests that wait for those before them."""


class Master(Stateful):
    """Sends requests in the order of the calls. They are numbered from 1.

    ``send`` puts a request on the line; its answer may come at once or later (`answered`). ``pause`` passes between an answer and
    the next request. A request without an answer in its time is given up.
    """

    __slots__ = ("_free", "_pause", "_pending", "_queue", "_send", "answers", "asked", "finished", "unanswered", "wanted")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_pause", "_send"})

    def __init__(self, send: Callable[[bytes, Nanos], None], pause: Nanos) -> None:
        self._send = send
        self._pause = pause
        self._queue: deque[tuple[bytes, Nanos]] = deque()
        self._pending: Nanos | None = None
        """Until when the request on the line has time to be answered."""
        self._free: Nanos = 0
        """From when on the next one may go."""
        self.asked = 0
        """How many requests there were so far."""
        self.finished = 0
        """The last one that was answered or given up."""
        self.unanswered = 0
        """The last one that was given up."""
        self.wanted: frozenset[int] = frozenset()
        """Numbers of requests, also to come, whose answers are to be kept until they are taken from `answers`."""
        self.answers: dict[int, bytes] = {}

    def ask(self, frame: bytes, within: Nanos, now: Nanos) -> None:
        """Send a request when those before it are finished; it has ``within`` from then on to be answered.

        `Misuse` when `MOST_WAITING` requests wait already.
        """
        if len(self._queue) >= MOST_WAITING:
            raise Misuse(f"{MOST_WAITING} requests of scripts wait for this line already: it answers more slowly than they come")
        self.asked += 1
        self._queue.append((frame, within))
        self._go_on(now)

    def answered(self, data: bytes, moment: Nanos) -> None:
        """Data has arrived from the line. Without a pending request it is dropped."""
        if self._pending is not None:
            self._finish(data, moment + self._pause)

    def look(self, now: Nanos) -> None:
        if self._pending is not None and self._pending <= now:
            self.unanswered = self.finished + 1
            self._finish(b"", now)
        self._go_on(now)

    def deadline(self) -> Nanos | None:
        return self._pending if self._pending is not None else self._free if self._queue else None

    def _finish(self, answer: bytes, free: Nanos) -> None:
        self.finished += 1
        self._pending = None
        self._free = free
        if self.finished in self.wanted:
            self.wanted -= {self.finished}
            self.answers[self.finished] = answer

    def _go_on(self, now: Nanos) -> None:
        while self._pending is None and self._queue and self._free <= now:
            frame, within = self._queue.popleft()
            self._pending = now + within
            self._send(frame, now)
