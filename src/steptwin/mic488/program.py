"""Program control: start, stop, pause (manual 4.1, MIC-22, MIC-26, MIC-28, MIC-31), and the program that runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.diagnostics import Span
from steptwin.errors import Misuse
from steptwin.messages import NONE, Message, text_of
from steptwin.mic488 import program_motion as motion
from steptwin.mic488.program_banks import LoadedProgram, ProgramBanks, row_values
from steptwin.mic488.program_device import ProgramDevice
from steptwin.mic488.program_registers import ProgramRegisters
from steptwin.mic488.registers import OUTPUTS
from steptwin.mic488.status import ProgramState
from steptwin.state import Stateful
from steptwin.wbc.compile import Code
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.events import EVENTS
from steptwin.wbc.interpreter import Interpreter
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.real import ProgramFault, real_text
from steptwin.wbc.registers import REAL_MAX

_MODBUS = next(number for number, event in enumerate(EVENTS) if event.name == "MODBUS")
_DRIVES = {event.axis - 1: number for number, event in enumerate(EVENTS) if event.axis}


STOPPED, RUNNING, PAUSED = ProgramState
"""Global names: they are compared at every statement, and access through the class costs more than the comparison."""


class ProgramError(NamedTuple):
    """The error that stopped a program (WBC-5), and its statement in the text."""

    span: Span
    text: str


PROGRAM_BANK_IS_IN_USE = Message("mic488.program-bank-is-in-use", "program bank {bank} is in use: stop the program first")
POSITION_BANK_IS_IN_USE = Message("mic488.position-bank-is-in-use", "position bank {bank} is in use: stop the program first")
PROGRAM_BANK_IS_EMPTY = Message("mic488.program-bank-is-empty", "program bank {bank} is empty")
POSITION_BANK_IS_EMPTY = Message("mic488.position-bank-is-empty", "position bank {bank} is empty")
UNKNOWN_VARIABLE = Message("mic488.unknown-variable", "the program has no variable {name!r}: there are {names}")
VARIABLE_OUT_OF_RANGE = Message("mic488.variable-out-of-range", "{name} = {value:g}: permitted are {least:g}…{most:g}")
PATH_IS_LEFT = Message("mic488.path-is-left", "M{axis} slows down: the other axis left their path")
NO_SUCH_ROW = Message("mic488.no-such-row", "{keyword} {row}: the position table has rows 0…{last}")
AT_LINE = Message("mic488.at-line", "line {line}: {problem}")
PULSE_IS_TOO_SHORT = Message("mic488.pulse-is-too-short", "PULSE(OUT{output}, …): permitted are 0.001 s and more")


class ProgramControl(Stateful):
    """Which program runs on a controller. Bank selections take effect at the next start (MIC-31).

    To a program it is the controller (`steptwin.wbc.controller.ProgramController`).
    """

    FIXED = ("banks", "device", "dialect")
    __slots__ = (
        *FIXED,
        "_program",
        "_pulses",
        "_statuses",
        "_table",
        "error",
        "fault",
        "interpreter",
        "position_bank",
        "program_bank",
        "registers",
        "state",
        "together",
    )

    def __init__(
        self,
        device: ProgramDevice,
        programs: Mapping[int, LoadedProgram],
        positions: Mapping[int, PositionTable],
        statement_time: Nanos,
    ) -> None:
        self.device = device
        self.dialect = dialect_for(device.firmware.name)
        self.banks = ProgramBanks(device.firmware.banks, self.dialect)
        self.interpreter = Interpreter(self, statement_time)
        self.registers = ProgramRegisters()
        self.state = STOPPED
        self._program = 0
        self._table = 0
        """Banks of the program that runs, and of its positions."""
        self._statuses: tuple[int, ...] = ()
        self.together = False
        """M1 and M2 are on one path, which neither leaves alone."""
        for bank, program in programs.items():
            self.load_program(bank, program)
        for bank, table in positions.items():
            self.load_positions(bank, table)
        self.fault: ProgramError | None
        """The last program error; it is kept until the next start."""
        self._pulses: dict[int, Nanos]
        """The moment at which PULSE inverts each output (from 0)."""

    # ------------------------------------------------------------------ banks

    def load_program(self, bank: int, program: LoadedProgram) -> None:
        """Fill a program bank. `Misuse` for a bank that does not exist or whose program is running or paused."""
        if self.runs_program(bank):
            raise Misuse(PROGRAM_BANK_IS_IN_USE(bank=bank))
        self.banks.load_program(bank, program)

    def load_positions(self, bank: int, table: PositionTable) -> None:
        """Fill a position bank. `Misuse` for a bank that does not exist or is in use."""
        if self.runs_positions(bank):
            raise Misuse(POSITION_BANK_IS_IN_USE(bank=bank))
        self.banks.load_positions(bank, table)

    def runs_program(self, bank: int) -> bool:
        """Whether the program of a bank runs or is paused."""
        return self.state is not STOPPED and bank == self._program

    def runs_positions(self, bank: int) -> bool:
        """Whether the positions of a bank are those of a program that runs or is paused."""
        return self.state is not STOPPED and bank == self._table

    # ------------------------------------------------------------------ start, stop, pause

    def power_on(self, now: Nanos) -> None:
        """No program runs, except one that the configuration starts."""
        configured = self.device.config.program
        self.program_bank = configured.prog_bank if configured.activate else 0
        self.position_bank = configured.pos_bank if configured.activate else 0
        self._stop()
        self.error = False
        """A program error is pending; cleared by the next start or stop (MIC-26)."""
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
            elif (begun := self.interpreter.paused_at) is not None:
                self._resume(begun, now)
        elif value == PAUSED:
            self._pause(now)
        elif self.state is not STOPPED:
            self._end(now)
        else:
            self.error = False  # MIC-26, MIC-31

    def _start(self, now: Nanos) -> None:
        program, table = self.banks.programs.get(self.program_bank), self.banks.positions.get(self.position_bank)
        self.error = False
        self.fault = None
        if program is None:
            self._refuse(PROGRAM_BANK_IS_EMPTY(bank=self.program_bank), now)
        elif program.uses_positions and (table is None or not table.rows):
            # WBC-25
            self._refuse(POSITION_BANK_IS_EMPTY(bank=self.position_bank), now)
        else:
            self._program, self._table = self.program_bank, self.position_bank
            self.state = RUNNING
            self._begin(now)
            self.interpreter.start(program.code, now)

    def _refuse(self, text: str, now: Nanos) -> None:
        self.error = True
        self.device.event("program-error", text, now)

    def _begin(self, now: Nanos) -> None:
        """Reset everything that belongs to the program to its state at the start (WBC-25)."""
        self.registers.begin(self.device.config, now)
        self.registers.row_0 = self._row(0)
        self._statuses = tuple(axis.status for axis in self.device.axes)

    def _stop(self) -> None:
        self.interpreter.stop()
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
        """WBC-9. Ticks are suspended meanwhile."""
        if self.state is RUNNING:
            self.state = PAUSED
            self.interpreter.pause(now)

    def _resume(self, begun: Nanos, now: Nanos) -> None:
        self.registers.ticks = {event: at + now - begun for event, at in self.registers.ticks.items()}
        self.state = RUNNING
        self.interpreter.resume(self._code(), begun, now)

    def _code(self) -> Code:
        return self.banks.programs[self._program].code

    # ------------------------------------------------------------------ present state

    @property
    def running(self) -> LoadedProgram | None:
        """The program that runs or is paused; another bank may be selected."""
        return None if self.state is STOPPED else self.banks.programs[self._program]

    @property
    def running_bank(self) -> int:
        """The bank of the program that runs or is paused, or that ran last."""
        return self._program

    def variables(self, now: Nanos) -> dict[str, float]:
        """Values of the variables of the running or paused program, by name."""
        running = self.running
        return {} if running is None else dict(zip(running.variables, self.interpreter.cells_at(now), strict=False))

    def set_variable(self, name: str, value: float, now: Nanos) -> None:
        """Set a variable of the running or paused program. Raises `Misuse` for another name, and outside the range of REAL."""
        names = () if self.running is None else self.running.variables
        if name not in names:
            raise Misuse(UNKNOWN_VARIABLE(name=name, names=list(names) or NONE()))
        if not -REAL_MAX <= value <= REAL_MAX:
            raise Misuse(VARIABLE_OUT_OF_RANGE(name=name, value=value, least=-REAL_MAX, most=REAL_MAX))
        self.interpreter.disturb(self.interpreter.after(now))
        self.interpreter.cells[names.index(name)] = value

    def rest_in_loops(self, on: bool, now: Nanos) -> None:
        """Switch the skipping of loops without effect (WBC-18). It changes the computing time only."""
        self.interpreter.disturb(self.interpreter.after(now))
        self.interpreter.rests_in_loops = on

    def statement(self, now: Nanos) -> Span | None:
        """Place, in the source, of the statement in execution at ``now`` or executed next; None if no program runs."""
        if self.state is STOPPED:
            return None
        return self._span(self.interpreter.place(now))

    def _span(self, number: int) -> Span:
        program = self.banks.programs[self._program]
        if number < len(program.steps):
            return Span(program.steps[number].start, program.steps[number].end)
        return Span(len(program.source.text), len(program.source.text))

    # ------------------------------------------------------------------ time

    def deadline(self) -> Nanos | None:
        due = None
        if self.state is RUNNING:
            due = self.interpreter.due
            for at in self.registers.ticks.values():
                if due is None or at < due:
                    due = at
        elif not self._pulses:
            return None
        for at in self._pulses.values():
            if due is None or at < due:
                due = at
        return due

    def advance(self, now: Nanos, until: Nanos) -> Nanos | None:
        """Run everything due at ``now``, and statements up to ``until`` as long as they concern the program alone.

        Returns the moment at which the program acted on the rest of the controller, where it stops; None if it did not.
        """
        interpreter = self.interpreter
        acted = None
        if self._pulses and self._invert(now):
            acted = until = now
        if self.state is not RUNNING:
            return acted
        code = self._code()
        ticks = self.registers.ticks
        if ticks:
            for event in sorted(event for event, at in ticks.items() if at <= now):
                ticks[event] += EVENTS[event].period
                interpreter.request_interrupt(code, event, now, now)
        due = interpreter.due
        if due is None or due > now:
            return acted
        for at in (*ticks.values(), *self._pulses.values()):
            until = min(until, at - 1)
        interpreter.acted = False
        try:
            interpreter.run(code, due, max(until, now))
        except ProgramFault as fault:
            self._fail(text_of(fault))
        if interpreter.acted:
            self._check_drives(interpreter.now, interpreter.after(interpreter.now))
            return interpreter.now
        return acted

    def _invert(self, now: Nanos) -> bool:
        """End the pulses of PULSE that are due; whether there were any."""
        over = sorted(number for number, at in self._pulses.items() if at <= now)
        for number in over:
            del self._pulses[number]
            self.device.set_output(number, not self.device.outputs[number], now)
            self.interpreter.disturb(now)
        return bool(over)

    def _fail(self, text: str) -> None:
        """WBC-5."""
        now = self.interpreter.now
        self.interpreter.acting()
        span = self._span(self.interpreter.pc)
        self.fault = ProgramError(span, text)
        self._stop()
        line, _ = self.banks.programs[self._program].source.position(span.start)
        self._refuse(AT_LINE(line=line, problem=text_of(text)), now)
        for axis in self.device.axes:
            axis.brake(now)

    # ------------------------------------------------------------------ events outside the program

    def disturbed(self, now: Nanos, *, inside: bool) -> None:
        """An event at ``now`` that the program did not cause; ``inside``: before its statement of this moment."""
        if self.state is STOPPED and not self.together:
            return
        first = now if inside else self.interpreter.after(now)
        if self.state is RUNNING:
            self.interpreter.disturb(first)
        self._check_drives(now, first)

    def _check_drives(self, now: Nanos, first: Nanos) -> None:
        axes = self.device.axes
        if self.together:
            x, y = axes[:2]
            if x.path is None or y.path is None:
                # WBC-26: a single axis does not complete a path.
                self.together = False
                for axis in (x, y):
                    if axis.path is not None:
                        axis.brake(now)
                        self.device.event("path-left", PATH_IS_LEFT(axis=axis.number), now)
        if self.state is STOPPED:
            return
        m1, m2, m3, m4 = axes
        statuses = (m1.status, m2.status, m3.status, m4.status)
        if statuses != self._statuses:
            before, self._statuses = self._statuses, statuses
            for index, event in _DRIVES.items():
                if before[index] != statuses[index] and self.registers.switches[event]:
                    self.interpreter.request_interrupt(self._code(), event, now, first)

    def registers_written(self, now: Nanos) -> None:
        """A user register was written over Modbus."""
        if self.state is not STOPPED and self.registers.switches[_MODBUS]:
            self.interpreter.request_interrupt(self._code(), _MODBUS, now, self.interpreter.after(now))

    def inputs_changed(self, numbers: list[int], now: Nanos) -> None:
        """Filtered inputs ``numbers`` (from 0) changed: inside an instant, before the program's statement."""
        if self.state is STOPPED:
            return
        for number in numbers:
            edge = 1 if self.device.inputs.filtered[number] else 2
            # Events of inputs come first in `EVENTS`.
            if self.registers.switches[number] & edge:
                self.interpreter.request_interrupt(self._code(), number, now, now)

    def interrupt_by_position_error(self, now: Nanos) -> None:
        """ERRMODE1: the program stops; firmware 1.70 pauses it [1.74]."""
        if self.dialect.has("1.70"):
            self._pause(now)
        else:
            self._stop()

    # ------------------------------------------------------------------ actions of the program

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
        table = self.banks.positions.get(self._table)
        rows = () if table is None else table.rows
        if not 0 <= index < len(rows) or index != int(index):
            raise ProgramFault(NO_SUCH_ROW(keyword=keyword, row=real_text(index), last=len(rows) - 1))
        return self._row(int(index))

    def _row(self, index: int) -> tuple[float | None, ...]:
        record = self.banks.programs[self._program].position_records.get(index)
        if record is not None:
            return row_values(record)
        table = self.banks.positions.get(self._table)
        return table.rows[index].values if table is not None and index < len(table.rows) else (None,) * 4

    def at_rest(self, now: Nanos) -> bool:
        return all(motion.finished(axis, now) for axis in self.device.axes)

    def pulse(self, output: int, duration: Nanos, now: Nanos) -> None:
        if duration <= 0:
            raise ProgramFault(PULSE_IS_TOO_SHORT(output=output))
        self._pulses[output - 1] = now + duration

    def set_output(self, number: int, on: bool, now: Nanos) -> bool:
        """Output ``number`` from 0; whether that changed anything."""
        if self.device.outputs[number] is on:
            return False
        self.device.set_output(number, on, now)
        return True

    def set_switch(self, event: int, mode: int, now: Nanos) -> bool:
        """CFGINT_… written. If it is switched off, a pending interrupt is dropped."""
        if not mode:
            self.interpreter.pending &= ~(1 << event)
        return self.registers.switch(event, mode, now)

    def end(self, now: Nanos) -> None:
        self._end(now)

    def reset(self, now: Nanos) -> None:
        self._drives_off(now)
        self._pulses = {}
        self._begin(now)
        self.interpreter.restart(self._code())
