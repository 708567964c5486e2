"""Hints behind the words of a program: values of constants, rows of positions, times of moves, memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from steptwin.controller import SECOND
from steptwin.explain.durations import move_duration
from steptwin.lsp.answers import Hint
from steptwin.lsp.wbc.names import Names, row_values
from steptwin.mic488.config import ControllerConfig
from steptwin.symbols import SymbolKind, SymbolRole, Use
from steptwin.wbc import steps as s
from steptwin.wbc.check import CheckedProgram
from steptwin.wbc.incremental import Edited
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.tree import Assign, DecimalNumber, Identifier, KeywordStatement, ValueNode

_SETTINGS = ("ACCM", "DECM", "VMAXM")


def hints(edited: Edited, checked: CheckedProgram, names: Names, uses: Sequence[Use]) -> Iterator[Hint]:
    """In no order."""
    table = names.around.positions
    for use in uses:
        if use.role is not SymbolRole.READ:
            continue
        if use.symbol.kind is SymbolKind.CONSTANT:
            meaning = names.meaning(use.symbol.key)
            if meaning:
                yield Hint(use.span.end, f"= {meaning}", f"the constant {use.symbol.text}")
        elif use.symbol.kind is SymbolKind.POSITION and table is not None:
            index = table.index(use.symbol.text)
            if index is not None:
                yield Hint(use.span.end, row_values(table.rows[index]), f"row {index} of the position table")
    if names.around.config is not None:
        yield from _times(edited, names, names.around.config)
    if checked.lines:
        most = names.around.dialect.max_steps
        last = max(n for n, line in enumerate(edited.program.lines) if line.statement is not None)
        place = edited.starts[last] + len(edited.contents[last])
        yield Hint(place, f"{checked.lines} of {most} lines", "executable lines of the program, and what the memory holds")


def _times(edited: Edited, names: Names, config: ControllerConfig) -> Iterator[Hint]:
    """How long a move over a known distance takes, where the program leaves ramps and velocity as configured."""
    changed = {
        statement.target.key
        for line in edited.program.lines
        if isinstance(statement := line.statement, Assign) and names.scope.family(statement.target) in _SETTINGS
    }
    numbers = {_number(names.scope, key) for key in changed}
    for line in edited.program.lines:
        statement = line.statement
        if not isinstance(statement, KeywordStatement) or statement.keyword != "PREL":
            continue
        drive, distance = statement.operands
        register = names.scope.register(drive) if isinstance(drive, Identifier) else None
        value = _literal(names.scope, distance) if isinstance(distance, Identifier | DecimalNumber) else None
        if register is None or value is None or register.number in numbers or not 1 <= register.number <= len(config.axes):
            continue
        axis = config.axes[register.number - 1]
        duration = move_duration(axis, round(value * axis.gear))
        if duration is not None:
            text = "time of the move from rest, with ramps and velocity of the configuration"
            yield Hint(edited.place(statement.end), f"{duration / SECOND:.3g} s", text)


def _number(scope: ProgramScope, key: str) -> int:
    register = scope.register(Identifier(0, 0, key, key))
    return 0 if register is None else register.number


def _literal(scope: ProgramScope, node: ValueNode) -> float | None:
    if isinstance(node, DecimalNumber):
        return node.value
    known = scope.known.get(node.key)
    return known.value if isinstance(known, s.Literal) else None
