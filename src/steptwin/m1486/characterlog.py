"""Characters on the line of M1486 chips in words: commands as a host types them, and what the chips send."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable

from steptwin.controller import Nanos
from steptwin.m1486.commands import UNITS, ArgType, find, grouped
from steptwin.m1486.receiver import CR, EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.registers import UPLOADS
from steptwin.m1486.syntax import ChipCommand, JumpCondition, parse_line
from steptwin.m1486.variants import Variant
from steptwin.messages import Message, MessageText
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection

RESERVED = Message("m1486.reserved", "reserved")
UPLOADED = Message("m1486.uploaded", "U{number} {what} = {byte}")
INVERTED = Message("m1486.inverted", "{char!r} inverted: it took one of the last three places of the input buffer")
ECHO = Message("m1486.echo", "echo of {char!r}")
ENDED_BY_LINE_FEED = Message("m1486.ended-by-line-feed", "{count} characters without CR: a line feed ends no command")
WITHOUT_CR = Message("m1486.without-cr", "{count} characters without CR")
COMMAND = Message("m1486.command", "{command}  {text}")
A_COMMENT = Message("m1486.a-comment", "a comment")
AN_EMPTY_LINE = Message("m1486.an-empty-line", "an empty line")
IF = {
    (True, True): Message("m1486.if-line-is-high", "If line {number} is high go to {label}"),
    (True, False): Message("m1486.if-line-is-low", "If line {number} is low go to {label}"),
    (False, True): Message("m1486.if-flag-is-high", "If flag {number} is high go to {label}"),
    (False, False): Message("m1486.if-flag-is-low", "If flag {number} is low go to {label}"),
}
"""By whether it asks a line, and for high."""
WITH_VARIABLE = Message("m1486.with-variable", "with the internal variable as number")
OUT_OF_RANGE = Message("m1486.out-of-range", "out of range")
WITH_NUMBER = Message("m1486.with-number", "{name} {number} {unit}")
UPLOAD = "U"
LONGEST_LINE = 256
"""More characters than this without CR are logged as an incomplete line."""
_HAS_LINES = re.compile(rb"\S[^\n]*\n[^\n]*\S[^\n]*\n")
"""Two lines that end with line feeds alone."""
UPLOADS_WAITING = 1000
"""Bytes announced and not seen on the line: they may have been lost there."""

REPORTS = {
    NO_ROOM: Message("m1486.no-room", "no room in the input buffer: a character is lost")(),
    EMPTY: Message("m1486.buffer-is-empty", "the input buffer is empty")(),
    THREE_FREE: Message("m1486.three-places-are-free", "three places are free in the input buffer")(),
}
"""Bytes that chips send without a request."""


class CharacterLog:
    """Describes characters in words for ``sinks``. The line to the host is shared, so its bytes are logged once."""

    def __init__(self, variant: Variant) -> None:
        self._variant = variant
        self._uploads: deque[tuple[int, MessageText]] = deque(maxlen=UPLOADS_WAITING)
        self.sinks: list[Callable[[FrameLine], None]] = []

    def upload(self, command: int, byte: int) -> None:
        """Note the byte that a chip sends for ``U<command>``; it arrives on the line later."""
        self._uploads.append((byte, uploaded(command, byte)))

    def received(self, now: Nanos, link: str, raw: bytes) -> None:
        """Log a line that a host has sent, up to CR."""
        self._report(FrameLine(now, link, FrameDirection.IN, raw, _typed(raw, self._variant)))

    def sent(self, now: Nanos, byte: int) -> None:
        self._report(FrameLine(now, "line", FrameDirection.OUT, bytes((byte,)), self._sent(byte)))

    def _sent(self, byte: int) -> MessageText:
        upload = next((i for i, (announced, _) in enumerate(self._uploads) if announced == byte), None)
        if upload is not None:
            for _ in range(upload):
                self._uploads.popleft()  # lost on the line
            return self._uploads.popleft()[1]
        if byte in REPORTS:
            return REPORTS[byte]
        if byte > 0x7F:
            return INVERTED(char=chr(~byte & 0xFF))
        return ECHO(char=chr(byte))

    def _report(self, line: FrameLine) -> None:
        for sink in self.sinks:
            sink(line)


class LineSplitter:
    """Cuts the characters of one program into lines for the log."""

    def __init__(self, log: CharacterLog, link: str) -> None:
        self._log = log
        self._link = link
        self._begun = b""

    def take(self, data: bytes, now: Nanos) -> None:
        *lines, self._begun = (self._begun + data).split(b"\r")
        for line in lines:
            self._log.received(now, self._link, line + b"\r")
        if len(self._begun) > LONGEST_LINE or _has_lines(self._begun):
            self._log.received(now, self._link, self._begun)
            self._begun = b""


def _has_lines(raw: bytes) -> bool:
    """Whether the first characters have two lines that end with line feeds alone."""
    return raw.count(b"\n", 0, LONGEST_LINE) > 1 and _HAS_LINES.search(raw[:LONGEST_LINE]) is not None


def uploaded(number: int, byte: int) -> MessageText:
    """The byte that a chip sends for a command ``U``."""
    return UPLOADED(number=number, what=UPLOADS.get(number) or RESERVED(), byte=byte)


def _typed(raw: bytes, variant: Variant) -> MessageText:
    text = raw.decode("latin-1").strip()
    if raw[-1] != CR:
        if _has_lines(raw):
            return ENDED_BY_LINE_FEED(count=len(raw))
        return WITHOUT_CR(count=len(raw))
    line, found = parse_line(text)
    if line.command is not None:
        return COMMAND(command=line.command, text=described(line.command, variant))
    if found:
        return COMMAND(command=text, text=found[0].message)
    return A_COMMENT() if line.comment is not None else AN_EMPTY_LINE()


def changes_nothing(raw: bytes) -> bool:
    """Whether a line that a host has sent asks for a byte only, or is empty or a comment."""
    line, found = parse_line(raw.decode("latin-1").strip())
    return (line.command is None and not found) or (line.command is not None and line.command.key == UPLOAD)


def described(command: ChipCommand, variant: Variant) -> MessageText:
    """``Forward 12 800 min. microsteps``."""
    argument = command.argument
    if isinstance(argument, JumpCondition):
        return IF[argument.line < 80, argument.high](number=argument.line, label=argument.label)
    spec = find(command.key, argument, variant)
    if command.from_variable:
        return WITH_VARIABLE()
    if spec is None:
        return OUT_OF_RANGE()
    if argument is None:
        return MessageText(spec.name)
    number = f"{argument:X}" if spec.kind is ArgType.ADDRESS else grouped(argument)
    return (
        WITH_NUMBER(name=spec.name, number=number, unit=UNITS[spec.unit]) if spec.unit else MessageText(f"{spec.name} {number}")
    )
