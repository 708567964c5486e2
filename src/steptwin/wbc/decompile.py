"""Decompile an image to source. Labels and names of positions are invented, because the image has none.

Building the source gives the same bytes; statements with an inferred form (WBC-40) are marked by a comment, and built only
on request. Unknown records, and known ones in a form that the builder does not write, become a ``//!record`` line (a comment to
the vendor's tool, raw data to the builder); a row no position table can express becomes a ``//!position`` line.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from itertools import pairwise

from steptwin.diagnostics import Diagnostic, SourceText, Span
from steptwin.errors import Misuse
from steptwin.messages import MessageText
from steptwin.wbc import image as im
from steptwin.wbc.check import check
from steptwin.wbc.events import INPUT_LABELS
from steptwin.wbc.findings import INFERRED
from steptwin.wbc.positions import PARAMETERS, PositionTable, number_text, table_of
from steptwin.wbc.printer import format_text
from steptwin.wbc.real import shortest
from steptwin.wbc.registers import ROWS
from steptwin.wbc.syntax import POSITION_MARK, RECORD_MARK
from steptwin.wire.crc import crc16

_REAL = struct.Struct("<f")
_TITLE = "// Decompiled from a compiled image: labels and names of positions are invented."
MARK = "// inferred"
"""The comment of a statement whose form was never seen in an image (WBC-40)."""
_CLASSES = {code: ROWS[key] for key, code in (im.REGISTER_CLASSES | im.INFERRED_CLASSES).items()}
_INFERRED_CLASSES = frozenset(im.INFERRED_CLASSES.values())
_ALONE = {im.RETURN: "RETURN", im.WAITPOS: "WAITPOS", im.INFERRED_PROGRESET: "PROGRESET"}
_MOTIONS = {im.HOME: "HOME"} | {code: keyword for keyword, code in im.INFERRED_MOTIONS.items()}
_HALTS = {code: keyword for keyword, code in im.INFERRED_HALTS.items()}
_ROW_MOTIONS = {im.MOVEPTP: "MOVEPTP"} | {code: keyword for keyword, code in im.INFERRED_ROW_MOTIONS.items()}
_INFERRED_OPS = (frozenset(_MOTIONS) | frozenset(_HALTS) | frozenset(_ROW_MOTIONS) | {im.INFERRED_PROGRESET}) - {
    im.HOME,
    im.MOVEPTP,
}


IMAGE = ".wbc"
"""The suffix of compiled images."""


class ImageError(Misuse):
    """The bytes are no compiled image, or a damaged one."""


@dataclass(frozen=True, slots=True)
class Image:
    """The used records (16 bytes each) and the used rows (18 bytes each)."""

    records: tuple[bytes, ...]
    rows: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class Decompiled:
    """``unknown`` counts the records that stayed raw data, ``inferred`` those whose form was never seen in an image (WBC-40)."""

    text: str
    positions: PositionTable
    unknown: int
    inferred: int = 0


def read_image(data: bytes) -> Image:
    """The used part of an image. Raises `ImageError` when size, counts, CRCs or unused bytes are not those of an image."""
    if len(data) != im.SIZE:
        raise ImageError(f"not a compiled image: {len(data)} bytes instead of {im.SIZE}")
    commands = _used(data, 0, im.COMMANDS_AT, im.SLOT_BYTES, "commands")
    rows = _used(data, im.ROWS_AT, im.POSITIONS_AT, im.ROW_BYTES, "positions")
    return Image(commands, rows)


def _used(data: bytes, start: int, end: int, size: int, what: str) -> tuple[bytes, ...]:
    count = int.from_bytes(data[end : end + 2], "little")
    most = (end - start) // size
    if count > most:
        raise ImageError(f"damaged image: {count} {what}, permitted are 0…{most}")
    used = data[start : start + count * size]
    stored, found = int.from_bytes(data[end + 2 : end + 4], "big"), crc16(used)
    if stored != found:
        raise ImageError(f"damaged image: the CRC of the {what} is {stored:04X}, their bytes give {found:04X}")
    if any(data[start + count * size : end]):
        raise ImageError(f"damaged image: bytes after the {count} {what} are not 0")
    return tuple(used[n : n + size] for n in range(0, len(used), size))


def decompile(data: bytes) -> Decompiled:
    """Source and position table of an image. Raises `ImageError` for bytes that are none."""
    image = read_image(data)
    table, raw_rows = _table(image.rows)
    raw: set[int] = set()
    while True:
        attempt = _Attempt(image.records, len(image.rows), raw, raw_rows)
        text = attempt.text()
        wrong = _differing(text, attempt, table, image)
        if not wrong:
            inferred = sum(line.endswith(MARK) for line in text.splitlines())
            return Decompiled(text, table, len(attempt.raw), inferred)
        if wrong <= attempt.raw:
            raise ImageError(f"slots {sorted(wrong)} of this image cannot be written as source")
        raw = attempt.raw | wrong


def program_of(data: bytes, name: str) -> tuple[SourceText, PositionTable, list[Diagnostic]]:
    """The program and position table of an image that is to be run, and its warnings.

    Raises `Misuse` for a file that is not an image, or has unknown records.
    """
    try:
        found = decompile(data)
    except ImageError as error:
        raise Misuse(f"cannot run {name}: {error}") from None
    if found.unknown:
        records = "1 of its records is" if found.unknown == 1 else f"{found.unknown} of its records are"
        raise Misuse(f"cannot run {name}: {records} not known; 'steptwin decompile' shows the others")
    doubts: list[Diagnostic] = []
    if found.inferred:
        place = found.text.index(MARK)
        statements = "1 statement is" if found.inferred == 1 else f"{found.inferred} statements are"
        message = f"{statements} inferred from the order of the vendor's keywords (WBC-40)"
        hint = f"they are marked '{MARK}' by steptwin decompile; whether the device does the same is not known"
        doubts.append(INFERRED.at(Span(place, place + len(MARK)), MessageText(message), MessageText(hint)))
    return SourceText(name, found.text), found.positions, doubts


def _differing(text: str, attempt: _Attempt, table: PositionTable, image: Image) -> set[int]:
    """The slots whose line is refused by the checker, or would be built into other bytes."""
    checked = check(text, table)
    if checked.executable is None:
        lines = SourceText("", text)
        return {attempt.slot_of_line(lines.position(d.span.start)[0]) for d in checked.errors}
    built, refused = im.build(checked.executable, table, inferred=True)
    if built is None:
        raise ImageError(f"the source of this image cannot be built: {refused[0].message}")
    records = read_image(built).records
    return {slot for slot, record in enumerate(image.records) if records[slot] != record}


# ---------------------------------------------------------------------- rows


def _table(rows: tuple[bytes, ...]) -> tuple[PositionTable, dict[int, bytes]]:
    """The table of the rows, and those it cannot express."""
    named = [(f"P{index}", _row_values(row)) for index, row in enumerate(rows)]
    table = table_of(named)
    raw = {
        index: row for index, row in enumerate(rows) if im.row_bytes(table.rows[index], rows[index - 1] if index else None) != row
    }
    return table, raw


def _row_values(row: bytes) -> list[float | None]:
    mask = int.from_bytes(row[:2], "big")
    values = struct.unpack("<4f", row[2:])
    return [shortest(values[n]) if mask & 1 << n and math.isfinite(values[n]) else None for n in range(PARAMETERS)]


# ---------------------------------------------------------------------- records


class _Attempt:
    """One way to write the records: slots in ``raw`` are written as data, and so is what cannot be read."""

    def __init__(self, records: tuple[bytes, ...], rows: int, raw: set[int], raw_rows: dict[int, bytes]) -> None:
        self.raw = set(raw)
        self._records = records
        self._rows = rows
        self._raw_rows = raw_rows
        self._labels: dict[int, str] = {}
        self._line_slots: list[int] = []
        self._inferred = False

    def text(self) -> str:
        records = self._records
        self.raw |= _stray_blocks(records, self.raw)
        entries = {
            slot: record[1] + 1
            for slot, record in enumerate(records)
            if slot not in self.raw and record[0] == im.ENTRY and record[1] < INPUT_LABELS
        }
        for slot, record in enumerate(records):
            target = int.from_bytes(record[1:3], "little")
            if record[0] == im.JUMP and slot not in self.raw:
                self._labels[target] = f"INT_IN{entries[target]}" if target in entries else f"L{target}"
        lines = [_TITLE, *(f"{POSITION_MARK} {index} {row.hex()}" for index, row in self._raw_rows.items())]
        self._line_slots = [0] * len(lines)
        for slot, record in enumerate(records):
            if slot in self._labels and slot not in entries:
                lines.append(f"{self._labels[slot]}:")
                self._line_slots.append(slot)
            self._inferred = record[0] in _INFERRED_OPS
            statement = None if slot in self.raw else self._statement(record)
            if statement is not None and self._inferred:
                statement = f"{statement}  {MARK}"
            if statement is None:
                self.raw.add(slot)
                statement = f"{RECORD_MARK} {record.hex()}"
            lines.append(statement)
            self._line_slots.append(slot)
        return format_text("".join(line + "\n" for line in lines))

    def slot_of_line(self, line: int) -> int:
        """The slot a line (from 1) of the text stands for, for a label the slot it names; lines above count as slot 0."""
        return self._line_slots[line - 1]

    def _statement(self, record: bytes) -> str | None:
        op = record[0]
        if op == im.SET:
            target, value = self._register(record[1], record[2]), self._value(record[5:10])
            return None if target is None or value is None else f"SET {target} = {value}"
        if op in (im.IF, im.WHILE, im.WAIT):
            condition = self._condition(record)
            keyword = {im.IF: "IF", im.WHILE: "WHILE", im.WAIT: "WAIT"}[op]
            return None if condition is None else f"{keyword} {condition}"
        if op in _BLOCK_ENDS:
            return _BLOCK_ENDS[op]
        if op == im.DELAY:
            seconds = self._value(record[1:6])
            return None if seconds is None else f"DELAY {seconds}"
        if op == im.JUMP:
            target = int.from_bytes(record[1:3], "little")
            return f"JUMP {self._labels[target]}" if target < len(self._records) else None
        if op == im.ENTRY:
            return f"INT_IN{record[1] + 1}:" if record[1] < INPUT_LABELS else None
        if op in _MOTIONS:
            value = self._value(record[3:8])
            return None if value is None else f"{_MOTIONS[op]} M{record[2]} {value}"
        if op in _HALTS:
            return f"{_HALTS[op]} M{record[2]}"
        if op in _ROW_MOTIONS:
            row = self._value(record[1:6])
            return None if row is None else f"{_ROW_MOTIONS[op]} {self._row(row)}"
        return _ALONE.get(op)

    def _row(self, index: str) -> str:
        return f"@P{index}" if index.isdigit() and int(index) < self._rows else index

    def _condition(self, record: bytes) -> str | None:
        left, right, sign = self._value(record[1:6]), self._value(record[7:12]), chr(record[6])
        return None if left is None or right is None or sign not in im.CONDITION_SIGNS else f"{left} {sign} {right}"

    def _value(self, data: bytes) -> str | None:
        if data[0] in (im.WHOLE, im.FRACTION):
            (value,) = _REAL.unpack(data[1:])
            return number_text(shortest(value)) if math.isfinite(value) else None
        return self._register(data[0], data[1])

    def _register(self, code: int, number: int) -> str | None:
        row = _CLASSES.get(code)
        if row is None or (number and not row.last):
            return None
        self._inferred = self._inferred or code in _INFERRED_CLASSES
        return f"{row.name}{number}" if row.last else row.name


_BLOCK_ENDS = {im.ENDIF: "ENDIF", im.ELSE: "ELSE", im.ENDWHILE: "ENDWHILE"}
_BLOCKS = frozenset({im.IF, im.WHILE, *_BLOCK_ENDS})


def _stray_blocks(records: tuple[bytes, ...], raw: set[int]) -> set[int]:
    """Block records that do not belong to a block whose parts name each other and which nests in the others."""
    claims: dict[int, tuple[int, ...]] = {}
    for slot, record in enumerate(records):
        if record[0] in (im.IF, im.WHILE) and slot not in raw:
            parts = _block(records, slot)
            if parts and not raw.intersection(parts):
                claims[slot] = parts
    kept: set[int] = set()
    open_blocks: list[tuple[int, ...]] = []
    for slot in range(len(records)):
        while open_blocks and open_blocks[-1][-1] < slot:
            open_blocks.pop()
        parts = claims.get(slot)
        if parts is None or (open_blocks and not _nests(parts, open_blocks[-1])) or kept.intersection(parts):
            continue
        kept.update(parts)
        open_blocks.append(parts)
    return {slot for slot, record in enumerate(records) if record[0] in _BLOCKS and slot not in kept}


def _block(records: tuple[bytes, ...], slot: int) -> tuple[int, ...] | None:
    """The slots of the block that begins here, in order, when its records name each other."""
    record, count = records[slot], len(records)
    close = int.from_bytes(record[12:14], "little")
    if not slot < close < count:
        return None
    if record[0] == im.WHILE:
        back = int.from_bytes(records[close][12:14], "little")
        return (slot, close) if records[close][0] == im.ENDWHILE and back == slot else None
    if records[close][0] != im.ENDIF:
        return None
    middle = int.from_bytes(record[14:16], "little")
    if middle == 0:
        return slot, close
    if not slot < middle < close or records[middle][0] != im.ELSE:
        return None
    return (slot, middle, close) if int.from_bytes(records[middle][12:14], "little") == close else None


def _nests(inner: tuple[int, ...], outer: tuple[int, ...]) -> bool:
    """Whether a block lies between two neighbouring parts of another."""
    return any(before < inner[0] and inner[-1] < after for before, after in pairwise(outer))
