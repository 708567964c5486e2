"""Program control: banks, start, stop, pause (manual 4.1, MIC-22, MIC-26, MIC-28, MIC-31), and the program that runs."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import NamedTuple

from steptwin.diagnostics import SourceText, Span
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.mic488 import program_motion as motion
from steptwin.mic488.axis_motion import MAX_SPEED_P
from steptwin.mic488.config import NO_INPUT, ControllerConfig
from steptwin.mic488.homing import Homing
from steptwin.mic488.program_device import ProgramDevice
from steptwin.mic488.program_registers import ACCESS, ProgramRegisters
from steptwin.mic488.registers import OUTPUTS
from steptwin.mic488.status import ProgramState
from steptwin.state import Stateful
from steptwin.wbc import steps as s
from steptwin.wbc.check import CheckedProgram, check
from steptwin.wbc.compile import Code, compile_program
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.events import EVENTS
from steptwin.wbc.machine import Interpreter
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.wbc.real import ProgramFault, real_text
from steptwin.wbc.registers import REAL_MAX, ROW_0
from steptwin.wbc.usage import Setup, sources

_MODBUS = next(number for number, event in enumerate(EVENTS) if event.name == "MODBUS")
_DRIVES = {event.axis - 1: number for number, event in enumerate(EVENTS) if event.axis}


STOPPED, RUNNING, PAUSED = ProgramState
"""Asked for at every statement: a member found through its class costs more than all the rest of the question."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadedProgram:
    """A program in a bank, ready to run. Code has no state: any number of controllers may share it."""

    source: SourceText
    steps: tuple[s.Step, ...]
    code: Code
    position_records: Mapping[int, bytes]
    uses_positions: bool
    """It needs a position table: for more than a row 0 that it writes itself (WBC-25)."""
    variables: tuple[str, ...] = ()
    """Their names; their values are the first cells."""
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


class ProgramError(NamedTuple):
    """What stopped a program (WBC-5), and the statement of its text."""

    span: Span
    text: str


def row_values(record: bytes) -> tuple[float | None, ...]:
    """Parameters of a row of an image: an axis mask, big-endian, and four REAL numbers."""
    mask, values = int.from_bytes(record[:2], "big"), struct.unpack("<4f", record[2:])
    return tuple(value if mask >> number & 1 and isfinite(value) else None for number, value in enumerate(values))


def load(checked: CheckedProgram, name: str = "program") -> LoadedProgram:
    """A program for banks of controllers. `Misuse` when it has errors."""
    executable = checked.executable
    if executable is None:
        errors = checked.errors
        reason = errors[0].message if errors else "its positions are not known without a table"
        raise Misuse(f"{name} cannot run: {reason}")
    steps = executable.steps
    code = compile_program(executable, ACCESS)
    source, records = SourceText(name, checked.text), executable.position_records
    table = None if checked.positions is None else checked.positions.text
    used = _uses_positions(steps)
    return LoadedProgram(source, steps, code, records, used, executable.variables, executable.labels, table)


def setup_of(config: ControllerConfig) -> Setup:
    """What the checker of programs needs of a configuration."""
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


def _uses_positions(steps: Sequence[s.Step]) -> bool:
    """Whether rows are needed that the program does not write itself (WBC-25)."""
    rows = [step.row for step in steps if isinstance(step, s.RowMotionStep)]
    if any(isinstance(step, s.SetStep) and _is_row_0(step.target) for step in steps):
        return any(row != s.Literal(0.0) for row in rows)
    return bool(rows) or any(_is_row_0(source) for step in steps for source in sources(step))


def _is_row_0(source: s.Source) -> bool:
    return isinstance(source, s.RegisterOperand) and source.row.key in ROW_0


class ProgramControl(Stateful):
    """Which program runs on a controller. Bank selections take effect at the next start (MIC-31).

    To a program it is the controller: what `steptwin.wbc.controller.ProgramController` asks for.
    """

    __slots__ = (
        "_program",
        "_pulses",
        "_statuses",
        "_table",
        "device",
        "dialect",
        "error",
        "fault",
        "machine",
        "position_bank",
        "positions",
        "program_bank",
        "programs",
        "registers",
        "state",
        "together",
    )
    FIXED = frozenset({"device", "dialect", "positions", "programs"})

    def __init__(
        self,
        device: ProgramDevice,
        programs: Mapping[int, LoadedProgram],
        positions: Mapping[int, PositionTable],
        statement_time: Nanos,
    ) -> None:
        self.device = device
        self.dialect = dialect_for(device.firmware.name)
        self.programs: dict[int, LoadedProgram] = {}
        self.positions: dict[int, PositionTable] = {}
        self.machine = Interpreter(self, statement_time)
        self.registers = ProgramRegisters()
        self.program_bank = 0
        self.position_bank = 0
        self.state = STOPPED
        self.error = False
        """A program error is pending; cleared by the next start or stop (MIC-26)."""
        self.fault: ProgramError | None = None
        """The last program error; it outlives ``error`` up to the next start."""
        self._program = 0
        self._table = 0
        """Banks of the program that runs, and of its positions."""
        self._pulses: dict[int, Nanos] = {}
        """When PULSE inverts which output (from 0)."""
        self._statuses: tuple[int, ...] = ()
        self.together = False
        """M1 and M2 are both on a path: neither leaves it alone."""
        for bank, program in programs.items():
            self.load_program(bank, program)
        for bank, table in positions.items():
            self.load_positions(bank, table)

    # ------------------------------------------------------------------ banks

    def load_program(self, bank: int, program: LoadedProgram) -> None:
        """Fill a program bank. `Misuse` for a bank that does not exist or whose program is running or paused."""
        self._check_bank("program", bank, in_use=self.runs_program(bank))
        if len(program.steps) > self.dialect.max_steps:
            lines = f"{len(program.steps)} executable lines"
            raise Misuse(f"{program.source.name}: {lines}, firmware {self.dialect.firmware} holds {self.dialect.max_steps}")
        self.programs[bank] = program

    def load_positions(self, bank: int, table: PositionTable) -> None:
        """Fill a position bank. `Misuse` for a bank that does not exist or is in use."""
        self._check_bank("position", bank, in_use=self.runs_positions(bank))
        if len(table.rows) > self.dialect.max_positions:
            raise Misuse(f"{len(table.rows)} positions: a bank holds {self.dialect.max_positions}")
        self.positions[bank] = table

    def runs_program(self, bank: int) -> bool:
        """Whether the program of a bank runs or is paused."""
        return self.state is not STOPPED and bank == self._program

    def runs_positions(self, bank: int) -> bool:
        """Whether the positions of a bank are those of a program that runs or is paused."""
        return self.state is not STOPPED and bank == self._table

    def _check_bank(self, kind: str, bank: int, *, in_use: bool) -> None:
        last = self.device.firmware.banks - 1
        if not 0 <= bank <= last:
            raise Misuse(f"{kind} bank {bank}: permitted are 0…{last}")
        if in_use:
            raise Misuse(f"{kind} bank {bank} is in use: stop the program first")

    def contents(self) -> BankContents:
        """What is in all banks."""
        programs = [(bank, one.source.name, one.source.text, one.positions) for bank, one in sorted(self.programs.items())]
        return BankContents(tuple(programs), tuple((bank, table.text) for bank, table in sorted(self.positions.items())))

    def hold(self, contents: BankContents) -> None:
        """Have these contents of all banks, which were those of a controller with this firmware; whatever runs."""
        before = self.contents()
        if contents == before:
            return
        kept = {row[0] for row in contents.programs if row in before.programs}
        self.programs = {
            bank: self.programs[bank] if bank in kept else load(check(text, _table(positions), dialect=self.dialect), name)
            for bank, name, text, positions in contents.programs
        }
        self.positions = {bank: parse_positions(text)[0] for bank, text in contents.positions}

    # ------------------------------------------------------------------ start, stop, pause

    def power_on(self, now: Nanos) -> None:
        """Nothing runs but what the configuration starts."""
        configured = self.device.config.program
        self.program_bank = configured.prog_bank if configured.activate else 0
        self.position_bank = configured.pos_bank if configured.activate else 0
        self._stop()
        self.error = False
        self.fault = None
        self._pulses = {}
        self.registers.forget_record()
        self.registers.begin(self.device.config, now)
        if configured.activate:
            self._start(now)

    def command(self, value: int, now: Nanos) -> None:
        """PROGRAM_CTRL written: 0 stop, 1 start or continue, 2 pause."""
        if value == RUNNING:
            if self.state is STOPPED:
                self._start(now)
            elif self.state is PAUSED:
                self._resume(now)
        elif value == PAUSED:
            self._pause(now)
        elif self.state is not STOPPED:
            self._end(now)
        else:
            self.error = False  # MIC-26, MIC-31

    def _start(self, now: Nanos) -> None:
        program, table = self.programs.get(self.program_bank), self.positions.get(self.position_bank)
        self.error = False
        self.fault = None
        if program is None:
            self._refuse(f"program bank {self.program_bank} is empty", now)
        elif program.uses_positions and (table is None or not table.rows):
            # WBC-25
            self._refuse(f"position bank {self.position_bank} is empty", now)
        else:
            self._program, self._table = self.program_bank, self.position_bank
            self.state = RUNNING
            self._begin(now)
            self.machine.start(program.code, now)

    def _refuse(self, text: str, now: Nanos) -> None:
        self.error = True
        self.device.event("program-error", text, now)

    def _begin(self, now: Nanos) -> None:
        """What belongs to the program is as at its start (WBC-25)."""
        self.registers.begin(self.device.config, now)
        self.registers.row_0 = self._row(0)
        self._statuses = tuple(axis.status for axis in self.device.axes)

    def _stop(self) -> None:
        self.machine.stop()
        self.state = STOPPED

    def _end(self, now: Nanos) -> None:
        """As the statement END: drives and outputs off (MIC-31)."""
        self._stop()
        self.error = False
        self._pulses = {}
        self._drives_off(now)
        for number in range(OUTPUTS):
            self.device.set_output(number, False, now)

    def _drives_off(self, now: Nanos) -> None:
        for axis in self.device.axes:
            axis.disable(now)

    def _pause(self, now: Nanos) -> None:
        """WBC-9. Ticks do not go on meanwhile."""
        if self.state is RUNNING:
            self.state = PAUSED
            self.machine.pause(now)

    def _resume(self, now: Nanos) -> None:
        begun = self.machine.paused_at
        if begun is not None:
            self.registers.ticks = {event: at + now - begun for event, at in self.registers.ticks.items()}
        self.state = RUNNING
        self.machine.resume(self._code(), now)

    def _code(self) -> Code:
        return self.programs[self._program].code

    # ------------------------------------------------------------------ where it stands

    @property
    def running(self) -> LoadedProgram | None:
        """The program that runs or is paused, whatever bank is selected."""
        return None if self.state is STOPPED else self.programs[self._program]

    @property
    def running_bank(self) -> int:
        """Of the program that runs or is paused, or did last."""
        return self._program

    def variables(self, now: Nanos) -> dict[str, float]:
        """Values of the variables of the running or paused program, by name."""
        running = self.running
        return {} if running is None else dict(zip(running.variables, self.machine.cells_at(now), strict=False))

    def set_variable(self, name: str, value: float, now: Nanos) -> None:
        """Of the running or paused program. Raises `Misuse` for another name, and for what is no REAL."""
        names = () if self.running is None else self.running.variables
        if name not in names:
            raise Misuse(f"the program has no variable {name!r}: there are {', '.join(names) or 'none'}")
        if not -REAL_MAX <= value <= REAL_MAX:
            raise Misuse(f"{name} = {value:g}: permitted are {-REAL_MAX:g}…{REAL_MAX:g}")
        self.machine.disturb(self.machine.after(now))
        self.machine.cells[names.index(name)] = value

    def rest_in_loops(self, on: bool, now: Nanos) -> None:
        """Off, every statement of a loop is executed even where nothing can change by it; only the computing time changes."""
        self.machine.disturb(self.machine.after(now))
        self.machine.rests_in_loops = on

    def statement(self, now: Nanos) -> Span | None:
        """Place, in the source, of the statement in execution at ``now`` or executed next; None when nothing runs."""
        if self.state is STOPPED:
            return None
        return self._span(self.machine.place(now))

    def _span(self, number: int) -> Span:
        program = self.programs[self._program]
        if number < len(program.steps):
            return Span(program.steps[number].start, program.steps[number].end)
        return Span(len(program.source.text), len(program.source.text))

    # ------------------------------------------------------------------ time

    def deadline(self) -> Nanos | None:
        due = None
        if self.state is RUNNING:
            due = self.machine.due
            for at in self.registers.ticks.values():
                if due is None or at < due:
                    due = at
        for at in self._pulses.values():
            if due is None or at < due:
                due = at
        return due

    def advance(self, now: Nanos, until: Nanos) -> Nanos | None:
        """Run what is due at ``now``, and of the program alone what follows up to ``until``.

        Returns the moment at which it acted on the rest of the controller, where it goes no further; None if it did not.
        """
        machine = self.machine
        acted = now if self._pulses and self._invert(now) else None
        if self.state is not RUNNING:
            return acted
        code = self._code()
        ticks = self.registers.ticks
        if ticks:
            for event in sorted(event for event, at in ticks.items() if at <= now):
                ticks[event] += EVENTS[event].period
                machine.happen(code, event, now, now)
        if machine.due is None or machine.due > now:
            return acted
        for at in (*ticks.values(), *self._pulses.values()):
            until = min(until, at - 1)
        machine.acted = False
        try:
            machine.run(code, max(until, now))
        except ProgramFault as fault:
            self._fail(str(fault))
        if machine.acted:
            self._look_at_drives(machine.now, machine.after(machine.now))
            return machine.now
        return acted

    def _invert(self, now: Nanos) -> bool:
        """What PULSE has begun ends."""
        over = sorted(number for number, at in self._pulses.items() if at <= now)
        for number in over:
            del self._pulses[number]
            self.device.set_output(number, not self.device.outputs[number], now)
            self.machine.disturb(now)
        return bool(over)

    def _fail(self, text: str) -> None:
        """WBC-5."""
        now = self.machine.now
        self.machine.acting()
        span = self._span(self.machine.pc)
        self.fault = ProgramError(span, text)
        self._stop()
        line, _ = self.programs[self._program].source.position(span.start)
        self._refuse(f"line {line}: {text}", now)
        for axis in self.device.axes:
            axis.brake(now)

    # ------------------------------------------------------------------ what happens around it

    def disturbed(self, now: Nanos, *, inside: bool) -> None:
        """Something happened at ``now`` that was not the program's doing; ``inside``: before its statement of this moment."""
        first = now if inside else self.machine.after(now)
        if self.state is RUNNING:
            self.machine.disturb(first)
        self._look_at_drives(now, first)

    def _look_at_drives(self, now: Nanos, first: Nanos) -> None:
        axes = self.device.axes
        if self.together:
            x, y = axes[:2]
            if not (x.on_path and y.on_path):
                # WBC-26: the rest of a path is not run by a single axis.
                self.together = False
                for axis in (x, y):
                    if axis.on_path:
                        axis.brake(now)
                        self.device.event("path-left", f"M{axis.number} slows down: the other axis left their path", now)
        if self.state is STOPPED:
            return
        m1, m2, m3, m4 = axes
        statuses = (m1.status, m2.status, m3.status, m4.status)
        if statuses != self._statuses:
            before, self._statuses = self._statuses, statuses
            for index, event in _DRIVES.items():
                if before[index] != statuses[index] and self.registers.switches[event]:
                    self.machine.happen(self._code(), event, now, first)

    def registers_written(self, now: Nanos) -> None:
        """A user register was written over Modbus."""
        if self.state is not STOPPED and self.registers.switches[_MODBUS]:
            self.machine.happen(self._code(), _MODBUS, now, self.machine.after(now))

    def inputs_changed(self, numbers: list[int], now: Nanos) -> None:
        """Filtered inputs ``numbers`` (from 0) changed: inside an instant, before the program's statement."""
        if self.state is STOPPED:
            return
        for number in numbers:
            edge = 1 if self.device.inputs.filtered[number] else 2
            # Events of inputs come first in `EVENTS`.
            if self.registers.switches[number] & edge:
                self.machine.happen(self._code(), number, now, now)

    def interrupt_by_position_error(self, now: Nanos) -> None:
        """ERRMODE1: the program stops; firmware 1.70 pauses it [1.74]."""
        if self.dialect.has("1.70"):
            self._pause(now)
        else:
            self._stop()

    # ------------------------------------------------------------------ what the program asks for

    def motion(self, keyword: str, axis: int, value: float, now: Nanos) -> None:
        motion.move(self.device.axes[axis - 1], keyword, value, now)

    def halt(self, keyword: str, axis: int, now: Nanos) -> None:
        motion.halt(self.device.axes[axis - 1], keyword, now)

    def row_motion(self, keyword: str, row: float, now: Nanos) -> None:
        chosen = motion.ChosenRow(keyword, row, self.row(keyword, row))
        both_move = motion.row_motion(self.device, chosen, self.registers.lin_acc_u, now)
        if both_move is not None:
            self.together = both_move

    def row(self, keyword: str, index: float) -> tuple[float | None, ...]:
        """Row ``index`` (from 0) of the table in use."""
        if index == 0 and self.registers.row_0 is not None:
            return self.registers.row_0
        table = self.positions.get(self._table)
        rows = () if table is None else table.rows
        if not 0 <= index < len(rows) or index != int(index):
            raise ProgramFault(f"{keyword} {real_text(index)}: the position table has rows 0…{len(rows) - 1}")
        return self._row(int(index))

    def _row(self, index: int) -> tuple[float | None, ...]:
        record = self.programs[self._program].position_records.get(index)
        if record is not None:
            return row_values(record)
        table = self.positions.get(self._table)
        return table.rows[index].values if table is not None and index < len(table.rows) else (None,) * 4

    def at_rest(self, now: Nanos) -> bool:
        return all(motion.finished(axis, now) for axis in self.device.axes)

    def pulse(self, output: int, duration: Nanos, now: Nanos) -> None:
        if duration <= 0:
            raise ProgramFault(f"PULSE(OUT{output}, …): permitted are 0.001 s and more")
        self._pulses[output - 1] = now + duration

    def set_output(self, number: int, on: bool, now: Nanos) -> bool:
        """Output ``number`` from 0; whether that changed anything."""
        if self.device.outputs[number] is on:
            return False
        self.device.set_output(number, on, now)
        return True

    def set_switch(self, event: int, mode: int, now: Nanos) -> bool:
        """CFGINT_… written: switched off, what waits is forgotten."""
        if not mode:
            self.machine.pending &= ~(1 << event)
        return self.registers.switch(event, mode, now)

    def end(self, now: Nanos) -> None:
        self._end(now)

    def reset(self, now: Nanos) -> None:
        self._drives_off(now)
        self._pulses = {}
        self._begin(now)
        self.machine.restart(self._code())
