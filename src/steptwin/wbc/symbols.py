"""Every name in a program with what it means there and what is done with it."""

from __future__ import annotations

from collections.abc import Container, Iterator

from steptwin.diagnostics import Span
from steptwin.symbols import Symbol, SymbolKind, SymbolRole, Use
from steptwin.wbc.events import BY_LABEL
from steptwin.wbc.lexer import WORD, is_name, tokens
from steptwin.wbc.registers import PREDEFINED, parts
from steptwin.wbc.scope import ProgramScope
from steptwin.wbc.statements import FUNCTIONS, STATEMENTS, OperandKind
from steptwin.wbc.tree import (
    Assign,
    Binary,
    Broken,
    ConstantDefinition,
    DecimalNumber,
    ExpressionNode,
    FunctionCall,
    Identifier,
    KeywordStatement,
    Label,
    OperandNode,
    Position,
    ProgramTree,
    Relation,
    StatementNode,
)


def uses(program: ProgramTree, scope: ProgramScope) -> Iterator[Use]:
    """The names of a program in the order of its lines; in wrong lines those that mean something."""
    for line in program.lines:
        if line.statement is not None:
            yield from of_statement(line.statement, scope)


def kind_of(key: str, scope: ProgramScope) -> SymbolKind | None:
    """Kind of a name in upper case as a value or target; None for one that means nothing."""
    if key in scope.constants:
        return SymbolKind.CONSTANT
    if key in scope.variables:
        return SymbolKind.VARIABLE
    if parts(key) is not None:
        return SymbolKind.REGISTER
    return SymbolKind.VALUE if key in PREDEFINED else None


def of_statement(statement: StatementNode, scope: ProgramScope) -> Iterator[Use]:
    match statement:
        case ConstantDefinition(name=name, value=value):
            yield _use(name, SymbolKind.CONSTANT, SymbolRole.DEFINE)
            yield from _value(value, scope)
        case Label(name=name):
            yield _use(name, SymbolKind.LABEL, SymbolRole.DEFINE)
        case Assign(target=target, value=value):
            yield from _target(target, scope)
            yield from _value(value, scope)
        case KeywordStatement(keyword=keyword, operands=operands):
            for wanted, operand in zip(STATEMENTS[keyword].operands, operands, strict=False):
                if wanted.kind is OperandKind.LABEL and isinstance(operand, Identifier):
                    yield _use(operand, SymbolKind.LABEL)
                else:
                    yield from _value(operand, scope)
        case Broken():
            yield from _broken(statement, scope)


def _use(name: Identifier, kind: SymbolKind, role: SymbolRole = SymbolRole.READ) -> Use:
    return Use(Symbol(kind, name.key, name.text), Span(name.start, name.end), role)


def _target(name: Identifier, scope: ProgramScope) -> Iterator[Use]:
    kind = kind_of(name.key, scope)
    if kind is not None:
        first = kind is SymbolKind.VARIABLE and scope.variables[name.key].start == name.start
        yield _use(name, kind, SymbolRole.DEFINE if first else SymbolRole.WRITE)


def _value(node: ExpressionNode | OperandNode, scope: ProgramScope) -> Iterator[Use]:
    match node:
        case Identifier(key=key):
            kind = kind_of(key, scope)
            if kind is not None:
                yield _use(node, kind)
        case Position(name=name):
            yield _use(name, SymbolKind.POSITION)
        case Binary(left=left, right=right) | Relation(left=left, right=right):
            yield from _value(left, scope)
            yield from _value(right, scope)
        case FunctionCall(function=function, arguments=arguments):
            yield _use(function, SymbolKind.FUNCTION)
            for argument in arguments:
                yield from _value(argument, scope)
        case DecimalNumber():
            return


def _broken(statement: Broken, scope: ProgramScope) -> Iterator[Use]:
    """The names of a wrong line, by the words in it."""
    if statement.text.startswith("//"):
        return
    words = tokens(statement.text, statement.start)
    for number, word in enumerate(words):
        if word.kind != WORD:
            continue
        name = Identifier(word.start, word.end, word.text, word.text.upper())
        before = words[number - 1].text.upper() if number else ""
        after = words[number + 1].text if number + 1 < len(words) else ""
        yield from _word(name, before, after, scope, statement)


def _word(name: Identifier, before: str, after: str, scope: ProgramScope, statement: Broken) -> Iterator[Use]:
    label, target = statement.label, statement.target
    if before == "@":
        yield _use(name, SymbolKind.POSITION)
    elif before == "JUMP":
        yield _use(name, SymbolKind.LABEL)
    elif label is not None and name.start == label.start:
        yield _use(name, SymbolKind.LABEL, SymbolRole.DEFINE)
    elif after == "(" and name.key in FUNCTIONS:
        yield _use(name, SymbolKind.FUNCTION)
    elif target is not None and name.start == target.start:
        yield from _target(name, scope)
    else:
        yield from _value(name, scope)


def name_problem(text: str, scope: ProgramScope, labels: Container[str]) -> str | None:
    """Why a text cannot be the name of a constant, a variable or a label; None when it can."""
    key = text.upper()
    if not is_name(text):
        return f"{text!r} is not a name: letters without accents, digits and _, no digit first"
    taken = scope.reserved(key)
    if taken is None and key in BY_LABEL:
        taken = "an interrupt label"
    if taken is None:
        owners = (("a constant", scope.constants), ("a variable", scope.variables), ("a label", labels))
        taken = next((owner for owner, names in owners if key in names), None)
    return None if taken is None else f"{text} is {taken} already"
