"""The protocol of a line of M1486 chips: one-letter commands, verified by the chip's echo (function 41). Pure.

The language has neither checksum nor acknowledgement. So a command is sent without its CR first; only if the echo of every
character is correct, CR makes the chip accept it. A command with a wrong echo is made invalid (`INVALID_COMMAND`) and sent again.
Characters that take one of the last three places of the input buffer also come back inverted; 5EH means that one found no room.

Commands are sent in lower case, so that no echo looks like a type letter that was requested earlier.
"""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Callable, Mapping
from functools import lru_cache

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.exchange import SendNext
from steptwin.drivers.m1486.failures import Garbled, NoRoom
from steptwin.errors import Misuse
from steptwin.m1486.receiver import CR, EMPTY, NO_ROOM, THREE_FREE
from steptwin.m1486.structure import stored_bits
from steptwin.m1486.syntax import parse_line
from steptwin.m1486.variants import VARIANTS
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import FrameDirection

INVALID_COMMAND = b"%"
"""A character that is in no command: a line with it is dropped as wrong data (M-11)."""
QUIET_NS: Nanos = 30 * MILLISECOND
"""Silence after a failed exchange before the line is used again, ns."""
NOISE_NS: Nanos = 300 * MILLISECOND
"""Longest wait for that silence, ns."""
TYPE_QUERY = "u20"
"""Requests the type letter. The chip answers in program order, so the answer means that it has executed all commands."""
LETTERS = frozenset(variant.type_letter for variant in VARIANTS)
ALL = None
"""Stands for a single chip, to which ``X`` is never sent."""
_END = bytes((CR,))


class ChipRequestKind(enum.Enum):
    """How a request is sent."""

    LINE = "typed, verified, then CR"
    SELECT = "only the selection of the chip"
    KILL = "at once, with its CR; the echo is checked afterwards"
    LISTEN = "nothing is sent: an answer is pending"
    LETTER = "nothing is sent: several chips are to send their type letters"
    UPLOAD = "nothing is sent: a program uploads"
    BLIND = "sent to chips that do not echo yet; no answer is expected"
    PROBE = "sent as it is, and everything that comes back is collected"


_SILENT = (ChipRequestKind.LISTEN, ChipRequestKind.LETTER, ChipRequestKind.UPLOAD)


class ChipRequest:
    """A request to the chip with ``address`` (None: the only one on the line).

    ``answers``: one byte comes back. ``acts``: executing it twice is not the same as once. ``committed``: CR was sent.
    """

    __slots__ = ("acts", "address", "answers", "commented", "committed", "sort", "text")

    def __init__(
        self,
        address: int | None,
        text: str,
        *,
        sort: ChipRequestKind = ChipRequestKind.LINE,
        answers: bool = False,
        acts: bool = True,
    ) -> None:
        self.address = address
        self.text = text
        self.sort = sort
        self.answers = answers
        self.acts = acts
        self.committed = False
        self.commented = False
        """Whether the chip may read the rest of the line as a comment, so that the command before it cannot be invalidated
        (M-1)."""

    @property
    def device(self) -> int | None:
        return self.address

    @property
    def changes(self) -> bool:
        """Whether the chip may have executed it: not before CR."""
        return self.acts and (self.committed or self.commented)

    def __str__(self) -> str:
        return f"{chip_name(self.address)}: {' '.join(self.text.split()) or 'select'}"


ByteCallback = Callable[[Nanos, FrameDirection, bytes], object]
"""Called with all bytes sent and received."""


class CharacterTalk:
    """The protocol of all exchanges of a line. ``echoing``: chips known to echo; ``owed``: pending type letters of each chip."""

    def __init__(self, serial: SerialLine, place: str, *, on_bytes: ByteCallback | None = None) -> None:
        self._serial = serial
        self._place = place
        self.on_bytes = on_bytes
        self.device: int | None = ALL
        """The chip of the last request."""
        self._stored: Counter[int | None] = Counter()
        """Bits of commands for one chip."""
        self._stored_by_all = 0
        """Bits of commands sent while several may listen."""
        self.free_ns: Nanos
        self._busy_until: Nanos
        self.selected: int | None
        """The selected chip; None: all, as after power-up."""
        self.echoing: set[int | None]
        self.only: int | None
        """The address of the chip that is addressed without one; None until it was found."""
        self.owed: dict[int | None, int]
        self.arrived: dict[int | None, int]
        """Pending letters that arrived between exchanges."""
        self.spoilt: dict[int | None, int]
        """Number of lines that each chip has dropped as wrong data, which ends its program (M-11)."""
        self.uploads: bytearray | None
        """Bytes uploaded by a program in a chip, while one may run."""
        self.letters: int | None
        """Letters from any chip while several chips are watched (`steptwin.drivers.m1486.watching`)."""
        self.surplus: int
        """Number of late type letters that may still arrive."""
        self.dirty: bool
        """Whether characters of an abandoned command may precede the next one."""
        self.nearly_full: bool
        """Whether the last command took one of the last three places of the input buffer."""
        self._is_stuck: bool
        """Whether the buffer had no room for the invalid command, which is sent again."""
        self._request: ChipRequest | None
        self._lines: list[bytes]
        """Characters still to be sent; the first is being sent."""
        self._sent: bytes
        self._echoed: bytes
        self._answer: int | None
        self.reset()

    def reset(self) -> None:
        self.free_ns = 0
        self._busy_until = 0
        self.selected = ALL
        self.echoing = set()
        self.only = None
        self.owed = {}
        self.arrived = {}
        self.spoilt = {}
        self.uploads = None
        self.letters = None
        self.surplus = 0
        self.dirty = False
        self.nearly_full = False
        self._is_stuck = False
        self._request = None
        self._lines = []
        self._sent = b""
        self._echoed = b""
        self._answer = None

    wary = True

    def allowance_ns(self, request: ChipRequest) -> Nanos:
        if request.sort in _SILENT:
            return 0
        return self._serial.duration(2 * len(request.text) + 16)

    @property
    def baud(self) -> int:
        """The rate of the line, bit/s."""
        return self._serial.baud

    def wire_ns(self, characters: int) -> Nanos:
        """The time that characters take on the line, ns."""
        return self._serial.duration(characters)

    def note_stored(self, address: int | None, text: str) -> None:
        """Count a command that a chip has stored."""
        self._stored[address] += _bits(text)

    def stored_bits(self, address: int | None) -> int:
        """The bits of command memory that a chip has filled since the line was made, at most: commands sent to it, each time that
        they were sent."""
        return self._stored[address] + self._stored_by_all

    def knows(self, address: int | None) -> bool:
        return address in self.echoing

    def forget(self, address: int | None) -> None:
        """Forget that a chip echoes, as after a reset."""
        self.echoing.discard(address)
        self.owed.pop(address, None)
        self.arrived.pop(address, None)

    def owes(self, address: int | None) -> int:
        """The number of type letters that a chip has yet to send."""
        return self.owed.get(address, 0)

    def settle(self, address: int | None) -> None:
        """Forget the pending letters of a chip that has answered: they arrive right now or were lost."""
        self.surplus += self.owed.pop(address, 0)

    def end_watch(self, owed: Mapping[int | None, int], surplus: int) -> None:
        """End a watch: set the pending letters of each chip, and the number of late ones."""
        self.letters = None
        self.surplus += surplus
        for address, count in owed.items():
            self.owed.pop(address, None)
            if count:
                self.owed[address] = count

    # ------------------------------------------------------------------ saying

    def start(self, request: ChipRequest, now: Nanos, *, urgent: bool) -> bytes:
        self._request = request
        self.device = request.address
        self._lines = []
        self.nearly_full = self._is_stuck = False
        request.committed = request.commented = False
        selection = [] if request.address in (ALL, self.selected) else [f"x{request.address:x}".encode()]
        invalid = [INVALID_COMMAND] if self.dirty else []
        text = request.text.encode("ascii")
        match request.sort:
            case ChipRequestKind.LISTEN | ChipRequestKind.LETTER | ChipRequestKind.UPLOAD:
                return self._put(b"", now)
            case ChipRequestKind.BLIND | ChipRequestKind.PROBE:
                # Its first line spoils characters that may precede it, and is sent twice.
                request.committed = True
                self.selected = ALL
                self.dirty = False
                if request.sort is ChipRequestKind.BLIND:
                    self._stored_by_all += sum(map(_bits, request.text.split("\r")))
                return self._put(text, now)
            case ChipRequestKind.KILL:
                request.committed = True
                said = b"".join(line + _END for line in (*selection, *text.splitlines()))
                if self.dirty:
                    said = INVALID_COMMAND + _END + said
                elif not self.knows(request.address):
                    said *= 2  # the first line may meet the rest of another one
                return self._put(said, now)
            case ChipRequestKind.SELECT:
                self._lines = [*invalid, *selection]
            case ChipRequestKind.LINE:
                self._lines = [*invalid, *selection, text]
        if not self._lines:
            raise Misuse(f"{request}: the driver selects chips by itself")
        return self._put(self._lines[0], now)

    def _put(self, data: bytes, now: Nanos) -> bytes:
        self._sent = data
        self._echoed = b""
        if data and self.on_bytes is not None:
            self.on_bytes(now, FrameDirection.IN, data)
        return data

    # ------------------------------------------------------------------ receiving

    def receive(self, data: bytes, now: Nanos) -> bytes | SendNext | None:
        if self.on_bytes is not None:
            self.on_bytes(now, FrameDirection.OUT, data)
        request = self._request
        if request is None or request.sort is ChipRequestKind.BLIND:
            return None
        if request.sort is ChipRequestKind.PROBE:
            self._echoed += data
            return None
        for place, byte in enumerate(data):
            outcome = self._take(request, byte, data[place + 1 :], now)
            if outcome is not None:
                return outcome
        return None

    def _take(self, request: ChipRequest, byte: int, rest: bytes, now: Nanos) -> bytes | SendNext | None:
        if request.sort is ChipRequestKind.LISTEN:
            return self._take_owed(request, byte)
        if request.sort is ChipRequestKind.LETTER:
            came = [self._uploaded(one) and one in LETTERS for one in (byte, *rest)]
            return self._done(bytes((byte,))) if any(came) else None
        if request.sort is ChipRequestKind.UPLOAD:
            for one in (byte, *rest):
                self._uploaded(one)
            return self._done(bytes((byte,)))
        if self._sent.startswith(self._echoed) and len(self._echoed) < len(self._sent):
            return self._echo(request, byte, rest, now)
        # All has come back, and an answer is waited for.
        return self._done(bytes((byte,)))

    def _take_owed(self, request: ChipRequest, byte: int) -> bytes | None:
        if byte not in LETTERS:
            self._uploaded(byte)
            return None
        self.owed[request.address] = self.owes(request.address) - 1
        self.settle(request.address)
        return self._done(bytes((byte,)))

    def _echo(self, request: ChipRequest, byte: int, rest: bytes, now: Nanos) -> bytes | SendNext | None:
        expected = self._sent[len(self._echoed)]
        if byte == expected:
            self._echoed += bytes((byte,))
            if len(self._echoed) == len(self._sent):
                return self._came_back(request, rest, now)
            return None
        # The last character of a line may come back inverted after its CR has been sent.
        last = self._echoed[-1:] or (self._lines[0][-1:] if self._sent == _END else b"")
        if last and byte == ~last[0] & 0xFF:
            self.nearly_full = True
            return None
        if byte == NO_ROOM:
            if expected == INVALID_COMMAND[0] or (
                request.sort is ChipRequestKind.KILL and self._echoed.endswith(INVALID_COMMAND)
            ):
                self._is_stuck = True
                return self._echo(request, expected, rest, now)
            self._give_up(now)
            raise NoRoom(self._place, request)
        # Uploads of a program arrive between echoes. Without the right echo nothing is taken.
        if self._uploaded(byte) or byte in (EMPTY, THREE_FREE):
            return None
        raise self._garbled(request, self._echoed + bytes((byte,)) + rest, now)

    def _garbled(self, request: ChipRequest, received: bytes, now: Nanos) -> Garbled:
        typed = request.sort is ChipRequestKind.LINE and len(self._lines) == 1 and self._sent == self._lines[0]
        request.commented = typed and b";" in received
        sent = self._sent
        self._give_up(now)
        return Garbled(self._place, request, sent, received, uncertain=request.changes)

    def _absorb(self, letter: int) -> bool:
        """Take a type letter that is not the expected answer; returns whether one was pending."""
        if self.letters is not None and self.owed:
            self.letters += 1
        elif self.owed:
            address = next(iter(self.owed))
            self.arrived[address] = letter
            self.settle(address)
            self.surplus -= 1
        elif self.surplus:
            self.surplus -= 1
        else:
            return False
        return True

    def _came_back(self, request: ChipRequest, rest: bytes, now: Nanos) -> bytes | SendNext | None:
        if request.sort is ChipRequestKind.KILL:
            self.dirty = self._is_stuck
            self.selected = request.address
            return self._done(b"")
        if self._sent != _END:
            if not all(byte == ~self._echoed[-1] & 0xFF or self._uploaded(byte) for byte in rest):
                raise self._garbled(request, self._echoed + rest, now)
            self.nearly_full |= bool(rest)
            if len(self._lines) == 1 and request.sort is ChipRequestKind.LINE:
                request.committed = True
                self.note_stored(request.address, request.text)
            return SendNext(self._put(_END, now), may_wait=False)
        return self._line_taken(request, rest, now)

    def _line_taken(self, request: ChipRequest, rest: bytes, now: Nanos) -> bytes | SendNext | None:
        line = self._lines.pop(0)
        if line == INVALID_COMMAND:
            self.dirty = self._is_stuck
            self.spoilt[request.address] = self.spoilt.get(request.address, 0) + 1
        elif request.sort is ChipRequestKind.SELECT or self._lines:
            self.selected = request.address
        if self._lines:
            return SendNext(self._put(self._lines[0], now), may_wait=False)
        if request.text == TYPE_QUERY and not request.answers:
            # Its answer may be long in coming: others may have to go first meanwhile.
            self.owed[request.address] = self.owes(request.address) + 1
        if not request.answers:
            for byte in rest:
                if byte != ~self._echoed[-1] & 0xFF:
                    self._uploaded(byte)
            return self._done(b"")
        for byte in rest:
            answer = self._take(request, byte, b"", now)
            if answer is not None:
                return answer
        self._sent = self._echoed = b""
        return None

    def _done(self, answer: bytes) -> bytes:
        self._request = None
        return answer

    def _uploaded(self, byte: int) -> bool:
        """Take a byte outside an exchange; returns whether it is a pending letter or an upload of a program."""
        if byte in LETTERS and self._absorb(byte):
            return True
        if self.uploads is None:
            return False
        self.uploads.append(byte)
        return True

    # ------------------------------------------------------------------ what goes wrong

    def _give_up(self, now: Nanos) -> None:
        request = self._request
        if request is not None and request.sort not in (ChipRequestKind.BLIND, ChipRequestKind.PROBE):
            self.dirty = True
            if request.text == TYPE_QUERY and request.committed:
                self.surplus += 1
            if self._lines and self._lines[0].startswith(b"x") and self._sent == _END:
                self.selected = ALL  # a selection that may have been taken or not
                self.echoing.clear()
        self._request = None
        self.free_ns = now + QUIET_NS + self._serial.duration(8)
        self._busy_until = now + NOISE_NS + self._serial.duration(8)

    def abandon(self, now: Nanos) -> bytes:
        received, request = self._echoed, self._request
        if request is not None and not self._expects_nothing(request):
            self._give_up(now)
            return received
        self._done(b"")
        return received if request is not None and request.sort is ChipRequestKind.PROBE else b""

    def _expects_nothing(self, request: ChipRequest) -> bool:
        """Whether nothing is wrong with the line if nothing came: no echo is missing."""
        awaits_answer = request.committed and request.answers and not self._sent and not self._lines
        return request.sort in (*_SILENT, ChipRequestKind.BLIND, ChipRequestKind.PROBE) or awaits_answer

    def stray(self, data: bytes, now: Nanos) -> None:
        if self.on_bytes is not None and data:
            self.on_bytes(now, FrameDirection.OUT, data)
        for byte in data:
            if not self._uploaded(byte) and byte not in (EMPTY, THREE_FREE):
                self.dirty = True  # the echo of characters that now precede the next command
        if now < self._busy_until:
            self.free_ns = min(now + QUIET_NS, self._busy_until)


@lru_cache
def _bits(text: str) -> int:
    """The bits of command memory that a line takes."""
    command = parse_line(text)[0].command
    return 0 if command is None else stored_bits(command)


def chip_name(address: int | None) -> str:
    return "the chip" if address is None else f"chip {address:X}"
