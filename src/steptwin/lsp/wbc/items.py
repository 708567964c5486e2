"""Completions and signatures of programs: what may stand where the cursor is, by the words before it."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from steptwin.diagnostics import Span
from steptwin.lsp.answers import Completion, CompletionKind, Completions, Signature
from steptwin.lsp.letters import has_letters
from steptwin.lsp.wbc import names as n
from steptwin.lsp.wbc.names import Names
from steptwin.wbc import steps as s
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.events import BY_LABEL, PREFIX
from steptwin.wbc.lexer import COMPARISON, OPERATOR, WORD, Lexeme, tokens
from steptwin.wbc.registers import PREDEFINED, REGISTERS, VALUE_NAMES, RegisterRow, parts
from steptwin.wbc.statements import (
    COMPARISONS,
    FUNCTIONS,
    OPERATORS,
    SET,
    SET_USAGE,
    STATEMENTS,
    FunctionRow,
    OperandKind,
    StatementRow,
)

MOST_ITEMS = 150
"""Limit of completions; further letters select others."""
_WORD = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_$")
_NEAR_REGISTERS = 8
"""User registers offered of a kind that the program does not use yet."""


class Expected(enum.Enum):
    """The kind of operand expected at the cursor."""

    STATEMENT = enum.auto()
    TARGET = enum.auto()
    VALUE = enum.auto()
    EXPRESSION = enum.auto()
    CONSTANT = enum.auto()
    SIGN = enum.auto()
    OPERATOR = enum.auto()
    AXIS = enum.auto()
    OUTPUT = enum.auto()
    LABEL = enum.auto()
    ROW = enum.auto()
    POSITION = enum.auto()
    NOTHING = enum.auto()


class Context(NamedTuple):
    """``other`` is the name that the value is compared with or given to."""

    wanted: Expected
    other: str = ""


_OPERANDS = {
    OperandKind.AXIS: Expected.AXIS,
    OperandKind.OUTPUT: Expected.OUTPUT,
    OperandKind.VALUE: Expected.VALUE,
    OperandKind.LABEL: Expected.LABEL,
    OperandKind.ROW: Expected.ROW,
}


def context(words: Sequence[Lexeme]) -> Context:
    """Context behind the words of a line: what may follow."""
    if not words:
        return Context(Expected.STATEMENT)
    first = words[0].text.upper()
    if words[-1].text == "@":
        return Context(Expected.POSITION)
    if first == "#":
        return Context(Expected.CONSTANT if len(words) == 2 else Expected.NOTHING)
    if first in STATEMENTS:
        return _of_command(STATEMENTS[first], words[1:])
    if first == SET:
        if len(words) == 1:
            return Context(Expected.TARGET)
        return _of_assignment(words[1], words[2:])
    return _of_assignment(words[0], words[1:])


def _of_assignment(target: Lexeme, rest: Sequence[Lexeme]) -> Context:
    if not rest or rest[0].text != "=":
        return Context(Expected.NOTHING)
    if len(rest) == 1:
        return Context(Expected.EXPRESSION, target.text)
    if rest[-1].kind == OPERATOR or rest[-1].text in ("(", ","):
        return Context(Expected.VALUE)
    return Context(Expected.OPERATOR if len(rest) == 2 else Expected.NOTHING)


def _of_command(row: StatementRow, rest: Sequence[Lexeme]) -> Context:
    given = [word for word in rest if word.text not in ("(", ")", ",", "-")]
    if row.operands and row.operands[0].kind is OperandKind.CONDITION:
        if not given:
            return Context(Expected.VALUE)
        if len(given) == 1:
            return Context(Expected.SIGN)
        comparison = len(given) == 2 and given[1].kind == COMPARISON
        return Context(Expected.VALUE, given[0].text) if comparison else Context(Expected.NOTHING)
    if len(given) >= len(row.operands):
        return Context(Expected.NOTHING)
    return Context(_OPERANDS[row.operands[len(given)].kind])


def before_cursor(line: str, column: int) -> tuple[str, int, int] | None:
    """The code before the word at the cursor, and where that word begins and ends; None inside a comment."""
    slashes = line.find("//")
    if 0 <= slashes < column:
        return None
    start = end = column
    while start > 0 and line[start - 1] in _WORD:
        start -= 1
    while end < len(line) and line[end] in _WORD and (slashes < 0 or end < slashes):
        end += 1
    return line[:start], start, end


def items(line: str, column: int, start: int, names: Names, used: Sequence[str]) -> Completions:
    """The completions at a column of a line that begins at ``start``. ``used`` are the user registers of the program."""
    found = before_cursor(line, column)
    if found is None:
        return Completions(())
    code, begin, end = found
    typed = line[begin:column].upper()
    maker = _Maker(Span(start + begin, start + end), names, used, typed)
    wanted = [item for item in maker.items(context(tokens(code, 0))) if has_letters(item.label.upper(), typed)]
    wanted.sort(key=lambda item: (item.rank, not item.label.upper().startswith(typed)))
    return Completions(wanted[:MOST_ITEMS], len(wanted) <= MOST_ITEMS)


class _Maker:
    def __init__(self, span: Span, names: Names, used: Sequence[str], typed: str) -> None:
        self._span = span
        self._names = names
        self._used = used
        self._typed = typed
        self._dialect = names.around.dialect

    def items(self, context: Context) -> Iterator[Completion]:
        match context.wanted:
            case Expected.STATEMENT:
                yield from self._statements()
                yield from self._targets(rank=3)
            case Expected.TARGET:
                yield from self._targets(rank=1)
            case Expected.VALUE:
                yield from self._values(context.other)
            case Expected.EXPRESSION:
                yield from self._functions()
                yield from self._values(context.other)
            case Expected.CONSTANT:
                yield from self._registers(rank=1)
                yield from self._predefined(())
            case Expected.AXIS:
                yield from self._family("M")
            case Expected.OUTPUT:
                yield from self._family("OUT")
            case Expected.LABEL:
                yield from self._labels()
            case Expected.ROW:
                yield from self._positions("@")
                yield from self._values("")
            case Expected.POSITION:
                yield from self._positions("")
            case Expected.SIGN:
                yield from self._signs(COMPARISONS)
            case Expected.OPERATOR:
                yield from self._signs(OPERATORS)
            case Expected.NOTHING:
                return

    def _item(self, label: str, kind: CompletionKind, detail: str, text: str = "", *, rank: int = 5) -> Completion:
        return Completion(label, kind, self._span, detail, text, rank=rank)

    def _snippet(
        self, label: str, kind: CompletionKind, detail: str, insert: str, *, text: str = "", rank: int = 4
    ) -> Completion:
        return Completion(label, kind, self._span, detail, text, insert, True, rank)

    def _statements(self) -> Iterator[Completion]:
        for row in STATEMENTS.values():
            if self._dialect.has(row.since):
                yield self._snippet(
                    row.keyword, CompletionKind.KEYWORD, row.usage, _SNIPPETS[row.keyword], text=row.meaning, rank=2
                )
        yield self._snippet(SET, CompletionKind.KEYWORD, SET_USAGE, "SET ${1:X} = ${0:Y}", rank=2)
        yield self._snippet("subroutine", CompletionKind.SNIPPET, "LABEL: … RETURN", "${1:NAME}:\n$0\nRETURN")
        yield self._snippet("constant", CompletionKind.SNIPPET, "#name value", "#${1:name} ${0:value}")
        for label, (event, hard) in BY_LABEL.items():
            if not hard and label not in self._names.labels and self._dialect.has(event.since):
                detail = f"interrupt of {event.name}"
                yield self._snippet(f"{label}:", CompletionKind.LABEL, detail, f"{label}:\n$0\nRETURN", rank=6)

    def _targets(self, rank: int) -> Iterator[Completion]:
        scope = self._names.scope
        for name in scope.variables.values():
            yield self._item(name.text, CompletionKind.VARIABLE, "variable", rank=rank)
        for key, name in scope.constants.items():
            value = scope.known.get(key)
            if isinstance(value, s.RegisterOperand) and value.row.writes is not None:
                yield self._item(name.text, CompletionKind.CONSTANT, f"= {value.name}", rank=rank)
        yield from self._registers(rank + 1, writable=True)

    def _values(self, other: str) -> Iterator[Completion]:
        scope = self._names.scope
        yield from self._predefined(self._names_for(other))
        for name in scope.variables.values():
            yield self._item(name.text, CompletionKind.VARIABLE, "variable", rank=2)
        for key, name in scope.constants.items():
            yield self._item(name.text, CompletionKind.CONSTANT, f"= {self._names.meaning(key)}", rank=2)
        yield from self._registers(rank=3)

    def _names_for(self, other: str) -> tuple[str, ...]:
        """The predefined names that go with a register."""
        known = self._names.scope.known.get(other.upper())
        found = parts(other.upper())
        row = known.row if isinstance(known, s.RegisterOperand) else found[0] if found is not None else None
        if row is None:
            return ()
        return VALUE_NAMES.get(row.writes or row.reads) or VALUE_NAMES.get(row.reads) or ()

    def _predefined(self, first: Sequence[str]) -> Iterator[Completion]:
        for name, value in PREDEFINED.items():
            yield self._item(name, CompletionKind.VALUE, f"{value:g}", rank=0 if name in first else 5)

    def _registers(self, rank: int, *, writable: bool = False) -> Iterator[Completion]:
        for label, row in _register_names(self._dialect):
            if row.writes is not None or not writable:
                yield Completion(label, CompletionKind.REGISTER, self._span, row.meaning, row.unit, rank=rank)
        if self._typed.startswith("$"):
            yield from self._user_registers(rank)

    def _user_registers(self, rank: int) -> Iterator[Completion]:
        for name in self._used:
            yield self._item(name, CompletionKind.REGISTER, "user register of this program", rank=rank)
        for row in REGISTERS:
            if row.words:
                numbers = [number for number in row.numbers(self._dialect) if f"{row.name}{number}".startswith(self._typed)]
                for number in numbers[:_NEAR_REGISTERS]:
                    if f"{row.name}{number}" not in self._used:
                        yield self._item(f"{row.name}{number}", CompletionKind.REGISTER, row.meaning, rank=rank + 1)

    def _family(self, key: str) -> Iterator[Completion]:
        """The registers of one family and the constants that name one of them."""
        scope = self._names.scope
        for constant, name in scope.constants.items():
            value = scope.known.get(constant)
            if isinstance(value, s.RegisterOperand) and value.row.key == key:
                yield self._item(name.text, CompletionKind.CONSTANT, f"= {value.name}", rank=0)
        for label, row in _register_names(self._dialect):
            if row.key == key:
                yield self._item(label, CompletionKind.REGISTER, row.meaning, rank=1)

    def _functions(self) -> Iterator[Completion]:
        for row in FUNCTIONS.values():
            stops = ", ".join(f"${{{number}:{letter}}}" for number, letter in enumerate("YZ"[: row.arguments], 1))
            yield self._snippet(row.name, CompletionKind.FUNCTION, row.meaning, f"{row.name}({stops})")

    def _labels(self) -> Iterator[Completion]:
        for key, label in self._names.labels.items():
            if key not in BY_LABEL or not key.startswith(PREFIX):
                yield self._item(label, CompletionKind.LABEL, "label", rank=0)

    def _positions(self, mark: str) -> Iterator[Completion]:
        table = self._names.around.positions
        for number, row in enumerate(table.rows if table is not None else ()):
            if row.name:
                yield self._item(f"{mark}{row.name}", CompletionKind.POSITION, f"row {number}: {n.row_values(row)}", rank=0)

    def _signs(self, meanings: dict[str, str]) -> Iterator[Completion]:
        for sign, meaning in meanings.items():
            yield self._item(sign, CompletionKind.KEYWORD, meaning)


@lru_cache(maxsize=len(REGISTERS))
def _register_names(dialect: Dialect) -> tuple[tuple[str, RegisterRow], ...]:
    """The names of all registers but user registers, with their rows."""
    found: list[tuple[str, RegisterRow]] = []
    for row in REGISTERS:
        if row.words or not dialect.has(row.since):
            continue
        numbers = row.numbers(dialect)
        found += [(f"{row.name}{number}", row) for number in numbers] if numbers else [(row.name, row)]
    return tuple(found)


_EXAMPLES = {OperandKind.AXIS: "M1", OperandKind.OUTPUT: "OUT1", OperandKind.LABEL: "LABEL", OperandKind.ROW: "@name"}


def _snippet_of(row: StatementRow) -> str:
    if row.operands and row.operands[0].kind is OperandKind.CONDITION:
        condition = f"{row.keyword} ${{1:IN1}} = ${{2:ON}}"
        return condition if row.keyword == "WAIT" else f"{condition}\n    $0\nEND{row.keyword}"
    stops = [f"${{{number}:{_EXAMPLES.get(operand.kind, operand.name)}}}" for number, operand in enumerate(row.operands, 1)]
    if row.in_parentheses:
        return f"{row.keyword}({', '.join(stops)})"
    return " ".join([row.keyword, *stops])


_SNIPPETS = {row.keyword: _snippet_of(row) for row in STATEMENTS.values()}


def signature(line: str, column: int) -> Signature | None:
    """How the statement or function is written whose operands are being typed."""
    found = before_cursor(line, column)
    if found is None:
        return None
    words = tokens(found[0], 0)
    if not words:
        return None
    function = _open_function(words)
    if function is not None:
        row, active = function
        parameters = ["Y", "Z"][: row.arguments]
        label = f"{row.name}({', '.join(parameters)})"
        return Signature(label, row.meaning, parameters, active if active < row.arguments else None)
    key = words[0].text.upper()
    if key not in STATEMENTS or not STATEMENTS[key].operands:
        return None
    row = STATEMENTS[key]
    given = [word for word in words[1:] if word.text not in ("(", ")", ",", "-", "@")]
    is_condition = row.operands[0].kind is OperandKind.CONDITION
    parameters = ["X", "=", "Y"] if is_condition else [operand.name for operand in row.operands]
    return Signature(row.usage, row.meaning, parameters, len(given) if len(given) < len(parameters) else None)


def _open_function(words: Sequence[Lexeme]) -> tuple[FunctionRow, int] | None:
    """The function whose parenthesis is open, and the number of the argument being typed."""
    depth = 0
    for number in range(len(words) - 1, 0, -1):
        if words[number].text == ")":
            depth += 1
        elif words[number].text == "(":
            if depth:
                depth -= 1
                continue
            name = words[number - 1]
            row = FUNCTIONS.get(name.text.upper()) if name.kind == WORD else None
            commas = sum(word.text == "," for word in words[number:])
            return None if row is None else (row, commas)
    return None
