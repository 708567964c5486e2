"""The compiled image (`.wbc`) of firmware 1.25, for the operations that are documented.

20 094 bytes: 1000 slots of 16 bytes, the number of commands and their CRC, 227 rows of 18 bytes, the number of positions and
their CRC. Little-endian, except the axis mask of a row and both CRCs.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

from steptwin.diagnostics import Diagnostic
from steptwin.errors import Misuse
from steptwin.messages import MessageText
from steptwin.tables import complete
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.positions import PARAMETERS, PositionRow, PositionTable
from steptwin.wbc.statements import HALTS, MOTIONS, ROW_MOTIONS
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
# WBC-40: by the order of the keywords in the vendor's tool, which fits every operation that was seen in an image.
INFERRED_MOTIONS = complete("motion", MOTIONS - {"HOME"}, "code", {"VABS": 0x0F, "VREL": 0x10, "PABS": 0x11, "PREL": 0x12})
INFERRED_HALTS = complete("halt", HALTS, "code", {"BRAKE": 0x13, "STOP": 0x14})
INFERRED_ROW_MOTIONS = complete(
    "statement with a row",
    ROW_MOTIONS - {"MOVEPTP"},
    "code",
    {"MOVELIN": 0x17, "MOVELIN_REL": 0x18, "MOVETOCIRC": 0x19, "DOCIRC": 0x1A, "DOARC": 0x1B},
)
INFERRED_PROGRESET = 0x1C

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
# WBC-40
INFERRED_CLASSES = {
    "OUTPUTS": 0x01,
    "INPUTS": 0x03,
    "AIN": 0x04,
    "STATUS": 0x05,
    "POSM": 0x09,
    "VACTM": 0x0B,
    "ENC": 0x0D,
    "XENC": 0x0E,
}
CONDITION_SIGNS = "=<>"
"""Conditions are one character: there is no room for <= and >=."""
_OPPOSITES = {"<=": ">", ">=": "<"}

_REAL = struct.Struct("<f")
_SLOT_NUMBER = struct.Struct("<H")


class _NotEncodable(Exception):
    """A step whose record format is not documented; the text names it."""

    def __init__(self, what: str, hint: str | None = None) -> None:
        super().__init__(what)
        self.hint = hint


def build(executable: s.Executable, positions: PositionTable, *, inferred: bool = False) -> tuple[bytes | None, list[Diagnostic]]:
    """The image of a program without errors and of its table; None and every reason if a statement has no documented form.
    Raises `Misuse` for a table with more rows than the image holds.

    ``inferred``: forms that follow from the order of the keywords, but were never seen in an image (WBC-40), are taken too.
    """
    diagnostics: list[Diagnostic] = []
    records: list[bytes] = []
    for number, step in enumerate(executable.steps):
        if number == SLOTS:
            diagnostics.append(
                f.IMAGE_FULL.at(step, MessageText(f"{len(executable.steps)} commands"), MessageText(f"the image holds {SLOTS}"))
            )
            break
        try:
            record = _Record(number)
            records.append(record.of(step).ljust(SLOT_BYTES, b"\0"))
        except _NotEncodable as reason:
            message = MessageText(f"{reason} has no documented form in the image")
            diagnostics.append(f.NOT_ENCODABLE.at(step, message, None if reason.hint is None else MessageText(reason.hint)))
        else:
            if record.inferred and not inferred:
                message = f"{record.inferred[0]} has no documented form in the image"
                hint = "--inferred writes it in a form that was never seen (WBC-40)"
                diagnostics.append(f.NOT_ENCODABLE.at(step, MessageText(message), MessageText(hint)))
    if diagnostics:
        return None, diagnostics
    if len(positions.rows) > ROWS:
        raise Misuse(f"{len(positions.rows)} rows of positions: the image holds {ROWS}")
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


class _Record:
    """The record of the step with this number. ``inferred`` names what of it follows from the order of the keywords only."""

    def __init__(self, number: int) -> None:
        self._number = number
        self.inferred: list[str] = []

    def of(self, step: s.ProgramStep) -> bytes:
        return _ENCODINGS[type(step)](self, step)

    def if_(self, step: s.IfStep) -> bytes:
        return bytes((IF,)) + self.condition(step.condition) + _slot(step.close) + _slot(step.middle or 0)

    def entry(self, step: s.InterruptStep) -> bytes:
        event = step.event
        if step.hard or not event.input:
            raise _NotEncodable(f"the label {'HARDINT' if step.hard else 'INT'}_{event.name}")
        return bytes((ENTRY, event.input - 1)) + _slot(self._number)

    def motion(self, step: s.MotionStep) -> bytes:
        code = HOME if step.keyword == "HOME" else self._inferred(step.keyword, INFERRED_MOTIONS)
        return bytes((code, DRIVE, step.axis)) + self.value(step.value)

    def halt(self, step: s.HaltStep) -> bytes:
        return bytes((self._inferred(step.keyword, INFERRED_HALTS), DRIVE, step.axis))

    def row_motion(self, step: s.RowMotionStep) -> bytes:
        code = MOVEPTP if step.keyword == "MOVEPTP" else self._inferred(step.keyword, INFERRED_ROW_MOTIONS)
        return bytes((code,)) + self.value(step.row)

    def prog_reset(self) -> bytes:
        return bytes((self._infer("PROGRESET", INFERRED_PROGRESET),))

    def unknown(self, keyword: str) -> bytes:
        """A statement without a documented form."""
        raise _NotEncodable(keyword)

    def _inferred(self, keyword: str, codes: Mapping[str, int]) -> int:
        return self._infer(keyword, codes[keyword])

    def _infer(self, name: str, code: int) -> int:
        self.inferred.append(name)
        return code

    def set_(self, step: s.SetStep) -> bytes:
        value = step.value
        if isinstance(value, s.Operation):
            raise _NotEncodable(f"the operator {value.operator}")
        if isinstance(value, s.FunctionOperation):
            raise _NotEncodable(f"the function {value.name}")
        return bytes((SET, *self._class_and_number(step.target), 0, 0)) + self.value(value) + NO_OPERATOR

    def condition(self, condition: s.StepCondition) -> bytes:
        if condition.sign not in CONDITION_SIGNS:
            opposite = _OPPOSITES[condition.sign]
            hint = f"{opposite} is its opposite: an IF with {opposite} and its branches exchanged does the same"
            raise _NotEncodable(f"the comparison {condition.sign}", hint)
        return self.value(condition.left) + condition.sign.encode("ascii") + self.value(condition.right)

    def value(self, source: s.ValueSource) -> bytes:
        if isinstance(source, s.Literal):
            whole = source.value == int(source.value)
            return bytes((WHOLE if whole else FRACTION,)) + _REAL.pack(source.value)
        return bytes((*self._class_and_number(source), 0, 0, 0))

    def _class_and_number(self, source: s.RegisterOperand | s.Variable) -> tuple[int, int]:
        if isinstance(source, s.Variable):
            raise _NotEncodable(f"the variable {source.name}")
        key = source.row.key
        if key in INFERRED_CLASSES:
            return self._infer(f"the register {source.name}", INFERRED_CLASSES[key]), source.number
        if key not in REGISTER_CLASSES:
            raise _NotEncodable(f"the register {source.name}")
        return REGISTER_CLASSES[key], source.number


_ENCODINGS: Mapping[type[s.ProgramStep], Callable[[_Record, Any], bytes]] = complete(
    "step",
    s.STEPS,
    "encoding",
    {
        s.SetStep: _Record.set_,
        s.IfStep: _Record.if_,
        s.ElseStep: lambda record, step: bytes((ELSE,)).ljust(12, b"\0") + _slot(step.close),
        s.EndIfStep: lambda record, step: bytes((ENDIF,)),
        s.WhileStep: lambda record, step: bytes((WHILE,)) + record.condition(step.condition) + _slot(step.close),
        s.EndWhileStep: lambda record, step: bytes((ENDWHILE,)) + record.condition(step.condition) + _slot(step.open),
        s.WaitStep: lambda record, step: bytes((WAIT,)) + record.condition(step.condition),
        s.WaitPosStep: lambda record, step: bytes((WAITPOS,)),
        s.DelayStep: lambda record, step: bytes((DELAY,)) + record.value(step.seconds),
        s.JumpStep: lambda record, step: bytes((JUMP,)) + _slot(step.target),
        s.ReturnStep: lambda record, step: bytes((RETURN,)),
        s.EndStep: lambda record, step: record.unknown("END"),
        s.ProgResetStep: lambda record, step: record.prog_reset(),
        s.MotionStep: _Record.motion,
        s.HaltStep: _Record.halt,
        s.RowMotionStep: _Record.row_motion,
        s.PulseStep: lambda record, step: record.unknown("PULSE"),
        s.InterruptStep: _Record.entry,
        s.IllegalStep: lambda record, step: step.data,
    },
)
"""The record of a step by its class."""


def _slot(number: int) -> bytes:
    return _SLOT_NUMBER.pack(number)
