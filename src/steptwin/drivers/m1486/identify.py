"""Finding out which chips are on a line, without moving anything.

What is said, and what it does to whoever hears it:

* ``X`` chooses who listens. It acts when received, at any time, and only that.
* ``U20`` asks for the type letter. Like every question it takes its turn, so a chip that moves, waits or runs a program does
  not answer, and like every command it passes through the command memory, 16 bits of it (chapter II, Memory); an E type needs
  half a second for that (and keeps nothing of it, M-37). It changes no setting, no line and no position. A chip that was busy
  answers when it is done.
* To a MIC488 it is rubbish: a frame needs a right CRC, and none of these characters is one of its functions.

The other way round, a Modbus frame is rubbish to a chip: no frame is a command, but a line of rubbish is wrong data, which ends
a program that runs (M-11). That is why chips are looked for first, and why chips that may be there without answering are made
deaf before anybody says something else on the line: ``X`` with an address nobody is found at (`scan_chips` leaves it so, and
`let_all_listen` ends it). Only the one silent chip that has this address hears on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from steptwin.drivers.exchange import Exchanger, Job, NoAnswer
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.lines import line_endpoint
from steptwin.drivers.m1486.talk import LETTERS, WHO
from steptwin.drivers.place import Endpoint
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486.receiver import EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.variants import VARIANTS, Store, variant
from steptwin.machine import MILLISECOND, Nanos
from steptwin.wire.line import SerialLine

CHIP_BAUDS = (4800, 9600, 2400, 1200, 600, 300)
"""What BR1 and BR0 choose, at 12 and at 24 MHz; open pins first."""
SCAN_NS: Nanos = 100 * MILLISECOND
"""How long a chip is waited for, beside the time on the wire and, where there may be E types, of their EEPROM."""

_WRITE_NS = max(one.write_ns for one in VARIANTS)
_LETTERS_RAM = frozenset(one.type_letter for one in VARIANTS if one.store is Store.RAM)
_AT_24_MHZ = frozenset(v.baud(br1, br0) for v in VARIANTS if v.clock == 2 for br1 in (0, 1) for br0 in (0, 1))
_AT_12_MHZ = frozenset(v.baud(br1, br0) for v in VARIANTS if v.clock == 1 for br1 in (0, 1) for br0 in (0, 1))
_PARKED = 0xE
"""Who listens while others speak on the line, unless he is found: every type takes it, and open pins give F."""


class FoundChip(NamedTuple):
    """A chip that answers. ``variant`` is None when it is busy: it only said that its input buffer is full or nearly so."""

    address: int
    variant: str | None

    @property
    def takes_x0(self) -> bool:
        return self.variant is not None and 0 in variant(self.variant).addresses


class Question(NamedTuple):
    """Something said, and whether the first type letter that comes is its answer."""

    text: str
    has_one_answer: bool
    device: None = None
    changes: bool = False

    def __str__(self) -> str:
        return self.text.strip().replace("\r", " ")


class Asking:
    """The line's side of a search. See `steptwin.drivers.exchange.Discipline`."""

    free_ns: Nanos = 0
    wary = True

    def __init__(self, serial: SerialLine) -> None:
        self._serial = serial
        self.reset()

    def reset(self) -> None:
        self._question = Question("", has_one_answer=False)
        self._heard = b""

    def start(self, request: Question, now: Nanos, *, urgent: bool) -> bytes:
        self._question = request
        self._heard = b""
        return request.text.encode("ascii")

    def receive(self, data: bytes, now: Nanos) -> bytes | None:
        self._heard += data
        question = self._question
        if question.has_one_answer and letter_in(answer_in(question.text, self._heard)) is not None:
            return self._heard
        return None

    def allowance_ns(self, request: Question) -> Nanos:
        return self._serial.duration(len(request.text) + 2)

    def abandon(self, now: Nanos) -> bytes:
        return self._heard

    def stray(self, data: bytes, now: Nanos) -> None:
        """What came before the question is no answer to it."""


def searching(endpoint: Endpoint, baud: int) -> Exchanger[Question, bytes]:
    return Exchanger(Asking(SerialLine(baud)), str(endpoint))


class SearchLine(ThreadLine[Question, bytes]):
    """A line on which chips are looked for, at an address as of `steptwin.drivers.m1486.M1486`."""

    def __init__(self, address: str, *, baud: int) -> None:
        endpoint = line_endpoint(address, baud)
        super().__init__(endpoint, searching(endpoint, baud))


def answer_in(said: str, heard: bytes) -> bytes:
    """What was heard without the echo of what was said (function 41), of which a chip gives the part from its selection on, and
    without the reports of function 57. No answer is among the characters that are said: they are small letters and digits.
    """
    return heard.translate(None, said.encode("ascii") + bytes((EMPTY, THREE_FREE)))


def letter_in(answer: bytes) -> int | None:
    """The type letter, if an answer is nothing else."""
    return answer[0] if len(answer) == 1 and answer[0] in LETTERS else None


def type_of(letter: int, baud: int | None) -> str:
    """The type with this letter. Its brother for 24 MHz has the same one; only a rate that the other has not tells them apart."""
    clock = 2 if baud in _AT_24_MHZ - _AT_12_MHZ else 1
    return next(one.name for one in VARIANTS if (one.type_letter, one.clock) == (letter, clock))


async def scan_chips(
    line: DriverLine[Question, bytes],
    *,
    baud: int | None = None,
    timeout_ns: Nanos = SCAN_NS,
    progress: Callable[[int], Any] | None = None,
) -> list[FoundChip]:
    """The chips that answer on a line. ``progress`` is told each address before it is asked. Raises `LineLost`.

    When chips were found all listen afterwards, as after power-up. Otherwise those that may be there without answering are
    deaf until `let_all_listen`.
    """
    everybody = f"xg\rxg\r{WHO}\r"  # twice: the first may meet the rest of another line
    heard = answer_in(everybody, await _say(line, everybody, timeout_ns + _WRITE_NS))
    found: dict[int, FoundChip] = {}
    if heard:
        patience_ns = timeout_ns if _LETTERS_RAM.issuperset(heard) else timeout_ns + _WRITE_NS
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
    await _say(line, "xg\r" if found else f"x{_PARKED:x}\r", 0)
    return sorted(found.values())


async def let_all_listen(line: DriverLine[Question, bytes]) -> None:
    """End what others have said on the line, to which chips were deaf, and have them listen again."""
    await _say(line, "\rxg\r", 0)


async def end_line(line: DriverLine[Question, bytes]) -> None:
    """End what others have said on the line: chips that took it for characters drop it. Nobody is selected by it."""
    await _say(line, "\r", 0)


async def _asked(
    line: DriverLine[Question, bytes], before: str, address: int, baud: int | None, patience_ns: Nanos
) -> FoundChip | None:
    text = f"{before}x{address:x}\r{WHO}\r"
    answer = answer_in(text, await _say(line, text, patience_ns, has_one_answer=True))
    letter = letter_in(answer)
    if letter is not None:
        return FoundChip(address, type_of(letter, baud))
    full = {NO_ROOM, *(~byte & 0xFF for byte in text.encode("ascii"))}
    return FoundChip(address, None) if answer and full.issuperset(answer) else None


async def _say(line: DriverLine[Question, bytes], text: str, patience_ns: Nanos, *, has_one_answer: bool = False) -> bytes:
    """What is heard meanwhile."""
    try:
        return await line.exchange(Job(Question(text, has_one_answer), patience_ns))
    except NoAnswer as silence:
        return silence.heard
