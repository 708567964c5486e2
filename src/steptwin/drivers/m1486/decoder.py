"""The traffic between a host and M1486 chips, for `steptwin sniff`."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable

from steptwin.controller import MILLISECOND, Nanos
from steptwin.m1486.characterlog import REPORTS, CharacterLog, LineSplitter, uploaded
from steptwin.m1486.receiver import CR, EMPTY, THREE_FREE
from steptwin.m1486.variants import variant
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

QUIET_NS: Nanos = 100 * MILLISECOND
"""Silence that ends a group of bytes from the chips, ns; an echo does not come after it."""
_TYPE = 20
"""The number of ``U`` for the type letter."""
_SWITCH = re.compile(rb"\s*([TtCc])\s*57\s*\r")
MOST_TYPED = 4096
"""Most characters whose echo is expected: far more than an input buffer holds."""


class M1486Decoder:
    """Decodes commands and answers of M1486 chips. On one wire all bytes are decoded as commands.

    The bytes of the chips carry no type. Bytes that repeat the characters sent, in order and up to the CR, are their echo
    (function 41); other bytes after a command U are its upload.
    """

    def __init__(self, sink: Callable[[FrameLine], None], kind: str) -> None:
        self._sink = sink
        self._log = CharacterLog(variant(kind))
        self._log.sinks.append(self._observe)
        self._lines = LineSplitter(self._log, "")
        self._typed: deque[int] = deque(maxlen=MOST_TYPED)  # whose echo may follow
        self._count = 0  # of all characters typed
        self._uploads: deque[tuple[int, int]] = deque()  # numbers, with the count of characters up to their CR
        self._repeated = b""  # received bytes that match the echo so far
        self._repeated_ns: Nanos = 0
        self._last_ns: Nanos = 0  # of all bytes
        self._echoes = False  # whether the line before came back whole
        self._reports = False  # whether function 57 seems to be ON
        self._is_reported = False  # whether a report has come since the last upload

    def _observe(self, line: FrameLine) -> None:
        upload = re.match(rb"\s*[Uu]\s*(\d+)\s*\r", line.raw) if line.direction is FrameDirection.IN else None
        if upload is not None:
            self._uploads.append((int(upload[1]), self._count))
        switch = _SWITCH.match(line.raw) if line.direction is FrameDirection.IN else None
        if switch is not None:
            self._reports = switch[1] in b"Tt"
        self._sink(line)

    def feed(self, data: bytes, now: Nanos, direction: FrameDirection | None) -> None:
        if direction is FrameDirection.IN and now - self._last_ns >= QUIET_NS and not self._repeated:
            self._typed.clear()  # typed while function 41 was OFF
        self._last_ns = now
        for byte in data:
            if direction is FrameDirection.OUT:
                self._received(byte, now)
                continue
            if direction is FrameDirection.IN:
                self._typed.append(byte)
                self._count += 1
            self._lines.take(bytes((byte,)), now)

    def _is_report(self, byte: int) -> bool:
        """Whether a byte is a report of function 57, which comes before what is uploaded; 7FH may be either."""
        if byte not in (EMPTY, THREE_FREE) or self._is_reported or not self._uploads:
            return False
        self._reports |= self._uploads[0][0] == _TYPE  # no letter of a type
        self._is_reported = self._reports
        return self._reports

    def _received(self, byte: int, now: Nanos) -> None:
        if self._is_report(byte):
            self._log.sent(now, byte)
            return
        if not self._uploads and byte in self._typed:
            while byte != self._typed[0]:
                self._typed.popleft()  # typed before function 41 was ON
        if self._typed and byte == self._typed[0]:
            self._typed.popleft()
            self._repeated += bytes((byte,))
            self._repeated_ns = now
            if byte == CR:
                self._echoes = True
                self._is_echo()
            return
        if self._uploads and self._echoes:
            self._is_upload(byte, now)  # it comes between the characters of an echo
            return
        self._settle()
        if self._uploads:
            self._is_upload(byte, now)
        elif self._typed and byte not in REPORTS and byte < 0x80:
            typed = chr(self._typed.popleft())
            meaning = f"{chr(byte)!r} where {typed!r} was typed: a garbled echo, or that of several chips at once"
            self._sink(FrameLine(now, "", FrameDirection.OUT, bytes((byte,)), meaning))
        else:
            self._log.sent(now, byte)

    def _settle(self) -> None:
        """End the comparison with the characters sent."""
        if self._uploads:
            self._echoes = False
            for byte in self._repeated:
                self._is_upload(byte, self._repeated_ns)
            self._repeated = b""
        elif self._repeated:
            self._is_echo()

    def _is_echo(self) -> None:
        echo, self._repeated = self._repeated, b""
        self._sink(FrameLine(self._repeated_ns, "", FrameDirection.OUT, echo, f"echo of {echo.decode('latin-1')!r}"))

    def _is_upload(self, byte: int, now: Nanos) -> None:
        if not self._uploads:
            self._log.sent(now, byte)
            return
        number, count = self._uploads.popleft()
        self._is_reported = False
        while len(self._typed) > self._count - count:
            self._typed.popleft()  # an echo would have come before
        meaning = uploaded(number, byte)
        self._sink(FrameLine(now, "", FrameDirection.OUT, bytes((byte,)), meaning))

    def deadline(self) -> Nanos | None:
        return self._repeated_ns + QUIET_NS if self._repeated else None

    def expire(self, now: Nanos) -> None:
        if self._repeated and now >= self._repeated_ns + QUIET_NS:
            self._settle()
