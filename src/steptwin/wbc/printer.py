"""Tree to text, in one style: keywords in upper case, one blank between words, blocks indented, two blanks before a comment.

Names, numbers, comments and lines with errors stay as written. Printing what was printed changes nothing, and the printed
text has the same tree.
"""

from __future__ import annotations

from steptwin.wbc.statements import CLOSING, OPENING, SET, STATEMENTS
from steptwin.wbc.syntax import POSITION_MARK, RECORD_MARK, parse
from steptwin.wbc.tree import (
    Assign,
    Binary,
    Broken,
    Call,
    Command,
    Condition,
    Constant,
    Label,
    Line,
    Operand,
    Position,
    PositionRecord,
    Program,
    Record,
    Statement,
)

INDENT = "    "


def format_text(text: str) -> str:
    """A program in the one style, with the line ends it had (``\\r\\n`` when it has any). Never raises."""
    program, _ = parse(text)
    return print_program(program, "\r\n" if "\r\n" in text else "\n")


def print_program(program: Program, line_end: str = "\n") -> str:
    """The text of a program. Empty lines at its end are left out."""
    printed: list[str] = []
    depth = 0
    for line in program.lines:
        keyword = _keyword(line.statement)
        if keyword in CLOSING:
            depth = max(depth - 1, 0)
        printed.append(_line(line, max(depth - 1, 0) if keyword == "ELSE" else depth))
        if keyword in OPENING:
            depth += 1
    while printed and not printed[-1]:
        printed.pop()
    return "".join(text + line_end for text in printed)


def _keyword(statement: Statement | None) -> str | None:
    return statement.keyword if isinstance(statement, Command | Broken) else None


def _line(line: Line, depth: int) -> str:
    statement = line.statement
    indent = "" if isinstance(statement, Label | Constant | Record | PositionRecord) else INDENT * depth
    if statement is None:
        return indent + line.comment.text if line.comment else ""
    text = indent + print_statement(statement)
    return f"{text}  {line.comment.text}" if line.comment else text


def print_statement(statement: Statement) -> str:
    """One statement without indentation and comment."""
    match statement:
        case Assign(has_set=has_set, target=target, value=value):
            return f"{SET + ' ' if has_set else ''}{target.text} = {_expression(value)}"
        case Command(keyword=keyword, operands=operands):
            words = [_expression(operand) for operand in operands]
            if STATEMENTS[keyword].in_parentheses:
                return f"{keyword}({', '.join(words)})"
            return " ".join([keyword, *words])
        case Label(name=name):
            return f"{name.text}:"
        case Constant(name=name, value=value):
            return f"#{name.text} {value.text}"
        case Record(data=data):
            return f"{RECORD_MARK} {data.hex().upper()}"
        case PositionRecord(index=index, data=data):
            return f"{POSITION_MARK} {index} {data.hex().upper()}"
        case Broken(text=text):
            return text


def _expression(node: Operand | Binary | Call) -> str:
    match node:
        case Position(name=name):
            return f"@{name.text}"
        case Condition(left=left, comparison=sign, right=right) | Binary(left=left, operator=sign, right=right):
            return f"{left.text} {sign} {right.text}"
        case Call(function=function, arguments=arguments):
            return f"{function.text}({', '.join(argument.text for argument in arguments)})"
        case _:
            return node.text
