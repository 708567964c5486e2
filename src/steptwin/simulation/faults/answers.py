"""Faults of frames: what becomes of an answer on its way to the master."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.simulation.faults.active import ActiveFault, FaultReporter
from steptwin.simulation.faults.table import LineProtocol
from steptwin.wire.pdu import REFUSED

NEVER_SENT = 0
"""No answer carries this exception code: a slave that must not answer gives it, and the port keeps it."""
_UNIT = {LineProtocol.RTU: 0, LineProtocol.TCP: 6}


class Exchange(NamedTuple):
    """A request and its answer as they are on the wire."""

    line: LineProtocol
    request: bytes
    answer: bytes

    @property
    def unit(self) -> int:
        return self.request[_UNIT[self.line]]

    @property
    def pdu(self) -> bytes:
        return pdu_of(self.line, self.request)


def pdu_of(line: LineProtocol, raw: bytes) -> bytes:
    return raw[1:-2] if line is LineProtocol.RTU else raw[7:]


def must_not_be_sent(line: LineProtocol, raw: bytes) -> bool:
    pdu = pdu_of(line, raw)
    return len(pdu) == 2 and pdu[0] >= REFUSED and pdu[1] == NEVER_SENT


class AlteredAnswer(NamedTuple):
    """The remains of an answer: the echo of the request (``before``), then ``answer`` after ``delay``, or held for ``later``."""

    delay: Nanos
    before: bytes
    answer: bytes
    later: bytes


def spoil_answer(
    exchange: Exchange, unit: int, actives: Sequence[ActiveFault], now: Nanos, report: FaultReporter
) -> AlteredAnswer:
    """Faults in the order in which they were set; ``unit`` is the one that was addressed, whatever the frame calls it."""
    sent = AlteredAnswer(0, b"", exchange.answer, b"")
    for active in actives:
        if active.matches(unit, exchange.pdu) and active.strikes(now):
            sent = active.fault.kind.effect.answer(active, exchange, unit, sent, report)
            if not sent.answer:
                break
    return sent
