"""The steps of statements that are resolved again and again while a program is edited.

A step is kept as long as its statement is the same node and every name in it has the same meaning. Steps that name other steps
(of blocks and jumps) are made anew, and so are those with diagnostics.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from steptwin.wbc import steps as s
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.statements import ROW_MOTIONS
from steptwin.wbc.tree import (
    Assign,
    Binary,
    ExpressionNode,
    FunctionCall,
    Identifier,
    KeywordStatement,
    OperandNode,
    Relation,
    StatementNode,
)

_BY_NUMBER = frozenset({"IF", "ELSE", "WHILE", "ENDWHILE", "JUMP"})


class StepMemory:
    """Steps by statement. Begin with `begin`, ask for the `steps`, `keep` those that were made, then `end`."""

    def __init__(self) -> None:
        self._kept: dict[int, tuple[StatementNode, s.ProgramStep, tuple[str, ...]]] = {}
        self._next: dict[int, tuple[StatementNode, s.ProgramStep, tuple[str, ...]]] = {}
        self._meanings: dict[str, object] = {}
        self._positions: PositionTable | None = None
        self._rest: object = None

    def begin(self, scope: ProgramScope, positions: PositionTable | None, rest: object) -> None:
        """Forget the steps whose names mean something else now, and all when the table or the ``rest`` is another."""
        meanings = scope.meanings()
        if positions is not self._positions or rest != self._rest:
            self._kept.clear()
        elif changed := {key for key, _ in self._meanings.items() ^ meanings.items()}:
            self._kept = {key: entry for key, entry in self._kept.items() if changed.isdisjoint(entry[2])}
        self._meanings, self._positions, self._rest = meanings, positions, rest

    def steps(self, statements: Sequence[StatementNode]) -> list[s.ProgramStep | None]:
        """The step of each statement, None where it must be made."""
        known = self._kept
        entries = [known.get(id(statement)) for statement in statements]
        self._next = {id(entry[0]): entry for entry in entries if entry is not None}
        return [None if entry is None else entry[1] for entry in entries]

    def keep(self, statement: StatementNode, step: s.ProgramStep, scope: ProgramScope) -> None:
        """Keep a step without diagnostics, if it may be kept."""
        if isinstance(statement, KeywordStatement):
            if statement.keyword in _BY_NUMBER or (self._positions is None and statement.keyword in ROW_MOTIONS):
                return
        elif not isinstance(statement, Assign):
            return
        names = tuple(_names(statement))
        if scope.remarked.isdisjoint(names):
            self._next[id(statement)] = statement, step, names

    def end(self) -> None:
        """Forget the statements that are no longer in the program."""
        self._kept = self._next


def _names(node: Assign | KeywordStatement | ExpressionNode | OperandNode) -> Iterator[str]:
    """The names with a meaning in the program; labels and positions are looked up elsewhere."""
    match node:
        case Identifier(key=key):
            yield key
        case Assign(target=left, value=right) | Binary(left=left, right=right) | Relation(left=left, right=right):
            yield from _names(left)
            yield from _names(right)
        case KeywordStatement(operands=parts) | FunctionCall(arguments=parts):
            for part in parts:
                yield from _names(part)
        case _:
            return
