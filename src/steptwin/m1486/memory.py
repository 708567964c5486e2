"""The command memory of a chip: a ring of bytes that commands pass through, labels, and the registers 1 to 8.

M-12: a command stays where it is until the ring comes round and overwrites it. Commands before ``end`` may run; those between
``end`` and ``write`` belong to a file in ``[ ]`` that is still open or are being written to an EEPROM.

Places are counted modulo twice the size of the ring, to distinguish a full ring from an empty one; the byte of a place is
its remainder by the size.
"""

from __future__ import annotations

import enum
from array import array
from typing import ClassVar, NamedTuple, Protocol

from steptwin.m1486.encoding import LONGEST
from steptwin.m1486.registers import GENERAL
from steptwin.m1486.variants import Variant
from steptwin.state import Stateful


class FileState(enum.Enum):
    """The destination of received commands."""

    CLOSED = "closed"
    OPEN = "open"
    """Between ``[`` and ``]``: they are stored."""
    REFUSED = "refused"
    """The same, but the file is not to run: they are dropped."""


class StoredFile(NamedTuple):
    """A file as it is stored: its bytes and where its labels are, counted from its first byte."""

    code: bytes
    labels: dict[int, int]


class MemorySubscriber(Protocol):
    """The executor of the commands, which is notified of overwritten ones."""

    def bytes_changed(self, first: int, count: int) -> None: ...
    def labels_changed(self) -> None: ...


class CommandMemory(Stateful):
    """The memory of one chip. On some variants its last bytes are the registers 1 to 8 too."""

    FIXED: ClassVar[tuple[str, ...]] = ("_reader", "_shared", "size", "span")
    __slots__ = (*FIXED, "_bytes", "_file_labels", "_own", "begin", "end", "file", "labels", "write")

    def __init__(self, variant: Variant, reader: MemorySubscriber) -> None:
        self._reader = reader
        self.size = variant.memory_bits // 8
        self.span = 2 * self.size
        """Number of places."""
        self._shared = self.size - variant.shared_bits // 8 if variant.shared_bits else None
        """First byte of the registers that share the memory; None where they have a place of their own."""
        self.begin: int | None
        """Beginning of the program that a restart runs (M-23); None once it is overwritten."""
        self.labels: dict[int, int]
        self._file_labels: dict[int, int]
        self._clear()

    def reset(self) -> None:
        """Empty the memory: the next command goes to the first byte."""
        self._clear()
        self._reader.bytes_changed(0, self.size)

    def _clear(self) -> None:
        self._bytes = array("B", bytes(self.size))
        self._own = array("H", [0] * len(GENERAL))
        self.write = 0
        """Place of the next command."""
        self.end = 0
        """Commands before this place may run."""
        self.begin = 0
        self.file = FileState.CLOSED
        self.labels = {}
        self._file_labels = {}

    # ------------------------------------------------------------------ commands

    def age(self, place: int) -> int:
        """Number of bytes written from ``place`` on."""
        return (self.write - place) % self.span

    def is_lost(self, place: int) -> bool:
        return self.age(place) > self.size

    def has_room(self, size: int, oldest: int) -> bool:
        """Whether ``size`` bytes leave everything from ``oldest`` on as it is."""
        return self.age(oldest) + size <= self.size

    def fits_file(self, size: int) -> bool:
        """Whether the open file may grow by ``size`` bytes."""
        return self.age(self.end) + size <= self.size

    def store(self, raw: bytes) -> None:
        """Write a command at the present place of the ring; its old contents are lost."""
        place = self.write
        for offset, byte in enumerate(raw):
            self._bytes[(place + offset) % self.size] = byte
        self.write = (place + len(raw)) % self.span
        self._reader.bytes_changed(place % self.size, len(raw))
        self._forget_lost_places()

    def _forget_lost_places(self) -> None:
        lost = [label for label, place in self.labels.items() if self.is_lost(place)]
        for label in lost:
            del self.labels[label]
        if lost:
            self._reader.labels_changed()
        if self.begin is not None and self.is_lost(self.begin):
            self.begin = None

    def fetch(self, place: int) -> bytes:
        """The bytes of the command at ``place`` and perhaps some more."""
        first = place % self.size
        raw = self._bytes[first : first + LONGEST].tobytes()
        return raw if len(raw) == LONGEST else raw + self._bytes[: LONGEST - len(raw)].tobytes()

    def label(self, number: int) -> None:
        """Give the next command a label; inside a file it is there when the file is."""
        if self.file is FileState.OPEN:
            self._file_labels[number] = self.write
        else:
            self.labels[number] = self.write
            self._reader.labels_changed()

    def enable(self) -> None:
        """Release the written commands for execution."""
        self.end = self.write

    # ------------------------------------------------------------------ files

    def open_file(self) -> None:
        self.file = FileState.OPEN
        self._file_labels = {}

    def refuse_file(self) -> None:
        """Drop the open file and the rest of it."""
        self.file = FileState.REFUSED
        self.write = self.end

    def drop_file(self) -> None:
        """Discard an open file."""
        self.file = FileState.CLOSED
        self.write = self.end

    def close_file(self) -> StoredFile | None:
        """Close the file, which may then run; None if it was refused."""
        stored = self.file is FileState.OPEN
        self.file = FileState.CLOSED
        if not stored:
            return None
        self.begin = begin = self.end
        code = bytes(self._bytes[(begin + offset) % self.size] for offset in range(self.age(begin)))
        image = StoredFile(code, {label: (place - begin) % self.span for label, place in self._file_labels.items()})
        self.labels |= self._file_labels
        self.enable()
        self._reader.labels_changed()
        return image

    def holds(self, place: int, file: StoredFile) -> bool:
        """Whether the commands from ``place`` on are those of a file, none of them overwritten."""
        if self.is_lost(place) or self.age(place) < len(file.code):
            return False
        bytes_are = all(self._bytes[(place + offset) % self.size] == byte for offset, byte in enumerate(file.code))
        return bytes_are and all(self.labels.get(label) == (place + at) % self.span for label, at in file.labels.items())

    def load(self, image: StoredFile) -> None:
        """Put a stored file at the beginning of the empty memory; it may run."""
        registers = self._own
        self.reset()
        self._own = registers
        self._bytes[: len(image.code)] = array("B", image.code)
        self.write = len(image.code)
        self.labels = dict(image.labels)
        self.enable()

    # ------------------------------------------------------------------ registers 1 to 8

    def registers(self) -> bytes:
        """All of them."""
        return (self._own if self._shared is None else self._bytes[self._shared : self._shared + 2 * len(GENERAL)]).tobytes()

    def register(self, number: int) -> int:
        if self._shared is None:
            return self._own[number - 1]
        low = self._shared + 2 * (number - 1)
        return self._bytes[low] | self._bytes[low + 1] << 8

    def set_register(self, number: int, value: int) -> None:
        """Keep the low 16 bits of ``value``. In shared memory this destroys the command at that place."""
        if self._shared is None:
            self._own[number - 1] = value & 0xFFFF
            return
        low = self._shared + 2 * (number - 1)
        self._bytes[low] = value & 0xFF
        self._bytes[low + 1] = value >> 8 & 0xFF
        self._reader.bytes_changed(low, 2)
