"""Tree to steps: names, labels, blocks, positions and number ranges. A program with errors found here does not run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import cast

from steptwin.diagnostics import Diagnostic, Severity
from steptwin.messages import Message
from steptwin.nearmiss import NearMiss
from steptwin.tables import complete
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.events import BY_LABEL
from steptwin.wbc.foreign import IF_UNKNOWN
from steptwin.wbc.memory import StepMemory
from steptwin.wbc.outline import outline
from steptwin.wbc.paths import names_no_axis, row_problem
from steptwin.wbc.positions import PositionTable, number_text, rows_text
from steptwin.wbc.real import DIVISION_BY_ZERO
from steptwin.wbc.registers import POSITIVE, parts
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.statements import HALTS, MOTIONS, ROW_MOTIONS, SET, STATEMENTS
from steptwin.wbc.tree import (
    Assign,
    Binary,
    Broken,
    DecimalNumber,
    FunctionCall,
    Identifier,
    ImageRecord,
    KeywordStatement,
    Label,
    OperandNode,
    Position,
    ProgramTree,
    Relation,
    StatementNode,
)

PERMITTED = Message("wbc.permitted", "permitted: {domain}")
HOW_LONG_IT_IS = Message("wbc.how-long-it-is", "{keyword} {value:.10g} is {minutes:.0f} min {rest:.10g} s")
IN_SECONDS_NOT_MS = Message("wbc.in-seconds-not-ms", "the time is in seconds: {value:.10g} ms are {milliseconds}")
ROWS_OF_TABLE = Message("wbc.rows-of-table", "the table has {rows}")
DOES_NOT_EXIST = Message("wbc.value-does-not-exist", "{text}({argument:g}) does not exist")
DELAY_WAITS = Message("wbc.delay-waits", "DELAY {value:g} waits {shortest:g} s")
DEFINE_THE_LABEL = Message("wbc.define-the-label", "define the label as {name}: on a line of its own")
SIDES_OF_HOME = Message("wbc.sides-of-home", "negative homes to KL, positive to KR")
NEEDS_A_DRIVE = Message("wbc.needs-a-drive", "{keyword} needs a drive; {name} is not one")
GIVE_THE_POSITION_TABLE = Message(
    "wbc.give-the-position-table", "give the position table to check names and rows; the program does not start without it"
)
ROW_N = Message("wbc.row-n", "row {index}")
THERE_IS_NO_POSITION = Message("wbc.there-is-no-position", "there is no position {name}")
THERE_IS_NO_ROW = Message("wbc.there-is-no-row", "there is no row {value:g}")
BECOMES_NEAREST = Message("wbc.becomes-nearest", "{name} becomes {nearest:.10g}, not {value:.10g}")
IS_OUT_OF_RANGE_FOR = Message("wbc.is-out-of-range-for", "{value:.10g} is out of range for {name}")
STOPS_HERE = Message("wbc.stops-here", "the program stops here with an error")
STATEMENT_NEEDS_FIRMWARE = Message("wbc.statement-needs-firmware", "{keyword} needs firmware {since}")
SHORTEST_DELAY = Message("wbc.shortest-delay", "the shortest delay is {shortest:g} s")
THERE_IS_NO_LABEL = Message("wbc.there-is-no-label", "there is no label {name}")
HOME_NEEDS_A_VELOCITY = Message("wbc.home-needs-a-velocity", "HOME needs a velocity other than 0")
PULSE_IS_TOO_SHORT = Message("wbc.pulse-is-too-short", "PULSE cannot last {value:g} s")
POSITIONS_ARE_NOT_CHECKED = Message("wbc.positions-are-not-checked", "positions are not checked")
CANNOT_USE = Message("wbc.cannot-use", "{keyword} cannot use {name}: {problem}")
STOPS_WHEN_IT_GETS_HERE = Message("wbc.stops-when-it-gets-here", "the program stops with an error when it gets here")
PULSE_NEEDS_AN_OUTPUT = Message("wbc.pulse-needs-an-output", "PULSE needs an output")
NAMES_NO_AXIS = Message("wbc.names-no-axis", "{name} names no axis: nothing moves")
GIVE_A_NUMBER = Message("wbc.give-a-number", "give p1…p4 a number")
UNKNOWN_RECORD = Message("wbc.unknown-record", "an unknown record cannot be executed")

_MEANINGS = {
    keyword: Message(f"wbc.{keyword.lower().replace('_', '-')}", STATEMENTS[keyword].meaning)() for keyword in ROW_MOTIONS
}
_LOOKS_LIKE_MS = 100
"""From this number of seconds on a time is reported as probably milliseconds."""
_BRANCHING = frozenset({"IF", "ELSE", IF_UNKNOWN, "WHILE", "ENDWHILE", "JUMP", "RETURN", "END", "PROGRESET"})


@dataclass(frozen=True, slots=True)
class Resolution:
    """``complete``: the executable may be run, there are no errors and every position is known."""

    executable: s.Executable
    scope: ProgramScope
    complete: bool
    diagnostics: list[Diagnostic]


def resolve(
    program: ProgramTree, positions: PositionTable | None, dialect: Dialect, memory: StepMemory | None = None
) -> Resolution:
    """The steps of a program and the diagnostics beyond single lines. Without a table, positions are not checked.

    ``memory`` has steps of an earlier state of the program, and gets those of this one.
    """
    return _Resolver(program, positions, dialect, memory).resolution()


class _Resolver:
    def __init__(
        self, program: ProgramTree, positions: PositionTable | None, dialect: Dialect, memory: StepMemory | None
    ) -> None:
        self._program = program
        self._memory = memory
        self._positions = positions
        self._dialect = dialect
        self._diagnostics: list[Diagnostic] = []
        self._scope = ProgramScope(program, positions, dialect, self._diagnostics)
        self._near = NearMiss()
        self._outline = outline(program, self._scope, positions, dialect, self._diagnostics)
        self._lines, self._blocks = self._outline.lines, self._outline.blocks
        self._unchecked = False
        self._has_reported_unchecked = False

    def resolution(self) -> Resolution:
        steps = tuple(self._steps(StepMemory() if self._memory is None else self._memory))
        names = tuple(name.text for name in self._scope.variables.values())
        executable = s.Executable(steps, names, self._outline.labels, self._outline.entries, self._outline.records)
        broken = any(isinstance(line.statement, Broken) for line in self._program.lines)
        wrong = broken or any(d.severity is Severity.ERROR for d in self._diagnostics)
        return Resolution(executable, self._scope, not wrong and not self._unchecked, self._diagnostics)

    def _steps(self, memory: StepMemory) -> Iterator[s.ProgramStep]:
        memory.begin(self._scope, self._positions, (self._dialect, self._outline.writes_row_0, tuple(self._outline.records)))
        for number, (statement, kept) in enumerate(zip(self._lines, memory.steps(self._lines), strict=True)):
            if kept is not None:
                yield kept
                continue
            before = len(self._diagnostics)
            step = self._step(number, statement)
            if len(self._diagnostics) == before:
                memory.keep(statement, step, self._scope)
            yield step
        memory.end()

    def _step(self, number: int, statement: StatementNode) -> s.ProgramStep:
        start, end = statement.start, statement.end
        made: s.ProgramStep | None = None
        keyword: str | None = None
        if isinstance(statement, Assign):
            made, keyword = self._assign(statement), SET
        elif isinstance(statement, KeywordStatement):
            made, keyword = self._command(number, statement), statement.keyword
        elif isinstance(statement, Label):
            event, hard = BY_LABEL[statement.name.key]
            made = s.InterruptStep(start, end, event, hard)
        elif isinstance(statement, ImageRecord):
            hint = STOPS_WHEN_IT_GETS_HERE()
            self._report(f.NOT_EXECUTABLE.at(statement, UNKNOWN_RECORD(), hint))
            made = s.IllegalStep(start, end, statement.data, True)
        elif isinstance(statement, Broken):
            keyword = SET if statement.target is not None else statement.keyword
        return made or s.IllegalStep(start, end, b"", keyword is None or keyword in _BRANCHING)

    def _assign(self, statement: Assign) -> s.ProgramStep | None:
        name = statement.target
        target = self._scope.target(name)
        node = statement.value
        value = self._scope.value(node, name) if isinstance(node, Identifier | DecimalNumber) else self._expression(node)
        if isinstance(target, s.RegisterOperand) and isinstance(value, s.Literal):
            self._check_range(target, value.value, statement)
        if target is None or value is None:
            return None
        return s.SetStep(statement.start, statement.end, target, value)

    def _check_range(self, target: s.RegisterOperand, value: float, statement: Assign) -> None:
        domain = target.row.writes
        if domain is None or domain.has(value):
            return
        place = statement.value
        nearest = domain.low if value <= domain.low else domain.high
        fix = number_text(nearest) if isinstance(place, DecimalNumber) and domain.has(nearest) else None
        hint = PERMITTED(domain=domain.text)
        if target.row.saturates:
            self._report(f.SATURATES.at(place, BECOMES_NEAREST(name=target.name, nearest=nearest, value=value), hint, fix))
        else:
            self._report(f.OUT_OF_RANGE.at(place, IS_OUT_OF_RANGE_FOR(value=value, name=target.name), hint, fix))

    def _expression(self, node: Binary | FunctionCall) -> s.Operation | s.FunctionOperation | None:
        value = self._scope.value
        if isinstance(node, Binary):
            left, right = value(node.left), value(node.right)
            if left is None or right is None:
                return None
            if node.operator in "/%" and isinstance(right, s.Literal) and right.value == 0:
                self._report(f.ALWAYS_FAILS.at(node, DIVISION_BY_ZERO(), STOPS_HERE()))
            return s.Operation(left, node.operator, right)
        arguments = [value(argument) for argument in node.arguments]
        found = [argument for argument in arguments if argument is not None]
        if found and isinstance(found[0], s.Literal):
            self._check_argument(node, found[0].value)
        return s.FunctionOperation(node.function.key, tuple(found)) if len(found) == len(arguments) else None

    def _check_argument(self, node: FunctionCall, argument: float) -> None:
        # WBC-5
        impossible = argument < 0 if node.function.key == "SQRT" else node.function.key in ("ASIN", "ACOS") and abs(argument) > 1
        if impossible:
            message = DOES_NOT_EXIST(text=node.function.text, argument=argument)
            self._report(f.ALWAYS_FAILS.at(node, message, STOPS_HERE()))

    def _comparison(self, node: OperandNode) -> s.StepCondition | None:
        relation = cast("Relation", node)  # as the row of the statement says
        left = self._scope.value(relation.left, relation.right)
        right = self._scope.value(relation.right, relation.left)
        return None if left is None or right is None else s.StepCondition(left, relation.comparison, right)

    def _command(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        keyword = statement.keyword
        row = STATEMENTS[keyword]
        if not self._dialect.has(row.since):
            hint = f.CHECKED_FOR(firmware=self._dialect.firmware)
            self._report(f.NOT_IN_FIRMWARE.at(statement, STATEMENT_NEEDS_FIRMWARE(keyword=row.keyword, since=row.since), hint))
        return _STEPS[keyword](self, number, statement)

    def _if(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        condition, close = self._comparison(statement.operands[0]), self._blocks.close.get(number)
        if condition is None or close is None:
            return None
        return s.IfStep(statement.start, statement.end, condition, self._blocks.middle.get(number), close)

    def _else(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        close = self._blocks.close.get(number)
        return None if close is None else s.ElseStep(statement.start, statement.end, close)

    def _while(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        condition, close = self._comparison(statement.operands[0]), self._blocks.close.get(number)
        return None if condition is None or close is None else s.WhileStep(statement.start, statement.end, condition, close)

    def _end_while(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        opened = self._blocks.open.get(number)
        opening = None if opened is None else self._lines[opened]
        if opened is None or not isinstance(opening, KeywordStatement):
            return None
        # The names of this condition were checked at the WHILE.
        judged = len(self._diagnostics)
        condition = self._comparison(opening.operands[0])
        del self._diagnostics[judged:]
        return None if condition is None else s.EndWhileStep(statement.start, statement.end, condition, opened)

    def _wait(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        condition = self._comparison(statement.operands[0])
        return None if condition is None else s.WaitStep(statement.start, statement.end, condition)

    def _delay(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        seconds = self._value(statement.operands[0])
        if isinstance(seconds, s.Literal) and seconds.value < s.SHORTEST_DELAY_S:
            message = DELAY_WAITS(value=seconds.value, shortest=s.SHORTEST_DELAY_S)
            fix = f"{s.SHORTEST_DELAY_S:g}" if isinstance(statement.operands[0], DecimalNumber) else None
            self._report(f.SHORT_DELAY.at(statement.operands[0], message, SHORTEST_DELAY(shortest=s.SHORTEST_DELAY_S), fix))
        self._check_time("DELAY", statement.operands[0], seconds)
        return None if seconds is None else s.DelayStep(statement.start, statement.end, seconds)

    def _check_time(self, keyword: str, operand: OperandNode, seconds: s.ValueSource | None) -> None:
        """Warn of hundreds of seconds, which are probably milliseconds, unless they are whole minutes."""
        if not isinstance(seconds, s.Literal) or seconds.value < _LOOKS_LIKE_MS or seconds.value % 60 == 0:
            return
        minutes, rest = divmod(seconds.value, 60)
        message = HOW_LONG_IT_IS(keyword=keyword, value=seconds.value, minutes=minutes, rest=rest)
        milliseconds = f"{seconds.value / 1000:.10g}"
        fix = milliseconds if isinstance(operand, DecimalNumber) else None
        hint = IN_SECONDS_NOT_MS(value=seconds.value, milliseconds=milliseconds)
        self._report(f.LONG_TIME.at(operand, message, hint, fix=fix))

    def _jump(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        name = cast("Identifier", statement.operands[0])  # as the row of the statement says
        target = self._outline.labels.get(name.key)
        if target is not None:
            return s.JumpStep(statement.start, statement.end, target)
        if not self._outline.has_broken_labels:
            meant = self._near.of(name.text, self._outline.labels)
            hint = DEFINE_THE_LABEL(name=name.text)
            self._report(f.UNKNOWN_LABEL.at(name, THERE_IS_NO_LABEL(name=name.text), hint, meant=meant))
        return None

    def _motion(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        axis = self._axis(statement)
        operand = statement.operands[1]
        value = self._value(operand)
        if axis is None or value is None:
            return None
        if statement.keyword == "HOME" and isinstance(value, s.Literal) and value.value == 0:
            hint = SIDES_OF_HOME()
            self._report(f.OUT_OF_RANGE.at(operand, HOME_NEEDS_A_VELOCITY(), hint))
        return s.MotionStep(statement.start, statement.end, statement.keyword, axis, value)

    def _halt(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        axis = self._axis(statement)
        return None if axis is None else s.HaltStep(statement.start, statement.end, statement.keyword, axis)

    def _axis(self, statement: KeywordStatement) -> int | None:
        """The drive a statement names, from 1."""
        name = statement.operands[0]
        return self._drive(name, statement.keyword) if isinstance(name, Identifier) else None

    def _drive(self, name: Identifier, keyword: str) -> int | None:
        register = self._scope.register(name)
        if register is not None and register.row.key == "M":
            return register.number
        family = parts(name.key)
        if register is not None or family is None or family[0].key != "M":
            finding = f.HALT_WITHOUT_DRIVE if keyword in HALTS else f.MOTION_WITHOUT_DRIVE
            message = NEEDS_A_DRIVE(keyword=keyword, name=name.text)
            self._report(finding.at(name, message, f.WRITE(text=f"{STATEMENTS[keyword].usage}, M1…M4")))
        return None

    def _pulse(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        name, operand = statement.operands
        seconds = self._value(operand)
        register = self._scope.register(name) if isinstance(name, Identifier) else None
        if register is None or register.row.key != "OUT":
            if register is not None or (isinstance(name, Identifier) and parts(name.key) is None):
                self._report(
                    f.WRONG_ARGUMENT.at(name, PULSE_NEEDS_AN_OUTPUT(), f.WRITE(text=f"{STATEMENTS['PULSE'].usage}, OUT1…OUT8"))
                )
            return None
        if isinstance(seconds, s.Literal) and seconds.value <= 0:
            self._report(f.OUT_OF_RANGE.at(operand, PULSE_IS_TOO_SHORT(value=seconds.value), PERMITTED(domain=POSITIVE.text)))
        self._check_time("PULSE", operand, seconds)
        return None if seconds is None else s.PulseStep(statement.start, statement.end, register.number, seconds)

    # -- rows of the position table

    def _row_motion(self, number: int, statement: KeywordStatement) -> s.ProgramStep | None:
        operand = statement.operands[0]
        row = self._position(operand) if isinstance(operand, Position) else self._value(operand, is_row=True)
        if row is None:
            return None
        if (
            self._positions is None
            and not isinstance(operand, Position)
            and not (self._outline.writes_row_0 and row == s.Literal(0.0))
        ):
            self._report_unchecked(operand)
        if isinstance(row, s.Literal) and self._positions is not None:
            index = self._row_index(operand, row.value)
            if index is None:
                return None
            self._check_row(statement, index)
        return s.RowMotionStep(statement.start, statement.end, statement.keyword, row)

    def _position(self, position: Position) -> s.Literal | None:
        name = position.name
        if self._positions is None:
            self._report_unchecked(position)
            self._unchecked = True
            return s.Literal(0.0)
        index = self._positions.index(name.text)
        if index is not None:
            return s.Literal(float(index))
        meant = self._near.of(name.text, self._positions.names())
        hint = ROWS_OF_TABLE(rows=rows_text(len(self._positions.rows)))
        self._report(f.UNKNOWN_POSITION.at(position, THERE_IS_NO_POSITION(name=name.text), hint, meant=meant and f"@{meant}"))
        return None

    def _report_unchecked(self, place: OperandNode) -> None:
        if not self._has_reported_unchecked:
            hint = GIVE_THE_POSITION_TABLE()
            self._report(f.POSITIONS_UNCHECKED.at(place, POSITIONS_ARE_NOT_CHECKED(), hint))
        self._has_reported_unchecked = True

    def _row_index(self, place: OperandNode, value: float) -> int | None:
        rows = 0 if self._positions is None else len(self._positions.rows)
        if (0 <= value < rows and value == int(value)) or (value == 0 and self._outline.writes_row_0):
            return int(value)
        hint = f.NUMBERED_ROWS_OF_TABLE(rows=rows_text(rows))
        self._report(f.UNKNOWN_POSITION.at(place, THERE_IS_NO_ROW(value=value), hint))
        return None

    def _check_row(self, statement: KeywordStatement, index: int) -> None:
        """Check the parameters of a row. Row 0 is not checked if the program writes it."""
        if self._positions is None or index in self._outline.records or (index == 0 and self._outline.writes_row_0):
            return
        values = self._positions.rows[index].values
        name = self._positions.rows[index].name or ROW_N(index=index)
        problem = row_problem(statement.keyword, values)
        if problem is not None:
            hint = _MEANINGS[statement.keyword]
            self._report(
                f.ROW_PARAMETERS.at(
                    statement.operands[0], CANNOT_USE(keyword=statement.keyword, name=name, problem=problem), hint
                )
            )
        elif names_no_axis(statement.keyword, values):
            self._report(f.NO_AXIS.at(statement.operands[0], NAMES_NO_AXIS(name=name), GIVE_A_NUMBER()))

    def _value(self, operand: OperandNode, *, is_row: bool = False) -> s.ValueSource | None:
        return self._scope.value(operand, is_row=is_row) if isinstance(operand, Identifier | DecimalNumber) else None

    def _report(self, diagnostic: Diagnostic) -> None:
        self._diagnostics.append(diagnostic)


def _alone(step: type[s.ProgramStep]) -> Callable[[_Resolver, int, KeywordStatement], s.ProgramStep]:
    """The method for a statement without operands."""
    return lambda resolver, number, statement: step(statement.start, statement.end)


_STEPS: Mapping[str, Callable[[_Resolver, int, KeywordStatement], s.ProgramStep | None]] = complete(
    "statement",
    STATEMENTS,
    "step",
    {
        "IF": _Resolver._if,
        "ELSE": _Resolver._else,
        "ENDIF": _alone(s.EndIfStep),
        "WHILE": _Resolver._while,
        "ENDWHILE": _Resolver._end_while,
        "WAIT": _Resolver._wait,
        "DELAY": _Resolver._delay,
        "JUMP": _Resolver._jump,
        "RETURN": _alone(s.ReturnStep),
        "END": _alone(s.EndStep),
        "PROGRESET": _alone(s.ProgResetStep),
        **dict.fromkeys(MOTIONS, _Resolver._motion),
        **dict.fromkeys(HALTS, _Resolver._halt),
        **dict.fromkeys(ROW_MOTIONS, _Resolver._row_motion),
        "WAITPOS": _alone(s.WaitPosStep),
        "PULSE": _Resolver._pulse,
    },
)
"""The step of a statement by its keyword: resolver, number of the step, statement. None: something in it is wrong."""
