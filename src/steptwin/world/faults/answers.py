"""Faults of frames: what becomes of an answer on its way to the master."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from steptwin.machine import Nanos
from steptwin.wire.crc import with_crc
from steptwin.wire.pdu import REFUSED
from steptwin.world.faults.active import Active
from steptwin.world.faults.table import Line

NEVER_SENT = 0
"""No answer carries this exception code: a slave that must not answer gives it, and the port keeps it."""

Tell = Callable[[Active, str], None]

_UNIT = {Line.RTU: 0, Line.TCP: 6}
_UNITS = {Line.RTU: 248, Line.TCP: 256}


class Exchange(NamedTuple):
    """A request and its answer as they are on the wire."""

    line: Line
    request: bytes
    answer: bytes

    @property
    def unit(self) -> int:
        return self.request[_UNIT[self.line]]

    @property
    def pdu(self) -> bytes:
        return pdu_of(self.line, self.request)


def pdu_of(line: Line, raw: bytes) -> bytes:
    return raw[1:-2] if line is Line.RTU else raw[7:]


def must_not_be_sent(line: Line, raw: bytes) -> bool:
    pdu = pdu_of(line, raw)
    return len(pdu) == 2 and pdu[0] >= REFUSED and pdu[1] == NEVER_SENT


class Sent(NamedTuple):
    """What is left of an answer: ``before`` it the request's echo, then ``answer`` after ``delay``, or kept for ``later``."""

    delay: Nanos
    before: bytes
    answer: bytes
    later: bytes


def spoil_answer(exchange: Exchange, unit: int, actives: Sequence[Active], now: Nanos, tell: Tell) -> Sent:
    """Faults in the order in which they were set; ``unit`` is the one that was addressed, whatever the frame calls it."""
    line, raw = exchange.line, exchange.answer
    delay, echo = 0, b""
    for active in actives:
        fault = active.fault
        if not active.matches(unit, exchange.pdu) or not active.strikes(now):
            continue
        match fault.kind.name:
            case "no-answer":
                tell(active, f"lost on its way: {raw.hex(' ')}")
                return Sent(0, echo, b"", b"")
            case "late":
                tell(active, f"held back: {raw.hex(' ')}")
                return Sent(0, echo, b"", raw)
            case "delay":
                tell(active, f"{fault.number('for_ms'):g} ms later: {raw.hex(' ')}")
                delay += active.ns("for_ms")
            case "wrong-unit":
                other = fault.whole("answers_as")
                other = (unit + 1) % _UNITS[line] if other is None else other
                tell(active, f"answered as unit {other}: {raw.hex(' ')}")
                raw = _as_unit(line, raw, other)
            case "crc":
                wrong = int.from_bytes(raw[-2:], "little") ^ 1 + active.chance.below(0xFFFF)
                raw = raw[:-2] + wrong.to_bytes(2, "little")
                tell(active, f"wrong CRC: {raw.hex(' ')}")
            case "echo":
                echo = exchange.request
                tell(active, f"echo: {echo.hex(' ')}")
    return Sent(delay, echo, raw, b"")


def _as_unit(line: Line, raw: bytes, unit: int) -> bytes:
    if line is Line.RTU:
        return with_crc(bytes((unit,)) + raw[1:-2])
    return raw[:6] + bytes((unit,)) + raw[7:]
