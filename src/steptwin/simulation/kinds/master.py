"""The Modbus master of a line, shared by all scripts: one request at a time, each after the answer to the previous one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import ClassVar

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.state import Stateful
from steptwin.wire.pdu import REFUSED
from steptwin.wire.rtu import encode_frame

ANSWER_NS: Nanos = SECOND
"""Response time-out of writes; a common setting of masters."""

MOST_WAITING = 10_000
"""Limit of queued requests."""
TOO_MANY_REQUESTS_ARE_QUEUED = Message(
    "simulation.too-many-requests-are-queued", "{most} requests of scripts are queued for this line: it answers too slowly"
)


class Master(Stateful):
    """Sends requests in the order of the calls. They are numbered from 1.

    ``send`` puts a request on the line; its answer may arrive at once or later (`answered`). ``pause``: time between an answer
    and the next request, ns. A request is given up at its time-out.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_pause", "_send")
    __slots__ = (
        *FIXED,
        "_asking",
        "_free",
        "_pending",
        "_queue",
        "answers",
        "asked",
        "finished",
        "refused",
        "unanswered",
        "wanted",
    )

    def __init__(self, send: Callable[[bytes, Nanos], None], pause: Nanos) -> None:
        self._send = send
        self._pause = pause
        self._queue: deque[tuple[bytes, Nanos]] = deque()
        self._asking: bytes = b""
        """The request on the line; empty if there is none."""
        self._pending: Nanos | None = None
        """Time-out of the request on the line; None if there is none."""
        self._free: Nanos = 0
        """Earliest moment of the next request."""
        self.asked = 0
        """Number of the last request that was queued."""
        self.finished = 0
        """Number of the last request that was answered or given up."""
        self.unanswered = 0
        """Number of the last request that was given up."""
        self.refused: tuple[int, bytes] = (0, b"")
        """Number of the last request that was refused, and the frame that refused it."""
        self.wanted: frozenset[int] = frozenset()
        """Numbers of requests whose answers are kept in `answers` until they are taken; may be set in advance."""
        self.answers: dict[int, bytes] = {}

    def ask(self, frame: bytes, within: Nanos, now: Nanos) -> None:
        """Queue a request. ``within``: its response time-out, from the moment at which it is sent.

        Raises `Misuse` if `MOST_WAITING` requests are queued.
        """
        if len(self._queue) >= MOST_WAITING:
            raise Misuse(TOO_MANY_REQUESTS_ARE_QUEUED(most=MOST_WAITING))
        self.asked += 1
        self._queue.append((frame, within))
        self._go_on(now)

    def answered(self, data: bytes, moment: Nanos) -> None:
        """Take data from the line; it is dropped if no request is pending."""
        if self._pending is not None:
            unit, function = self._asking[:2]
            if data == encode_frame(unit, bytes((function | REFUSED, *data[2:3]))):
                self.refused = self.finished + 1, data
            self._finish(data, moment + self._pause)

    def recall(self, is_meant: Callable[[bytes], bool], now: Nanos) -> bool:
        """Give up the requests that ``is_meant`` selects: those that wait are not sent.

        Returns whether the request on the line is one of them; the caller keeps it from being executed.
        """
        self._queue = deque((b"" if not frame or is_meant(frame) else frame, within) for frame, within in self._queue)
        is_on_line = self._pending is not None and is_meant(self._asking)
        if is_on_line:
            self._give_up(now)
        return is_on_line

    def update(self, now: Nanos) -> None:
        if self._pending is not None and self._pending <= now:
            self._give_up(now)
        self._go_on(now)

    def deadline(self) -> Nanos | None:
        return self._pending if self._pending is not None else self._free if self._queue else None

    def _give_up(self, now: Nanos) -> None:
        self.unanswered = self.finished + 1
        self._finish(b"", now)

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
            if not frame:  # recalled
                self._give_up(now)
                continue
            self._asking = frame
            self._pending = now + within
            self._send(frame, now)
