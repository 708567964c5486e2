"""Tree to text, in one style: keywords in upper case, one blank between words, blocks indented, two blanks before a comment.

Names, numbers, comments and lines with errors stay as written, and so does what was arranged on purpose (`steptwin.wbc.layout`):
comments and values of constants in one column, lines indented below a label. Printing what was printed changes nothing, and the
printed text has the same tree.
"""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.diagnostics import split_lines
from steptwin.wbc.layout import LayoutCell, aligned, columns_of, indentations
from steptwin.wbc.statements import SET, STATEMENTS
from steptwin.wbc.syntax import POSITION_MARK, RECORD_MARK, parse
from steptwin.wbc.tree import (
    Assign,
    Binary,
    Broken,
    ConstantDefinition,
    FunctionCall,
    ImageRecord,
    KeywordStatement,
    Label,
    OperandNode,
    Position,
    PositionRecord,
    Relation,
    SourceLine,
    StatementNode,
)

_BEFORE_COMMENT = 2
"""Blanks between a statement and its comment."""


def format_text(text: str) -> str:
    """A program in the standard style. Every line keeps its line end; empty lines at the end are left out. Never raises."""
    program, _ = parse(text)
    written = [content for content, _ in split_lines(text)]
    ends = [end for _, end in split_lines(text)]
    printed = _with_comments(program.lines, written, _bodies(program.lines, written))
    while printed and not printed[-1]:
        printed.pop()
    # A last line without an end is given that of the line before.
    last = next((end for end in reversed(ends) if end), "\n")
    return "".join(line + (end or last) for line, end in zip(printed, ends, strict=False))


def _bodies(lines: Sequence[SourceLine], written: Sequence[str]) -> list[str]:
    """The lines without their comments; of a line that is only a comment, its indentation."""
    columns = aligned([_value_cell(line, text) for line, text in zip(lines, written, strict=True)], _borders(lines))
    bodies: list[str] = []
    for line, indent, column in zip(lines, indentations(lines, written), columns, strict=True):
        statement = line.statement
        body = "" if statement is None else print_statement(statement)
        if isinstance(statement, ConstantDefinition) and column is not None:
            body = f"{f'#{statement.name.text}':<{column}}{statement.value.text}"
        bodies.append(" " * indent + body if body or line.comment else "")
    return bodies


def _value_cell(line: SourceLine, text: str) -> LayoutCell | None:
    """The value of a constant."""
    statement = line.statement
    if not isinstance(statement, ConstantDefinition):
        return None
    place, end = statement.value.start - line.start, statement.name.end - line.start
    return LayoutCell(columns_of(text, place), len(statement.name.text) + 2, arranged=place - end > 1 or "\t" in text[end:place])


def _with_comments(lines: Sequence[SourceLine], written: Sequence[str], bodies: Sequence[str]) -> list[str]:
    """The lines with their comments."""
    cells = [_comment_cell(*each) for each in zip(lines, written, bodies, strict=True)]
    printed: list[str] = []
    for line, body, column in zip(lines, bodies, aligned(cells, _borders(lines)), strict=True):
        if line.comment is None:
            printed.append(body)
        elif column is not None:
            printed.append(f"{body if line.statement else '':<{column}}{line.comment.text}")
        else:
            printed.append(body + (" " * _BEFORE_COMMENT if line.statement else "") + line.comment.text)
    return printed


def _comment_cell(line: SourceLine, text: str, body: str) -> LayoutCell | None:
    if line.comment is None:
        return None
    columns = columns_of(text, line.comment.start - line.start)
    if line.statement is None:
        return LayoutCell(columns, 0, follows=True)
    return LayoutCell(columns, len(body) + _BEFORE_COMMENT)


def _borders(lines: Sequence[SourceLine]) -> list[bool]:
    """Whether a line ends the alignment: empty lines and labels do."""
    return [isinstance(line.statement, Label) or (line.statement is None and line.comment is None) for line in lines]


def print_statement(statement: StatementNode) -> str:
    """One statement without indentation and comment."""
    match statement:
        case Assign(has_set=has_set, target=target, value=value):
            return f"{SET + ' ' if has_set else ''}{target.text} = {_expression(value)}"
        case KeywordStatement(keyword=keyword, operands=operands):
            words = [_expression(operand) for operand in operands]
            if STATEMENTS[keyword].in_parentheses:
                return f"{keyword}({', '.join(words)})"
            return " ".join([keyword, *words])
        case Label(name=name):
            return f"{name.text}:"
        case ConstantDefinition(name=name, value=value):
            return f"#{name.text} {value.text}"
        case ImageRecord(data=data):
            return f"{RECORD_MARK} {data.hex().upper()}"
        case PositionRecord(index=index, data=data):
            return f"{POSITION_MARK} {index} {data.hex().upper()}"
        case Broken(text=text):
            return text


def _expression(node: OperandNode | Binary | FunctionCall) -> str:
    match node:
        case Position(name=name):
            return f"@{name.text}"
        case Relation(left=left, comparison=sign, right=right) | Binary(left=left, operator=sign, right=right):
            return f"{left.text} {sign} {right.text}"
        case FunctionCall(function=function, arguments=arguments):
            return f"{function.text}({', '.join(argument.text for argument in arguments)})"
        case _:
            return node.text
