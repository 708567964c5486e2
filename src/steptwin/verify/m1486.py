"""The checks of the M1486, and the talk of checks with a chip. The facts are those of docs/assumptions.md."""

from __future__ import annotations

from steptwin.drivers.m1486.talk import LETTERS
from steptwin.errors import LineFailure
from steptwin.m1486.receiver import CR, EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.variants import Store, Variant
from steptwin.verify.check import Check, CheckNeed, CheckRequest, CheckSteps, NotRestored, Probes, Undecided

INVALID_COMMAND = "%"
"""A character that is in no command: its line is wrong data (M-11)."""
COMMENT = "; yy"
"""Comment of characters that are in no command, as a chip that does not know comments may take what follows for commands."""
_FLAGS, _INTERFACE, _SERIES, _TYPE, _RESERVED = 14, 15, 16, 20, 7
"""Bytes that U sends."""
SELECT_S = 0.1
BUSY_S = 2.0
"""A chip may still execute earlier commands."""


class ChipTalk:
    """With the chip ``address`` (None: the only one), which stands and runs no program.

    ``variant`` is the type that is expected.
    """

    def __init__(self, address: int | None, variant: Variant, *, wait_s: float) -> None:
        self.address = address
        self.variant = variant
        self.wait_s = wait_s + (variant.write_ns / 1e9 if variant.store is Store.EEPROM else 0.0)
        self.probes = Probes()
        self.has_echo = False
        """Function 41."""
        self.has_report = False
        """Function 57."""

    def hello(self) -> CheckSteps[None]:
        """Select the chip, and find out whether it echoes and reports. Raises `LineFailure` if it does not respond."""
        yield CheckRequest(b"\r", SELECT_S)
        if self.address is not None:
            yield CheckRequest(f"x{self.address:x}\r".encode("ascii"), SELECT_S)
        self.has_echo = (yield CheckRequest(b"\n", self.wait_s, lambda came: len(came) > 0)) == b"\n"
        query = f"u{_TYPE}\r".encode("ascii")
        wait_s = self.wait_s + BUSY_S
        came = yield CheckRequest(query, wait_s, lambda come: not LETTERS.isdisjoint(come))
        came += yield CheckRequest(b"", SELECT_S)
        self.has_report = bool({EMPTY, THREE_FREE}.intersection(came))
        if LETTERS.isdisjoint(came):
            raise LineFailure("the chip does not respond: it may move, wait or run a program")

    def sent(self, text: str, *, answers: int = 1) -> CheckSteps[bytes]:
        """Answer to characters, without their echo; ``answers``: the number of bytes expected."""
        data = text.encode("ascii")
        echo = data if self.has_echo else b""
        size = len(echo) + answers
        can_end = answers > 0 and not self.has_report
        came = yield CheckRequest(data, self.wait_s * max(answers, 1), lambda come: can_end and len(come) >= size)
        return came.removeprefix(echo)

    def without_report(self, came: bytes) -> bytes:
        return came.translate(None, bytes((EMPTY, THREE_FREE))) if self.has_report else came

    def upload(self, number: int) -> CheckSteps[int]:
        """One byte of U. Raises `Undecided`."""
        came = self.without_report((yield from self.sent(f"u{number}\r")))
        if len(came) != 1:
            raise Undecided(f"U{number} was answered by {_text(came)}")
        return came[0]

    def expect(self, what: str, text: str, *wanted: int) -> CheckSteps[None]:
        came = self.without_report((yield from self.sent(text, answers=len(wanted))))
        self.probes.equal(what, _text(bytes(wanted)), _text(came))


def _text(data: bytes) -> str:
    return " ".join(f"{byte:02X}H" for byte in data) or "nothing"


def _mixed(talk: ChipTalk) -> str | None:
    """Answers between characters of an echo cannot be distinguished from it."""
    return "needs function 41 (echo) and 57 (report) OFF" if talk.has_echo or talk.has_report else None


def _comments(talk: ChipTalk) -> CheckSteps[None]:
    letter = talk.variant.type_letter
    yield from talk.expect("U20 with a comment behind it", f"u{_TYPE}{COMMENT}\r", letter)
    yield from talk.expect("a comment alone", f"{COMMENT}\r")
    yield from talk.expect("U20 with LF behind it", f"u{_TYPE}\n\r", letter)


def _blanks(talk: ChipTalk) -> CheckSteps[None]:
    yield from talk.expect("U20 with blanks in it", " u 2 0 \r", talk.variant.type_letter)


def _wrong_data(talk: ChipTalk) -> CheckSteps[None]:
    yield from talk.expect("an unknown letter", f"{INVALID_COMMAND}\r")
    yield from talk.expect("a number out of range", "u21\r")
    yield from talk.expect("U20 after them", f"u{_TYPE}\r", talk.variant.type_letter)


def _identity(talk: ChipTalk) -> CheckSteps[None]:
    interface = yield from talk.upload(_INTERFACE)
    talk.probes.holds("U15", "00H, 01H or 02H", _text(bytes((interface,))), interface in (0, 1, 2))
    yield from talk.expect("U16", f"u{_SERIES}\r", 1)
    yield from talk.expect(f"U20 of a type {talk.variant.name}", f"u{_TYPE}\r", talk.variant.type_letter)


def _reserved_bytes(talk: ChipTalk) -> CheckSteps[None]:
    for number in range(_RESERVED, _FLAGS):
        yield from talk.expect(f"U{number}", f"u{number}\r", 0)


def _two_uploads(talk: ChipTalk) -> CheckSteps[None]:
    yield from talk.expect("U20 and U16 in immediate succession", f"u{_TYPE}\ru{_SERIES}\r", talk.variant.type_letter, 1)


def _room(talk: ChipTalk) -> int:
    """Characters in the input buffer."""
    return talk.variant.input_bits // 8


def _long_line(talk: ChipTalk) -> CheckSteps[None]:
    inverted = ~ord(INVALID_COMMAND) & 0xFF
    room = _room(talk)
    yield from talk.expect(
        f"a line of {room + 1} characters without CR", INVALID_COMMAND * (room + 1), inverted, inverted, inverted, NO_ROOM
    )
    yield from talk.expect("its CR", "\r")
    yield from talk.expect("U20 after it", f"u{_TYPE}\r", talk.variant.type_letter)


def _last_three(talk: ChipTalk) -> CheckSteps[None]:
    room = _room(talk)
    text = INVALID_COMMAND * (room - 3)
    yield from talk.expect(f"a line of {room - 2} characters with its CR", f"{text}\r", ~CR & 0xFF)
    yield from talk.expect("U20 after it", f"u{_TYPE}\r", talk.variant.type_letter)


def _bit_order(talk: ChipTalk) -> CheckSteps[None]:
    before = yield from talk.upload(_FLAGS)
    talk.probes.unrestored["flag 80"] = f"flag 80 = {before & 1}"
    for text, bit in (("t80", 1), ("c80", 0)):
        yield from talk.sent(f"{text}\r", answers=0)
        after = yield from talk.upload(_FLAGS)
        talk.probes.equal(f"U14 after {text.upper()}", f"{before & 0xFE | bit:02X}H", f"{after:02X}H")
    yield from talk.sent("t80\r" if before & 1 else "c80\r", answers=0)
    if (yield from talk.upload(_FLAGS)) != before:
        raise NotRestored(f"not put back: flags 80 to 87 were {before:02X} hex")
    del talk.probes.unrestored["flag 80"]


CHECKS: tuple[Check[ChipTalk], ...] = (
    Check("M-1", "Comments and LF", _comments),
    Check("M-2", "Blanks inside a command", _blanks),
    Check("M-11", "Wrong data are dropped without an answer", _wrong_data),
    Check("M-15", "What U15, U16 and U20 send", _identity),
    Check("M-22", "The order of bits in U14, with flag 80", _bit_order, CheckNeed.WRITE),
    Check("M-32", "What bytes without a meaning upload", _reserved_bytes),
    Check("M-36", "U while a character is on its way", _two_uploads, unless=_mixed),
    Check("M-38", "A line longer than the input buffer", _long_line, unless=_mixed),
    Check("M-43", "A CR in the last three places of the input buffer", _last_three, unless=_mixed),
)
