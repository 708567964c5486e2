"""The compiled image (`.wbc`) of firmware 1.25, for the operations that are documented.

20 094 bytes: 1000 slots of 16 bytes, the number of commands and their CRC, 227 rows of 18 bytes, the number of positions and
their CRC. Little-endian, except the axis mask of a row and both CRCs.
"""

from __future__ import annotations

import struct

from steptwin.diagnostics import Diagnostic
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.positions import PARAMETERS, PositionRow, PositionTable
from steptwin.wbc.statements import STATEMENTS
from steptwin.wire.crc import crc16

SLOTS = 1000
SLOT_BYTES = 16
ROWS = 227
ROW_BYTES = 18
COMMANDS_AT = SLOTS * SLOT_BYTES
ROWS_AT = COMMANDS_AT + 4
POSITIONS_AT = ROWS_AT + ROWS * ROW_BYTES
SIZE = POSITIONS_AT + 4

SET, IF, ENDIF, ELSE, WHILE, ENDWHILE, WAIT, DELAY, JUMP, RETURN, ENTRY = range(1, 12)
HOME, WAITPOS, MOVEPTP = 0x0E, 0x15, 0x16

WHOLE, FRACTION = 0xFE, 0xFF
NO_OPERATOR = b"\xf9\xf9"
DRIVE = 0x06
REGISTER_CLASSES = {
    "OUT": 0x00,
    "IN": 0x02,
    "M": DRIVE,
    "ACCM": 0x07,
    "DECM": 0x08,
    "VMAXM": 0x0A,
    "STATM": 0x0C,
    "LIMLM": 0x0F,
    "LIMRM": 0x10,
    "CFGINT_IN": 0x14,
}
CONDITION_SIGNS = "=<>"
"""Conditions are one character: there is no room for <= and >=."""

_REAL = struct.Struct("<f")
_SLOT_NUMBER = struct.Struct("<H")


class _NotEncodable(Exception):
    """The text says what has no documented form."""


def build(executable: s.Executable, positions: PositionTable) -> tuple[bytes | None, list[Diagnostic]]:
    """The image of a program without errors and of its table; None and every reason when something has no documented form."""
    diagnostics: list[Diagnostic] = []
    records: list[bytes] = []
    for number, step in enumerate(executable.steps):
        if number == SLOTS:
            diagnostics.append(f.IMAGE_FULL.at(step, f"{len(executable.steps)} commands", f"the image holds {SLOTS}"))
            break
        try:
            records.append(_record(number, step).ljust(SLOT_BYTES, b"\0"))
        except _NotEncodable as reason:
            diagnostics.append(f.NOT_ENCODABLE.at(step, f"{reason} has no documented form in the image"))
    if diagnostics:
        return None, diagnostics
    rows: list[bytes] = []
    for index, row in enumerate(positions.rows):
        rows.append(executable.position_records.get(index) or row_bytes(row, rows[-1] if rows else None))
    return image_of(records, rows), []


def image_of(records: list[bytes], rows: list[bytes]) -> bytes:
    """An image of whole records and rows."""
    commands, table = b"".join(records), b"".join(rows)
    return b"".join(
        (
            commands.ljust(COMMANDS_AT, b"\0"),
            _SLOT_NUMBER.pack(len(records)),
            crc16(commands).to_bytes(2, "big"),
            table.ljust(ROWS * ROW_BYTES, b"\0"),
            _SLOT_NUMBER.pack(len(rows)),
            crc16(table).to_bytes(2, "big"),
        )
    )


def row_bytes(row: PositionRow, before: bytes | None) -> bytes:
    """A row; an ``x`` keeps the value of the row before, 0 in the first one."""
    kept = before[2:] if before is not None else bytes(4 * PARAMETERS)
    values = (kept[4 * n : 4 * n + 4] if value is None else _REAL.pack(value) for n, value in enumerate(row.values))
    return row.mask.to_bytes(2, "big") + b"".join(values)


_ALONE: dict[type[s.Step], int] = {s.EndIf: ENDIF, s.Return: RETURN, s.WaitPos: WAITPOS}


def _record(number: int, step: s.Step) -> bytes:
    if type(step) in _ALONE:
        return bytes((_ALONE[type(step)],))
    match step:
        case s.Set():
            return _set(step)
        case s.If(condition=condition, middle=middle, close=close):
            return bytes((IF,)) + _condition(condition) + _slot(close) + _slot(middle or 0)
        case s.Else(close=close):
            return bytes((ELSE,)).ljust(12, b"\0") + _slot(close)
        case s.While(condition=condition, close=close):
            return bytes((WHILE,)) + _condition(condition) + _slot(close)
        case s.EndWhile(condition=condition, open=opened):
            return bytes((ENDWHILE,)) + _condition(condition) + _slot(opened)
        case s.Wait(condition=condition):
            return bytes((WAIT,)) + _condition(condition)
        case s.Delay(seconds=seconds):
            return bytes((DELAY,)) + _value(seconds)
        case s.Jump(target=target):
            return bytes((JUMP,)) + _slot(target)
        case s.Entry(event=event, hard=hard):
            if hard or not event.input:
                raise _NotEncodable(f"the label {'HARDINT' if hard else 'INT'}_{event.name}")
            return bytes((ENTRY, event.input - 1)) + _slot(number)
        case s.Motion(keyword="HOME", axis=axis, value=value):
            return bytes((HOME, DRIVE, axis)) + _value(value)
        case s.RowMotion(keyword="MOVEPTP", row=row):
            return bytes((MOVEPTP,)) + _value(row)
        case s.Illegal(data=data):
            return data
        case _:
            raise _NotEncodable(_statement_name(step))


def _statement_name(step: s.Step) -> str:
    match step:
        case s.Motion(keyword=keyword) | s.Halt(keyword=keyword) | s.RowMotion(keyword=keyword):
            return keyword
        case _:
            name = type(step).__name__.upper()
            return name if name in STATEMENTS else f"the step {name}"


def _set(step: s.Set) -> bytes:
    value = step.value
    if isinstance(value, s.Operation):
        raise _NotEncodable(f"the operator {value.operator}")
    if isinstance(value, s.Function):
        raise _NotEncodable(f"the function {value.name}")
    return bytes((SET, *_class_and_number(step.target), 0, 0)) + _value(value) + NO_OPERATOR


def _condition(condition: s.Comparison) -> bytes:
    if condition.sign not in CONDITION_SIGNS:
        raise _NotEncodable(f"the comparison {condition.sign}")
    return _value(condition.left) + condition.sign.encode("ascii") + _value(condition.right)


def _value(source: s.Source) -> bytes:
    if isinstance(source, s.Literal):
        whole = source.value == int(source.value)
        return bytes((WHOLE if whole else FRACTION,)) + _REAL.pack(source.value)
    return bytes((*_class_and_number(source), 0, 0, 0))


def _class_and_number(source: s.Register | s.Variable) -> tuple[int, int]:
    if isinstance(source, s.Variable):
        raise _NotEncodable(f"the variable {source.name}")
    code = REGISTER_CLASSES.get(source.row.key)
    if code is None:
        raise _NotEncodable(f"the register {source.name}")
    return code, source.number


def _slot(number: int) -> bytes:
    return _SLOT_NUMBER.pack(number)
