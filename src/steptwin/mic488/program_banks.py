"""The banks of a controller: programs ready to run, and position tables (manual 4.1, MIC-31)."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import NamedTuple

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.mic488.axis import MAX_SPEED_P
from steptwin.mic488.config import NO_INPUT, ControllerConfig
from steptwin.mic488.homing import Homing
from steptwin.mic488.program_registers import ACCESS
from steptwin.wbc import steps as s
from steptwin.wbc.check import CheckedProgram, check
from steptwin.wbc.compile import Code, compile_program
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.wbc.registers import ROW_0
from steptwin.wbc.usage import Setup


@dataclass(frozen=True, slots=True, eq=False)
class LoadedProgram:
    """A program in a bank, ready to run. Code has no state: any number of controllers may share it."""

    source: SourceText
    steps: tuple[s.ProgramStep, ...]
    code: Code
    position_records: Mapping[int, bytes]
    uses_positions: bool
    """It needs a position table: for more than a row 0 that it writes itself (WBC-25)."""
    variables: tuple[str, ...] = ()
    """Names of the variables; their values are the first cells."""
    labels: Mapping[str, int] = field(default_factory=dict)
    """Steps at labels, by name in upper case."""
    positions: str | None = None
    """The text of the table in which names after @ were found; None without one."""


class BankContents(NamedTuple):
    """The texts in all banks, from which programs and tables can be made again."""

    programs: tuple[tuple[int, str, str, str | None], ...] = ()
    """Bank, name, text, text of the table in which its names were found."""
    positions: tuple[tuple[int, str], ...] = ()
    """Bank, text."""


NO_SUCH_PROGRAM_BANK = Message("mic488.no-such-program-bank", "program bank {bank}: permitted are 0…{last}")
NO_SUCH_POSITION_BANK = Message("mic488.no-such-position-bank", "position bank {bank}: permitted are 0…{last}")
PROGRAM_IS_TOO_LONG = Message("mic488.program-is-too-long", "{name}: {count} executable lines, firmware {firmware} holds {most}")
TABLE_IS_TOO_LONG = Message("mic488.table-is-too-long", "{count} positions: a bank holds {most}")


class ProgramBanks:
    """Programs and position tables of one controller, by bank from 0."""

    def __init__(self, count: int, dialect: Dialect) -> None:
        self._count = count
        self._dialect = dialect
        self.programs: dict[int, LoadedProgram] = {}
        self.positions: dict[int, PositionTable] = {}

    def load_program(self, bank: int, program: LoadedProgram) -> None:
        """Fill a program bank. `Misuse` for a bank that does not exist and for more steps than the firmware permits."""
        self._check(NO_SUCH_PROGRAM_BANK, bank)
        if len(program.steps) > self._dialect.max_steps:
            raise Misuse(
                PROGRAM_IS_TOO_LONG(
                    name=program.source.name,
                    count=len(program.steps),
                    firmware=self._dialect.firmware,
                    most=self._dialect.max_steps,
                )
            )
        self.programs[bank] = program

    def load_positions(self, bank: int, table: PositionTable) -> None:
        """Fill a position bank. `Misuse` for a bank that does not exist and for too many rows."""
        self._check(NO_SUCH_POSITION_BANK, bank)
        if len(table.rows) > self._dialect.max_positions:
            raise Misuse(TABLE_IS_TOO_LONG(count=len(table.rows), most=self._dialect.max_positions))
        self.positions[bank] = table

    def _check(self, wrong: Message, bank: int) -> None:
        if not 0 <= bank < self._count:
            raise Misuse(wrong(bank=bank, last=self._count - 1))

    def contents(self) -> BankContents:
        """The contents of all banks."""
        programs = [(bank, one.source.name, one.source.text, one.positions) for bank, one in sorted(self.programs.items())]
        return BankContents(tuple(programs), tuple((bank, table.text) for bank, table in sorted(self.positions.items())))

    def restore(self, contents: BankContents) -> None:
        """Take the contents of all banks of a controller with this firmware, even while a program runs."""
        before = self.contents()
        if contents == before:
            return
        kept = {row[0] for row in contents.programs if row in before.programs}
        self.programs = {
            bank: self.programs[bank] if bank in kept else load(check(text, _table(positions), dialect=self._dialect), name)
            for bank, name, text, positions in contents.programs
        }
        self.positions = {bank: parse_positions(text)[0] for bank, text in contents.positions}


def row_values(record: bytes) -> tuple[float | None, ...]:
    """Parameters of a row of an image: an axis mask, big-endian, and four REAL numbers."""
    mask, values = int.from_bytes(record[:2], "big"), struct.unpack("<4f", record[2:])
    return tuple(value if mask >> number & 1 and isfinite(value) else None for number, value in enumerate(values))


POSITIONS_ARE_UNKNOWN = Message("mic488.positions-are-unknown", "its positions are not known without a table")
CANNOT_RUN = Message("mic488.cannot-run", "{name} cannot run: {why}")


def load(checked: CheckedProgram, name: str = "program") -> LoadedProgram:
    """A program for banks of controllers. `Misuse` when it has errors."""
    executable = checked.executable
    if executable is None:
        errors = checked.errors
        reason = errors[0].message if errors else POSITIONS_ARE_UNKNOWN()
        raise Misuse(CANNOT_RUN(name=name, why=text_of(reason)))
    steps = executable.steps
    code = compile_program(executable, ACCESS)
    source, records = SourceText(name, checked.text), executable.position_records
    table = None if checked.positions is None else checked.positions.text
    used = _uses_positions(steps)
    return LoadedProgram(source, steps, code, records, used, executable.variables, executable.labels, table)


def setup_of(config: ControllerConfig) -> Setup:
    """The part of a configuration that the checker of programs needs."""
    return Setup(
        gears=tuple(axis.gear for axis in config.axes),
        accelerations=tuple(axis.acc for axis in config.axes),
        decelerations=tuple(axis.dec for axis in config.axes),
        input_interrupts=tuple(settings.interrupt for settings in config.inputs),
        homing_ends=tuple(
            (axis.home_mode == Homing.HOME3 or axis.in_kl != NO_INPUT, axis.home_mode == Homing.HOME3 or axis.in_kr != NO_INPUT)
            for axis in config.axes
        ),
        most_speed_p=MAX_SPEED_P,
    )


def _table(text: str | None) -> PositionTable | None:
    return None if text is None else parse_positions(text)[0]


def _uses_positions(steps: Sequence[s.ProgramStep]) -> bool:
    """Whether rows are needed that the program does not write itself (WBC-25)."""
    rows = [step.row for step in steps if isinstance(step, s.RowMotionStep)]
    if any(isinstance(step, s.SetStep) and _is_row_0(step.target) for step in steps):
        return any(row != s.Literal(0.0) for row in rows)
    return bool(rows) or any(_is_row_0(source) for step in steps for source in step.sources())


def _is_row_0(source: s.ValueSource) -> bool:
    return isinstance(source, s.RegisterOperand) and source.row.key in ROW_0
