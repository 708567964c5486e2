"""Find the chips on a line without moving anything.

The characters that are sent, and their effect on every device on the line:

* ``X`` selects the chip that listens. It acts when received, at any time, and has no other effect.
* ``U20`` requests the type letter. It is executed in order, so a chip that moves, waits or runs a program answers only
  afterwards. It passes through the command memory, 16 bits of it (chapter II, Memory); an E type needs half a second for that
  (and stores nothing, M-37). It changes no setting, no line and no position.
* A MIC488 discards them: a frame needs a correct CRC, and none of these characters is one of its functions.

A Modbus frame is wrong data to a chip, which ends a running program (M-11). So chips are searched first, and chips that may
be present without answering are deselected before Modbus is sent: by ``X`` with an unused address (`scan_chips` leaves it so,
`select_all` ends it). Only a silent chip with this address stays selected.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.exchange import Exchanger, Job, NoAnswer
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.lines import line_endpoint
from steptwin.drivers.m1486.talk import LETTERS, TYPE_QUERY
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486.receiver import EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.variants import VARIANTS, Store, variant
from steptwin.wire.line import SerialLine

CHIP_BAUDS = (4800, 9600, 2400, 1200, 600, 300)
"""Baud rates selected by BR1 and BR0, at 12 and at 24 MHz; those of open pins first."""
SCAN_NS: Nanos = 100 * MILLISECOND
"""Time to wait for a chip, in addition to the time on the wire and that of the EEPROM of E types, ns."""

_WRITE_NS = max(one.write_ns for one in VARIANTS)
_LETTERS_RAM = frozenset(one.type_letter for one in VARIANTS if one.store is Store.RAM)
_AT_24_MHZ = frozenset(v.baud(br1, br0) for v in VARIANTS if v.clock == 2 for br1 in (0, 1) for br0 in (0, 1))
_AT_12_MHZ = frozenset(v.baud(br1, br0) for v in VARIANTS if v.clock == 1 for br1 in (0, 1) for br0 in (0, 1))
_PARKED = 0xE
"""The address selected during Modbus traffic, unless a chip has it: every type accepts it, and open pins give F."""


class FoundChip(NamedTuple):
    """A chip that responds. ``variant`` is None if it is busy: it has only reported that its input buffer is (nearly) full."""

    address: int
    variant: str | None

    @property
    def takes_x0(self) -> bool:
        return self.variant is not None and 0 in variant(self.variant).addresses


class SearchRequest(NamedTuple):
    """Characters to send, and whether the next type letter is their answer."""

    text: str
    has_one_answer: bool
    device: None = None
    changes: bool = False

    def __str__(self) -> str:
        return self.text.strip().replace("\r", " ")


class SearchDiscipline:
    """The protocol of a search. See `steptwin.drivers.exchange.Discipline`."""

    free_ns: Nanos = 0
    wary = True

    def __init__(self, serial: SerialLine) -> None:
        self._serial = serial
        self.reset()

    def reset(self) -> None:
        self._request = SearchRequest("", has_one_answer=False)
        self._received = b""

    def start(self, request: SearchRequest, now: Nanos, *, urgent: bool) -> bytes:
        self._request = request
        self._received = b""
        return request.text.encode("ascii")

    def receive(self, data: bytes, now: Nanos) -> bytes | None:
        self._received += data
        request = self._request
        if request.has_one_answer and letter_in(answer_in(request.text, self._received)) is not None:
            return self._received
        return None

    def allowance_ns(self, request: SearchRequest) -> Nanos:
        return self._serial.duration(len(request.text) + 2)

    def abandon(self, now: Nanos) -> bytes:
        return self._received

    def stray(self, data: bytes, now: Nanos) -> None:
        """Discard bytes from before the query."""


def searching(endpoint: Endpoint, baud: int) -> Exchanger[SearchRequest, bytes]:
    return Exchanger(SearchDiscipline(SerialLine(baud)), str(endpoint))


class SearchLine(ThreadLine[SearchRequest, bytes]):
    """A line to search for chips, at an address as of `steptwin.drivers.m1486.M1486`."""

    def __init__(self, address: str, *, baud: int) -> None:
        endpoint = line_endpoint(address, baud)
        super().__init__(endpoint, searching(endpoint, baud))


def answer_in(sent: str, received: bytes) -> bytes:
    """The received bytes without the echo (function 41), of which a chip sends the part from its selection on, and without the
    reports of function 57. No answer looks like an echo: the characters sent are lower-case letters and digits."""
    return received.translate(None, sent.encode("ascii") + bytes((EMPTY, THREE_FREE)))


def letter_in(answer: bytes) -> int | None:
    """The type letter, if the answer is exactly that."""
    return answer[0] if len(answer) == 1 and answer[0] in LETTERS else None


def type_of(letter: int, baud: int | None) -> str:
    """The type with this letter. The type for 24 MHz has the same one; only a baud rate that the other lacks distinguishes
    them."""
    clock = 2 if baud in _AT_24_MHZ - _AT_12_MHZ else 1
    return next(one.name for one in VARIANTS if (one.type_letter, one.clock) == (letter, clock))


async def scan_chips(
    line: DriverLine[SearchRequest, bytes],
    *,
    baud: int | None = None,
    timeout_ns: Nanos = SCAN_NS,
    progress: Callable[[int], Any] | None = None,
) -> list[FoundChip]:
    """The chips that respond on a line. ``progress`` is called with each address before it is tried. Raises `LineLost`.

    If chips were found, all listen afterwards, as after power-up. Otherwise chips that may be present stay deselected until
    `select_all`.
    """
    query = f"xg\rxg\r{TYPE_QUERY}\r"  # twice: the first may meet the rest of another line
    received = answer_in(query, await _send(line, query, timeout_ns + _WRITE_NS))
    found: dict[int, FoundChip] = {}
    if received:
        patience_ns = timeout_ns if _LETTERS_RAM.issuperset(received) else timeout_ns + _WRITE_NS
        for address in (*range(1, 16), 0):
            if progress is not None:
                progress(address)
            before = ""
            if address == 0:
                # X0 is wrong data to E types that listen.
                others = [other for other in range(_PARKED, 0, -1) if other not in found or found[other].takes_x0]
                if not others:
                    continue
                before = f"x{others[0]:x}\r"
            chip = await _asked(line, before, address, baud, patience_ns)
            if chip is not None:
                found[address] = chip
    await _send(line, "xg\r" if found else f"x{_PARKED:x}\r", 0)
    return sorted(found.values())


async def select_all(line: DriverLine[SearchRequest, bytes]) -> None:
    """End foreign bytes on the line and select all chips again."""
    await _send(line, "\rxg\r", 0)


async def end_line(line: DriverLine[SearchRequest, bytes]) -> None:
    """End foreign bytes on the line, so that chips drop them. No chip is selected by it."""
    await _send(line, "\r", 0)


async def _asked(
    line: DriverLine[SearchRequest, bytes], before: str, address: int, baud: int | None, patience_ns: Nanos
) -> FoundChip | None:
    text = f"{before}x{address:x}\r{TYPE_QUERY}\r"
    answer = answer_in(text, await _send(line, text, patience_ns, has_one_answer=True))
    letter = letter_in(answer)
    if letter is not None:
        return FoundChip(address, type_of(letter, baud))
    full = {NO_ROOM, *(~byte & 0xFF for byte in text.encode("ascii"))}
    return FoundChip(address, None) if answer and full.issuperset(answer) else None


async def _send(line: DriverLine[SearchRequest, bytes], text: str, patience_ns: Nanos, *, has_one_answer: bool = False) -> bytes:
    """Send characters; returns the bytes received meanwhile."""
    try:
        return await line.exchange(Job(SearchRequest(text, has_one_answer), patience_ns))
    except NoAnswer as error:
        return error.received
