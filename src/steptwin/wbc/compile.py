"""Steps to code: a function for every step, made once, without state, shared by all controllers that run the program."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from steptwin.controller import MILLISECOND, Nanos
from steptwin.tables import complete
from steptwin.wbc import steps as s
from steptwin.wbc.code import Cells, Code, Execution, InterruptEntry, Seen, StepCode, WatchedValue
from steptwin.wbc.controller import RegisterFamily, RegisterReader, Tendency
from steptwin.wbc.events import EVENTS
from steptwin.wbc.real import COMPARISONS, FUNCTIONS, OPERATIONS, ProgramFault, real, real_text
from steptwin.wbc.registers import REAL, REAL_MAX, RegisterRow
from steptwin.wbc.statements import COMPARISONS as SIGNS
from steptwin.wbc.straight import straight_of

ValueCode: TypeAlias = Callable[[Execution, Cells], float]


def compile_program(executable: s.Executable, registers: Mapping[str, RegisterFamily]) -> Code:
    """Code for controllers with access to their registers by ``registers`` (family in upper case)."""
    return _Compiler(executable, registers).code()


class _Compiler:
    def __init__(self, executable: s.Executable, registers: Mapping[str, RegisterFamily]) -> None:
        self._executable = executable
        self._registers = registers
        self._cells = array("f", [0.0] * len(executable.variables))
        self._constants: dict[float, int] = {}

    def code(self) -> Code:
        steps = self._executable.steps
        made = [_CODES[type(step)](self, step, number) for number, step in enumerate(steps)]
        straight = straight_of(made, steps, self._cell)
        watches = [tuple(self._watches(step)) for step in steps]
        entries = {
            EVENTS.index(step.event): InterruptEntry(number, step.hard)
            for number, step in enumerate(steps)
            if isinstance(step, s.InterruptStep)
        }
        return Code((*made, _end(len(made))), (*straight, None), (*watches, ()), self._cells, entries)

    # -- values

    def _cell(self, source: s.ValueSource) -> int | None:
        """The cell of a variable or constant; None for a register."""
        return None if isinstance(source, s.RegisterOperand) else self._cell_of(source)

    def _cell_of(self, source: s.Variable | s.Literal) -> int:
        if isinstance(source, s.Variable):
            return source.index
        value = real(source.value)
        if value not in self._constants:
            self._constants[value] = len(self._cells)
            self._cells.append(value)
        return self._constants[value]

    def _reader(self, register: s.RegisterOperand) -> RegisterReader:
        return self._registers[register.row.key].read(register.number)

    def value(self, source: s.ValueSource) -> ValueCode:
        if isinstance(source, s.RegisterOperand):
            read = self._reader(source)
            return lambda m, cells: read(m.controller, m.now)
        cell = self._cell_of(source)
        return lambda m, cells: cells[cell]

    def _calculated(self, value: s.ValueSource | s.Operation | s.FunctionOperation) -> ValueCode:
        if isinstance(value, s.Operation):
            apply = OPERATIONS[value.operator]
            left, right = self.value(value.left), self.value(value.right)
            return lambda m, cells: apply(left(m, cells), right(m, cells))
        if isinstance(value, s.FunctionOperation):
            function = FUNCTIONS[value.name]
            arguments = [self.value(argument) for argument in value.arguments]
            if len(arguments) == 1:
                only = arguments[0]
                return lambda m, cells: function(only(m, cells))
            return lambda m, cells: function(*[argument(m, cells) for argument in arguments])
        return self.value(value)

    def test(self, condition: s.StepCondition) -> Callable[[Execution, Cells], bool]:
        holds = COMPARISONS[condition.sign]
        left, right = self.value(condition.left), self.value(condition.right)
        return lambda m, cells: holds(left(m, cells), right(m, cells))

    # -- branches and assignments; what only concerns cells is written out, for compute loops consist of it

    def branch(self, condition: s.StepCondition, inside: int, outside: int) -> StepCode:
        a, b = self._cell(condition.left), self._cell(condition.right)
        if a is not None and b is not None:
            return _BRANCHES[condition.sign](a, b, inside, outside)
        test = self.test(condition)
        return lambda m, cells: inside if test(m, cells) else outside

    def assign(self, step: s.SetStep, following: int) -> StepCode:
        if isinstance(step.target, s.RegisterOperand):
            calculated = isinstance(step.value, s.Operation | s.FunctionOperation)
            return self._set_register(step.target, self._calculated(step.value), following, calculated=calculated)
        target, value = step.target.index, step.value
        if isinstance(value, s.Operation):
            a, b = self._cell(value.left), self._cell(value.right)
            if a is not None and b is not None:
                if value.operator in _ARITHMETIC:
                    return _ARITHMETIC[value.operator](target, a, b, following)
                return _set_cell_of_cells(target, OPERATIONS[value.operator], (a, b), following)
        return _set_cell(target, self._calculated(value), following)

    def _set_register(self, register: s.RegisterOperand, value: ValueCode, following: int, *, calculated: bool) -> StepCode:
        access = self._registers[register.row.key]
        if access.write is None:
            raise ValueError(f"{register.name} cannot be written")
        write = access.write(register.number)
        taken = _taken(register.row, register.name, calculated=calculated)
        if access.quiet:

            def set_quietly(m: Execution, cells: Cells) -> int:
                if write(m.controller, taken(value(m, cells)), m.now):
                    m.has_effect = True
                return following

            return set_quietly

        around = ~following

        def set_register(m: Execution, cells: Cells) -> int:
            number = taken(value(m, cells))
            if not write(m.acting(), number, m.now):
                return following
            m.has_effect = True
            return around

        return set_register

    # -- what changes with time

    def _watches(self, step: s.ProgramStep) -> list[WatchedValue]:
        if isinstance(step, s.IfStep | s.WhileStep | s.WaitStep):
            condition = step.condition
            tendencies = [t for side in (condition.left, condition.right) if (t := self._tendency(side)) is not None]
            if not tendencies:
                return []
            left, right = self._seen(condition.left), self._seen(condition.right)
            return [WatchedValue(_side(left, right), tendencies[0] if len(tendencies) == 1 else None)]
        return [WatchedValue(self._seen(source), t) for source in step.sources() if (t := self._tendency(source)) is not None]

    def _tendency(self, source: s.ValueSource) -> Tendency | None:
        if not isinstance(source, s.RegisterOperand):
            return None
        tendency = self._registers[source.row.key].tendency
        return None if tendency is None else tendency(source.number)

    def _seen(self, source: s.ValueSource) -> Seen:
        if isinstance(source, s.RegisterOperand):
            read = self._reader(source)
            return lambda controller, cells, at: read(controller, at)
        cell = self._cell_of(source)
        return lambda controller, cells, at: cells[cell]


def duration(seconds: float) -> Nanos:
    """Seconds of DELAY and PULSE, in whole milliseconds (WBC-23)."""
    return round(seconds * 1000.0) * MILLISECOND


def _side(left: Seen, right: Seen) -> Seen:
    """−1, 0 or 1: which of two values is greater. It changes whenever a condition on them does."""

    def side(controller: Any, cells: Cells, at: Nanos) -> float:
        a, b = left(controller, cells, at), right(controller, cells, at)
        return (a > b) - (a < b)

    return side


def _taken(row: RegisterRow, name: str, *, calculated: bool) -> Callable[[float], float]:
    """The value that a register takes: rounded if it is whole; out of range the nearest (WBC-14) or a program error.

    ``calculated``: it is the result of an operation, and not yet a REAL.
    """
    domain = row.writes
    if domain is None or domain == REAL:
        return real if calculated else lambda value: value
    low, high = domain.low, domain.high

    def taken(value: float) -> float:
        value = real(value)
        if row.saturates:
            value = min(max(value, low), high)
        if domain.whole:
            value = round(value)
        if not domain.has(value):
            moves = f"; PABS {name} and PREL {name} move it" if row.name == "M" else ""
            raise ProgramFault(f"{name} = {real_text(value)}: permitted are numbers {domain}{moves}")
        return value

    return taken


def _goes_to(following: int) -> StepCode:
    return lambda m, cells: following


def _set_cell(target: int, value: ValueCode, following: int) -> StepCode:
    def step(m: Execution, cells: Cells) -> int:
        x = value(m, cells)
        cells[target] = x if -REAL_MAX <= x <= REAL_MAX else real(x)
        return following

    return step


def _set_cell_of_cells(
    target: int, apply: Callable[[float, float], float], operands: tuple[int, int], following: int
) -> StepCode:
    a, b = operands

    def step(m: Execution, cells: Cells) -> int:
        x = apply(cells[a], cells[b])
        cells[target] = x if -REAL_MAX <= x <= REAL_MAX else real(x)
        return following

    return step


def _sum(target: int, a: int, b: int, following: int) -> StepCode:
    def step(m: Execution, cells: Cells) -> int:
        x = cells[a] + cells[b]
        cells[target] = x if -REAL_MAX <= x <= REAL_MAX else real(x)
        return following

    return step


def _difference(target: int, a: int, b: int, following: int) -> StepCode:
    def step(m: Execution, cells: Cells) -> int:
        x = cells[a] - cells[b]
        cells[target] = x if -REAL_MAX <= x <= REAL_MAX else real(x)
        return following

    return step


def _product(target: int, a: int, b: int, following: int) -> StepCode:
    def step(m: Execution, cells: Cells) -> int:
        x = cells[a] * cells[b]
        cells[target] = x if -REAL_MAX <= x <= REAL_MAX else real(x)
        return following

    return step


_ARITHMETIC: Mapping[str, Callable[[int, int, int, int], StepCode]] = {"+": _sum, "-": _difference, "*": _product}

_BRANCHES: Mapping[str, Callable[[int, int, int, int], StepCode]] = complete(
    "comparison",
    SIGNS,
    "branch",
    {
        "=": lambda a, b, inside, outside: lambda m, cells: inside if cells[a] == cells[b] else outside,
        "<": lambda a, b, inside, outside: lambda m, cells: inside if cells[a] < cells[b] else outside,
        ">": lambda a, b, inside, outside: lambda m, cells: inside if cells[a] > cells[b] else outside,
        "<=": lambda a, b, inside, outside: lambda m, cells: inside if cells[a] <= cells[b] else outside,
        ">=": lambda a, b, inside, outside: lambda m, cells: inside if cells[a] >= cells[b] else outside,
    },
)


def _wait(holds: Callable[[Execution, Cells], bool], number: int) -> StepCode:
    following, again = number + 1, ~number

    def step(m: Execution, cells: Cells) -> int:
        if holds(m, cells):
            m.began = None
            return following
        m.waiting = True
        if m.began is None or m.began[0] != number:
            m.began = number, m.now
        return again

    return step


def _wait_for_rest(number: int) -> StepCode:
    return _wait(lambda m, cells: m.acting().at_rest(m.now), number)


def _delay(seconds: ValueCode, following: int) -> StepCode:
    around = ~following

    def step(m: Execution, cells: Cells) -> int:
        m.not_before = m.now + duration(max(seconds(m, cells), s.SHORTEST_DELAY_S))
        m.began = following - 1, m.now
        return around

    return step


def _jump(target: int, following: int) -> StepCode:
    around = ~target

    def step(m: Execution, cells: Cells) -> int:
        m.push(following, 0)
        if m.handling:
            # WBC-3: from here on new interrupts are accepted.
            m.handling = False
            return around
        return target

    return step


def _return(m: Execution, cells: Cells) -> int:
    if not m.stack:
        # WBC-1
        if m.forgotten:
            raise ProgramFault("RETURN without a JUMP: more than 16 JUMPs without RETURN, so the oldest were forgotten")
        raise ProgramFault("RETURN without a JUMP")
    following, not_before = m.stack.pop()
    if m.handling or not_before:
        m.handling = False
        m.not_before = not_before
        return ~following
    return following


def _end(number: int) -> StepCode:
    def step(m: Execution, cells: Cells) -> int:
        m.acting().end(m.now)
        return ~number

    return step


def _reset(m: Execution, cells: Cells) -> int:
    m.acting().reset(m.now)
    return ~0


def _illegal(m: Execution, cells: Cells) -> int:
    raise ProgramFault("unknown instruction")


def _acting(act: Callable[[Execution, Cells], None], following: int) -> StepCode:
    around = ~following

    def step(m: Execution, cells: Cells) -> int:
        act(m, cells)
        m.has_effect = True
        return around

    return step


def _motion(compiler: _Compiler, step: s.MotionStep, number: int) -> StepCode:
    keyword, axis, value = step.keyword, step.axis, compiler.value(step.value)
    return _acting(lambda m, cells: m.acting().motion(keyword, axis, value(m, cells), m.now), number + 1)


def _halt(compiler: _Compiler, step: s.HaltStep, number: int) -> StepCode:
    keyword, axis = step.keyword, step.axis
    return _acting(lambda m, cells: m.acting().halt(keyword, axis, m.now), number + 1)


def _row_motion(compiler: _Compiler, step: s.RowMotionStep, number: int) -> StepCode:
    keyword, row = step.keyword, compiler.value(step.row)
    return _acting(lambda m, cells: m.acting().row_motion(keyword, row(m, cells), m.now), number + 1)


def _pulse(compiler: _Compiler, step: s.PulseStep, number: int) -> StepCode:
    output, seconds = step.output, compiler.value(step.seconds)
    return _acting(lambda m, cells: m.acting().pulse(output, duration(seconds(m, cells)), m.now), number + 1)


_CODES: Mapping[type[s.ProgramStep], Callable[[_Compiler, Any, int], StepCode]] = complete(
    "step",
    s.STEPS,
    "code",
    {
        s.SetStep: lambda c, step, number: c.assign(step, number + 1),
        s.IfStep: lambda c, step, number: c.branch(step.condition, number + 1, step.otherwise),
        s.ElseStep: lambda c, step, number: _goes_to(step.close),
        s.EndIfStep: lambda c, step, number: _goes_to(number + 1),
        s.WhileStep: lambda c, step, number: c.branch(step.condition, number + 1, step.close + 1),
        s.EndWhileStep: lambda c, step, number: _goes_to(step.open),
        s.WaitStep: lambda c, step, number: _wait(c.test(step.condition), number),
        s.WaitPosStep: lambda c, step, number: _wait_for_rest(number),
        s.DelayStep: lambda c, step, number: _delay(c.value(step.seconds), number + 1),
        s.JumpStep: lambda c, step, number: _jump(step.target, number + 1),
        s.ReturnStep: lambda c, step, number: _return,
        s.EndStep: lambda c, step, number: _end(number),
        s.ProgResetStep: lambda c, step, number: _reset,
        s.MotionStep: _motion,
        s.HaltStep: _halt,
        s.RowMotionStep: _row_motion,
        s.PulseStep: _pulse,
        s.InterruptStep: lambda c, step, number: _goes_to(number + 1),
        s.IllegalStep: lambda c, step, number: _illegal,
    },
)
"""The code of a step by its class: compiler, step, its number."""
