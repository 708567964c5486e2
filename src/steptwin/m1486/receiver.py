"""The chip's receiving side: characters into the input buffer, commands out of it into the command memory (manual chapter II,
Serial interface and Memory).

What acts when received (K, X, C75) is recognised on the way in (M-27). Blanks, line feeds and comments go no further (M-1, M-2).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import lru_cache
from typing import ClassVar, Protocol

from steptwin.controller import Fact, Nanos
from steptwin.m1486.commands import CLEAR_KILL, When, find, permitted_text, when
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.encoding import SIZES, encode
from steptwin.m1486.functions import REPORT, RETURN
from steptwin.m1486.memory import CommandMemory, FileState
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand, parse_line
from steptwin.m1486.unit import NumericUnit
from steptwin.m1486.variants import Store, Variant
from steptwin.messages import Message, text_of
from steptwin.state import Stateful

CR = 0x0D
_SKIPPED = frozenset(b"\n \t")
_SEMICOLON = ord(";")
NO_ROOM = 0x5E
THREE_FREE = 0x7E
EMPTY = 0x7F
_LAST_BYTES = 3
"""A character that leaves fewer free than this behind it is sent back inverted."""
_HEX = "0123456789ABCDEF"
_CLEAR_KILL = f"C{CLEAR_KILL}"
_MOST_SEEN = 4
"""Characters of a line that are examined as they arrive; the longest command that acts then has three."""
_DROPPED = "%"
"""Stands for the beginning of a line that was dropped: no command begins so."""
_LINES_KEPT = 4096
"""Lines that are read only once."""


class StoredProgram(Protocol):
    """The program, as far as room for new commands depends on it."""

    @property
    def pc(self) -> int: ...


class ReceiverHost(Protocol):
    """The interface of a chip to its receiver."""

    @property
    def variant(self) -> Variant: ...
    @property
    def address(self) -> int: ...
    @property
    def unit(self) -> NumericUnit: ...
    @property
    def memory(self) -> CommandMemory: ...
    @property
    def drive(self) -> ChipDrive: ...
    @property
    def program(self) -> StoredProgram: ...
    def send(self, byte: int, now: Nanos) -> None: ...
    def event(self, code: str, text: str, now: Nanos, *facts: Fact) -> None: ...
    def wrong_data_received(self, what: str, now: Nanos) -> None: ...
    def kill(self, now: Nanos) -> None: ...
    def clear_kill(self, now: Nanos) -> None: ...
    def close_file(self, now: Nanos) -> None: ...
    def software_reset(self, now: Nanos) -> None: ...


LINE_IS_TOO_LONG = Message("m1486.line-is-too-long", "a line longer than the input buffer")
KILL_TAKES_NO_NUMBER = Message("m1486.kill-takes-no-number", "{line}: K takes no number")
WRONG_ADDRESS_OF_A_CHIP = Message(
    "m1486.wrong-address-of-a-chip", "X{argument} names no chip: permitted are {permitted}, or G for all"
)
FILE_IS_TOO_LARGE = Message("m1486.file-is-too-large", "the file is larger than the command memory of {bits} bits")


class Receiver(Stateful):
    """Input buffer, selection in a chain, and the way of commands into memory."""

    FIXED: ClassVar[tuple[str, ...]] = ("_capacity", "_chip")
    __slots__ = (
        *FIXED,
        "_buffer",
        "_has_lost",
        "_in_comment",
        "_is_torn",
        "_lines",
        "_seen",
        "_seen_stored",
        "_skips_line",
        "_unanswered",
        "busy_until",
        "is_deaf",
        "is_listening",
    )

    def __init__(self, chip: ReceiverHost) -> None:
        self._chip = chip
        self._capacity = chip.variant.input_bits // 8
        self._buffer: deque[int]
        self.busy_until: Nanos | None
        """End of the present EEPROM write or erasure; no command is compressed meanwhile."""
        self.reset()

    def reset(self) -> None:
        """As after power-up: empty, and all chips of a chain listen."""
        self._buffer = deque()
        self._lines = 0
        """Whole lines in the buffer."""
        self._begin_line()
        self.is_listening = True
        self.busy_until = None
        self.is_deaf = False
        """Characters that arrive meanwhile are lost."""

    def discard(self, arriving: bytes, now: Nanos) -> None:
        """Execute nothing of what is in the buffer or ``arriving``, but K and X, so that the same chips listen as without it. The
        rest of a line that has begun is dropped when it comes."""
        for byte in arriving:
            self.character(byte, now)
        self._buffer.clear()
        self._lines = 0
        if self._seen and not self._acts_when_received():
            self._begin_line()
            self._seen, self._skips_line = _DROPPED, True

    @property
    def waiting(self) -> int:
        """Characters in the input buffer."""
        return len(self._buffer)

    @property
    def free(self) -> int:
        return self._capacity - len(self._buffer)

    @property
    def is_stalled(self) -> bool:
        """Whether whole commands wait in the buffer."""
        return self._lines > 0

    # ------------------------------------------------------------------ characters

    def character(self, byte: int, now: Nanos) -> None:
        """A character has arrived."""
        if self.is_deaf:
            return
        if byte == CR:
            self._end_of_line(now)
        elif self._in_comment or byte in _SKIPPED:
            self._echo(byte, now)
        elif byte == _SEMICOLON:
            self._in_comment = True
            self._echo(byte, now)
        else:
            self._part_of_line(byte, now)

    def _part_of_line(self, byte: int, now: Nanos) -> None:
        before = self._seen
        if len(before) < _MOST_SEEN:
            char = chr(byte)
            self._seen += char.upper() if char.isascii() else char
        if self._acts_when_received():
            self._echo(byte, now)
        elif self.is_listening and not self._skips_line and not self._store(byte, now) and not self._is_torn:
            # A lost character is not part of the line: K may follow at once.
            self._seen = before

    def _acts_when_received(self) -> bool:
        """M-27: no other command begins with K or X, so these lines are never put into the buffer."""
        return self._seen[:1] in ("K", "X")

    def _echo(self, byte: int, now: Nanos) -> None:
        if self.is_listening and self._chip.unit.on(RETURN):
            self._chip.send(byte, now)

    def _store(self, byte: int, now: Nanos) -> bool:
        """Put a character into the buffer, and answer as the fill level requires."""
        free = self.free
        if free == 0 or self._is_torn:
            self._refuse(byte, now)
            return False
        self._echo(byte, now)
        self._buffer.append(byte)
        self._seen_stored += 1
        if free <= _LAST_BYTES:
            self._chip.send(~byte & 0xFF, now)
        return True

    def _refuse(self, byte: int, now: Nanos) -> None:
        if byte != CR and _CLEAR_KILL.startswith(self._seen):
            # This may become C75, which needs no room. If it becomes something else, it has lost its beginning.
            self._is_torn = True
            self._unanswered += 1
            return
        for _ in range(self._unanswered + 1):
            self._chip.send(NO_ROOM, now)
        self._unanswered = 0
        self._has_lost = True
        if not self._lines and not self._is_torn:
            # No command is as long as the buffer; its end would never come.
            self._buffer.clear()
            self._skips_line = True
            self._chip.wrong_data_received(LINE_IS_TOO_LONG(), now)

    def _end_of_line(self, now: Nanos) -> None:
        seen, stored, skipped = self._seen, self._seen_stored, self._skips_line
        if self._acts_when_received():
            self._echo(CR, now)
            self._begin_line()
            self._act(seen, now)
        elif not self.is_listening or skipped:
            self._echo(CR, now)
            self._begin_line()
        elif seen == _CLEAR_KILL:
            self._echo(CR, now)
            self._begin_line()
            self._take_back(stored, now)
            self._chip.clear_kill(now)
        elif (self._buffer and self._buffer[-1] != CR) or self._is_torn:
            self._lines += self._store(CR, now)
            self._begin_line()
        elif self._has_lost and self.free == 0:
            self._chip.send(NO_ROOM, now)
            self._begin_line()
        else:
            self._echo(CR, now)
            self._begin_line()
        self.compress(now)

    def _begin_line(self) -> None:
        # Of the line that is arriving: its first characters, in capitals; how many of it are in the buffer; whether a beginning
        # that needed no room is missing there, and how many characters of that have no answer yet; whether characters were
        # lost; whether it was longer than the buffer, so that its rest is not a command.
        self._seen = ""
        self._seen_stored = 0
        self._in_comment = False
        self._is_torn = False
        self._unanswered = 0
        self._has_lost = False
        self._skips_line = False

    def _act(self, line: str, now: Nanos) -> None:
        """A line that begins with K or X."""
        if line[0] == "X":
            self._select(line[1:], now)
        elif self.is_listening:
            if line == "K":
                self._chip.kill(now)
            else:
                self._chip.wrong_data_received(KILL_TAKES_NO_NUMBER(line=line), now)

    def _select(self, argument: str, now: Nanos) -> None:
        """X: only the chip with this address receives from now on."""
        chip = self._chip
        if argument == "G":
            self.is_listening = True
        elif len(argument) == 1 and argument in _HEX and find("X", int(argument, 16), chip.variant) is not None:
            self.is_listening = int(argument, 16) == chip.address
        elif self.is_listening:
            chip.wrong_data_received(
                WRONG_ADDRESS_OF_A_CHIP(argument=argument, permitted=text_of(permitted_text("X", chip.variant))),
                now,
            )

    def _take_back(self, stored: int, now: Nanos) -> None:
        """A line that acted when received leaves the buffer again."""
        for _ in range(stored):
            self._buffer.pop()
        self._removed(stored, now)

    def _removed(self, count: int, now: Nanos) -> None:
        """Function 57: report that there is room again."""
        if count == 0 or not self._chip.unit.on(REPORT):
            return
        if self.free - count < _LAST_BYTES <= self.free:
            self._chip.send(THREE_FREE, now)
        if not self._buffer:
            self._chip.send(EMPTY, now)

    # ------------------------------------------------------------------ compression

    def compress(self, now: Nanos) -> None:
        """Move commands from the buffer to the memory as far as that is possible now."""
        while self._lines and self.busy_until is None:
            length = self._buffer.index(CR)
            text = bytes(self._buffer[i] for i in range(length)).decode("latin-1")
            command = _read(text, self._chip.variant)
            if self._is_stopped_by_motor() or (isinstance(command, ChipCommand) and self._lacks_memory(command)):
                return
            for _ in range(length + 1):
                self._buffer.popleft()
            self._lines -= 1
            self._removed(length + 1, now)
            if isinstance(command, ChipCommand):
                self._take(command, now)
            else:
                self._chip.wrong_data_received(command, now)

    def commands_waiting(self) -> Sequence[ChipCommand]:
        """Commands of the whole lines in the buffer."""
        return commands_of(bytes(self._buffer), self._chip.variant)

    def _is_stopped_by_motor(self) -> bool:
        """Whether compression pauses because the motor runs; inside ``[ ]`` it continues."""
        return self._chip.drive.is_busy and self._chip.memory.file is FileState.CLOSED

    def _lacks_memory(self, command: ChipCommand) -> bool:
        """Whether a command would overwrite others that are still to be done."""
        chip = self._chip
        memory = chip.memory
        if memory.file is FileState.REFUSED or when(command.key, command.number) is not When.QUEUED:
            return False
        size = SIZES[command.key[0]]
        if memory.file is FileState.OPEN and not memory.fits_file(size):
            return False
        return not memory.has_room(size, chip.program.pc)

    def _take(self, command: ChipCommand, now: Nanos) -> None:
        chip = self._chip
        memory = chip.memory
        match command.key:
            case "[":
                if memory.file is FileState.CLOSED:
                    memory.open_file()
            case "]":
                chip.close_file(now)
            case "\\":
                chip.software_reset(now)
            case "@":
                memory.label(command.number or 0)
            case "C" if command.number == CLEAR_KILL:
                chip.clear_kill(now)
            case _:
                self._store_command(command, now)

    def _store_command(self, command: ChipCommand, now: Nanos) -> None:
        chip = self._chip
        memory = chip.memory
        if memory.file is FileState.REFUSED:
            return
        raw = encode(command)
        if memory.file is FileState.OPEN and not memory.fits_file(len(raw)):
            memory.refuse_file()
            chip.send(NO_ROOM, now)
            bits = chip.variant.memory_bits
            chip.event("file-refused", FILE_IS_TOO_LARGE(bits=bits), now, ("memory", bits))
            return
        memory.store(raw)
        if chip.variant.store is Store.EEPROM:
            self.busy_until = now + chip.variant.write_ns
        elif memory.file is FileState.CLOSED:
            memory.enable()

    def erase(self, now: Nanos) -> None:
        """The EEPROM is being erased; what arrives meanwhile is lost."""
        self.busy_until = now + self._chip.variant.erase_ns
        self.is_deaf = True

    def eeprom_done(self, now: Nanos) -> None:
        """Writing or erasing has ended: the stored file may run, and waiting commands are compressed."""
        self.busy_until = None
        self.is_deaf = False
        if self._chip.memory.file is FileState.CLOSED:
            self._chip.memory.enable()
        self.compress(now)


NO_COMMAND = Message("m1486.empty-command", "no command")
WRONG_LINE = Message("m1486.wrong-line", "{text}: {problem}")


def commands_of(data: bytes, variant: Variant) -> Sequence[ChipCommand]:
    """Commands of the whole lines among characters."""
    commands = (_read(line, variant) for line in data.decode("latin-1").split("\r")[:-1])
    return [command for command in commands if isinstance(command, ChipCommand)]


@lru_cache(_LINES_KEPT)
def _read(text: str, variant: Variant) -> ChipCommand | str:
    """The command of a line, or a description of its error."""
    line, found = parse_line(text)
    command = line.command
    if command is None:
        return WRONG_LINE(text=text, problem=text_of(found[0].message) if found else NO_COMMAND())
    # Where in the line it stood is not part of a command that may be kept.
    return out_of_range(command, variant) or ChipCommand(command.key, command.argument)
