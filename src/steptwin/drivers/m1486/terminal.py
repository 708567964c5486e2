"""A terminal for M1486 chips: commands are sent as typed, and received bytes are shown decoded."""

from __future__ import annotations

import re
import threading
import time
from collections import deque
from collections.abc import Callable

from steptwin.controller import SECOND
from steptwin.drivers.m1486.download import MOVES
from steptwin.drivers.m1486.unit import BEGUN_NS
from steptwin.drivers.tcp import Channel
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.receiver import EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.registers import UPLOADS
from steptwin.m1486.syntax import ChipCommand, parse_line
from steptwin.m1486.variants import VARIANTS, Store, Variant
from steptwin.wire.line import SerialLine

LOOK_S = 0.02
HELD_UP_S = 2.0
"""A step of the thread that takes longer means that the program was suspended."""
QUIET_S = 0.1
"""Silence that ends a group of received bytes. Adapters may delay them by 16 ms and more."""
SILENT_S = 3.0
"""The wait for a chip that does not echo what is typed."""
_ROOM = {
    NO_ROOM: "no room in the input buffer: a character is lost",
    EMPTY: "the input buffer is empty",
    THREE_FREE: "three places are free in the input buffer",
}
_IMMEDIATE = ("K", "X")
"""Commands that act when received and do not write the EEPROM."""
_UPLOAD = re.compile(rb"\s*[Uu]\s*(\d+)\s*")
_SELECT = re.compile(r"[Xx]\s*([0-9A-Fa-fGg])")


def command_of(text: str, variant: Variant | None) -> ChipCommand | None:
    """The command in a typed line; None for a comment. Raises `Misuse` for a command that the chip would drop as wrong data
    (M-11).

    If the type of chip is unknown, the commands of all types are accepted.
    """
    line, found = parse_line(text)
    command = line.command
    if found or (command is None and line.comment is None):
        raise Misuse(f"{text!r} is not a command{f': {found[0].message}' if found else ''}")
    if command is not None:
        doubts = [out_of_range(command, one) for one in ([variant] if variant is not None else VARIANTS)]
        if None not in doubts:
            raise Misuse(f"{text!r}: {doubts[-1]}")
    return command


class TerminalDecoder:
    """Decodes the bytes from a line, given the lines typed. It has neither I/O nor a clock.

    The bytes carry no type, so their order decides. With function 41 ON the echo of the line comes first; then its end
    inverted, if it took the last places of the input buffer, or 5EH for characters without room; then the bytes requested by
    ``U``, in their order, which may come before the echo of the next line.
    """

    def __init__(self) -> None:
        self._typed: list[bytes] = []
        self._requested: deque[int] = deque()
        self.refused = 0
        """Number of characters that found no room."""
        self.is_silent = False
        """Whether nothing at all has come back of the line typed last."""

    @property
    def is_awaiting(self) -> bool:
        """Whether a requested upload has not arrived yet."""
        return bool(self._requested) or any(map(_UPLOAD.fullmatch, self._typed))

    def typed(self, line: str) -> None:
        """Register a line that was sent, given without its CR."""
        self._typed.append(line.encode("latin-1") + b"\r")

    def decode(self, data: bytes) -> list[str]:
        """Decode all bytes received between two silences."""
        texts: list[str] = []
        for line in self._typed:
            begin = max(data.find(line), 0)
            texts += self._requested_or_reported(data[:begin])
            refused = self.refused
            self.is_silent = not data
            data = self._answered(line, data[begin:], texts)
            upload = _UPLOAD.fullmatch(line)
            if upload is not None and self.refused == refused:
                self._requested.append(int(upload[1]))
        self._typed.clear()
        texts += self._requested_or_reported(data)
        return texts

    def _requested_or_reported(self, data: bytes) -> list[str]:
        texts = []
        # More than was asked for: function 57 reports before what is uploaded.
        reports = len(data) - len(self._requested)
        for byte in data:
            is_report = byte in _ROOM and reports > 0
            reports -= is_report
            texts.append(self._room(byte) if is_report or not self._requested else self._upload(byte))
        return texts

    def _answered(self, line: bytes, data: bytes, texts: list[str]) -> bytes:
        """The bytes that remain after the echo of a line and reports about room are removed."""
        place = 0
        notes: list[str] = []
        echoed = refused = 0
        for byte in line:
            if data[place : place + 1] == bytes((byte,)):
                place += 1
                echoed += 1
            answer = data[place] if place < len(data) else None
            if answer == ~byte & 0xFF:
                name = "CR" if byte == ord("\r") else repr(chr(byte))
                notes.append(f"{answer:02X}H  {name} inverted: it took one of the last three places of the input buffer")
            elif answer == NO_ROOM:
                refused += 1
                notes.append(f"5EH  {_ROOM[NO_ROOM]}")
            elif notes:
                break  # a buffer that is full stays so to the end of a line: it was something else
            else:
                continue
            place += 1
        else:
            if notes or echoed == len(line):
                texts += notes
                self.refused += refused
                return data[place:]
        return data

    def _upload(self, byte: int) -> str:
        number = self._requested.popleft()
        name = UPLOADS.get(number, "reserved").partition(":")[0]
        doubt = f" (or: {_ROOM[byte]})" if byte in _ROOM else ""
        return f"{byte:02X}H  U{number} {name}: {_value(number, byte)}{doubt}"

    def _room(self, byte: int) -> str:
        self.refused += byte == NO_ROOM
        what = _ROOM.get(byte) or (f"{byte}, {chr(byte)!r}" if 0x20 <= byte < 0x7F else str(byte))
        return f"{byte:02X}H  {what}"


def _value(number: int, byte: int) -> str:
    match number:
        case 14:
            return f"ON {_on((*USER_FLAGS, CARRY), byte)}"
        case 17 | 18 | 19:
            return f"ON {_on(FUNCTIONS[8 * (number - 17) :], byte)}"
        case 15:
            return next((interface.title for interface in INTERFACES if interface.code == byte), str(byte))
        case 20:
            return next((variant.title for variant in VARIANTS if variant.type_letter == byte), str(byte))
        case _:
            return str(byte)


def _on(numbers: range | tuple[int, ...], byte: int) -> str:
    return " ".join(str(number) for bit, number in enumerate(numbers[:8]) if byte >> bit & 1) or "none"


def _letter(line: str) -> str:
    return line.strip()[:1].upper()


def _may_move(line: str) -> bool:
    """Whether a command moves, jumps to commands sent before, or lets a program go on (C75)."""
    return _letter(line).lower() in MOVES or "".join(line.split()).upper() == "C75"


class ChipTerminal:
    """A line for typed commands. ``show`` is called with each decoded answer, from a separate thread.

    ``variant``: for E types the terminal waits after each command until the EEPROM is written. ``earlier``: commands that were
    sent before, and may not be written yet.
    """

    def __init__(
        self,
        channel: Channel,
        baud: int,
        variant: Variant | None,
        show: Callable[[str], object],
        *,
        earlier: int = 0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._channel = channel
        self._serial = SerialLine(baud)
        self._quiet_s = QUIET_S + self._serial.duration(3) / SECOND
        self._write_s = variant.write_ns / SECOND if variant is not None and variant.store is Store.EEPROM else 0.0
        self._show = show
        self._words = TerminalDecoder()
        self._changed = threading.Condition()
        self._outgoing: deque[str] = deque()
        self._unsettled = 0  # lines whose echo may be to come
        self._sent = 0  # those of them that have gone out
        self._received = bytearray()
        self._quiet_at = 0.0
        self._ready_at = clock() + earlier * self._write_s
        self._begun: str | None = None  # the line sent last, if it may move as soon as it is in the EEPROM
        self._again_at: float | None = None  # when K is sent once more, because the first one came before that motion
        self._failure: LineFailure | None = None
        self._dropped: LineFailure | None = None  # to be raised once
        self._ends = False
        self.selected = ""
        """The chip selected by the last ``X``; empty if all chips listen."""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def type(self, text: str) -> None:
        """Send a line and its CR. Raises `Misuse` for characters outside Latin-1, and the `LineFailure` that has ended the
        line, or that tells which lines were dropped; only K is sent even so."""
        try:
            text.encode("latin-1")
        except UnicodeEncodeError as error:
            raise Misuse(f"{text!r}: {text[error.start]!r} is not a single-byte character") from None
        chosen = _SELECT.fullmatch(text.strip())
        if chosen is not None:
            self.selected = chosen[1].upper().replace("G", "")
        with self._changed:
            if _letter(text) != "K":
                self._check()
            if not self._unsettled:
                self._words.refused = 0
            self._unsettled += 1
            self._outgoing.append(text)
            self._check()

    def settle(self, timeout_s: float) -> int:
        """Wait until everything typed is sent, all requested uploads have arrived, and the line is silent.

        Returns the number of characters of it that found no room. Raises `LineFailure` at the timeout of an upload.
        """
        begin = self._clock()
        with self._changed:
            while self._unsettled or self._words.is_awaiting:
                self._check()
                if not self._unsettled and self._words.refused:
                    break
                if not self._unsettled and self._words.is_silent:
                    timeout_s = min(timeout_s, SILENT_S + self._write_s)
                limit = begin + timeout_s
                if not self._changed.wait(max(limit - self._clock(), 0.0)) and self._clock() >= limit:
                    raise LineFailure(self._no_answer(timeout_s))
            self._check()
            return self._words.refused

    def _no_answer(self, timeout_s: float) -> str:
        chip = f"chip {self.selected}" if self.selected else "the chip"
        if self._words.is_silent:
            doubt = "it is not there, or it moves and its echo (function 41) is OFF"
            return f"{chip} neither echoes nor answers within {timeout_s:g} s: {doubt}"
        return f"no answer to U within {timeout_s:g} s: {chip} moves, waits or runs a program"

    def close(self) -> None:
        self._ends = True
        self._thread.join()
        self._channel.close()

    def _check(self) -> None:
        dropped, self._dropped = self._dropped, None
        if dropped is not None:
            raise dropped
        if self._failure is not None:
            raise self._failure

    # ------------------------------------------------------------------ the thread

    def _run(self) -> None:
        looked = self._clock()
        try:
            while not self._ends:
                before, looked = looked, self._clock()
                if looked - before > HELD_UP_S:
                    self._drop_waiting(looked - before)
                self._send()
                data = self._channel.read(LOOK_S)
                if data:
                    self._received += data
                    self._quiet_at = self._clock() + self._quiet_s
                elif (self._received or self._sent) and self._clock() >= self._quiet_at:
                    self._show_received()
        except LineFailure as failure:
            with self._changed:
                self._failure = failure
                self._changed.notify_all()

    def _drop_waiting(self, seconds: float) -> None:
        """Drop the waiting commands after a suspension, so that nothing moves late."""
        with self._changed:
            dropped = [line for line in self._outgoing if _letter(line) not in _IMMEDIATE]
            if dropped:
                self._outgoing = deque(line for line in self._outgoing if line not in dropped)
                self._unsettled -= len(dropped)
                self._dropped = LineFailure(f"{', '.join(dropped)}: not sent: the program was suspended for {seconds:.0f} s")
                self._changed.notify_all()

    def _send(self) -> None:
        told: list[str] = []
        with self._changed:
            was_due, text = self._again_at, self._next(told)
            is_dropping = was_due is None and self._again_at is not None
        if text is None:
            return
        lines = ["%", text] if is_dropping else [text]
        data = "".join(f"{line}\r" for line in lines).encode("latin-1")
        for line in lines:
            self._words.typed(line)
        self._channel.write(data)
        self._sent += len(lines)
        now = self._clock()
        self._quiet_at = now + self._serial.duration(len(data)) / SECOND + self._quiet_s
        if _letter(text) not in _IMMEDIATE:
            self._ready_at = now + self._write_s
            self._begun = text if _may_move(text) else None
        elif _letter(text) == "X":
            self._begun = None  # of another chip
        for line in told:
            self._show(line)

    def _next(self, told: list[str]) -> str | None:
        """The next line to send. K overtakes lines that wait for an EEPROM, unless another chip must be selected first, and
        those of them that may move are dropped (``told`` says so); X does not wait either. A motion that is being written into
        the EEPROM is dropped by wrong data before K, and until K has been sent again, nothing else is."""
        waiting, again = self._outgoing, self._again_at
        if again is not None and self._clock() >= again:
            self._again_at = None
            return "K"
        for place, line in enumerate(waiting):
            letter = _letter(line)
            if letter == "K":
                told += self._overtake(place)
                return line
            if letter == "X":
                if place == 0 and again is None:
                    return waiting.popleft()
                break
        return waiting.popleft() if waiting and again is None and self._clock() >= self._ready_at else None

    def _overtake(self, place: int) -> list[str]:
        """Remove the K at a place of the waiting lines, and what may move before it. What becomes of that, in words."""
        before, behind = list(self._outgoing)[:place], list(self._outgoing)[place + 1 :]
        dropped = [line for line in before if _may_move(line)]
        self._outgoing = deque([line for line in before if not _may_move(line)] + behind)
        self._unsettled -= len(dropped)
        told = [f"{line}: not sent, because K was typed behind it" for line in dropped]
        if self._begun is not None and self._again_at is None and self._clock() < self._ready_at:
            self._again_at = self._ready_at + BEGUN_NS / SECOND
            self._unsettled += 2
            told.append(f"% is sent before it, which drops {self._begun}, and K again: with function 44 ON it moves even so")
        return told

    def _show_received(self) -> None:
        with self._changed:
            texts = self._words.decode(bytes(self._received))
        self._received.clear()
        for text in texts:
            self._show(text)
        with self._changed:
            self._unsettled -= self._sent
            self._sent = 0
            self._changed.notify_all()
