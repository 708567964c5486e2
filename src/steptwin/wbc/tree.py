"""The syntax tree of a WBC program: what the text says, line by line, with the place of every word.

``start`` and ``end`` are character offsets of the source. Nodes compare by what they say, not by where they stand:
two programs are equal when they differ in nothing but blanks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from steptwin.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Node:
    start: int = field(compare=False)
    end: int = field(compare=False)

    @property
    def span(self) -> Span:
        return Span(self.start, self.end)


@dataclass(frozen=True, slots=True)
class Number(Node):
    """``20,5`` or ``-20.5``: the text as written, without blanks, and its value."""

    text: str
    value: float


@dataclass(frozen=True, slots=True)
class Name(Node):
    """A register, constant, variable, label, function or predefined name as written; ``key`` is it in upper case."""

    text: str
    key: str


@dataclass(frozen=True, slots=True)
class Position(Node):
    """``@name``."""

    name: Name


Value: TypeAlias = Number | Name


@dataclass(frozen=True, slots=True)
class Condition(Node):
    left: Value
    comparison: str
    right: Value


@dataclass(frozen=True, slots=True)
class Binary(Node):
    left: Value
    operator: str
    right: Value


@dataclass(frozen=True, slots=True)
class Call(Node):
    function: Name
    arguments: tuple[Value, ...]


Expression: TypeAlias = Value | Binary | Call
Operand: TypeAlias = Value | Position | Condition


@dataclass(frozen=True, slots=True)
class Constant(Node):
    """``#name value``."""

    name: Name
    value: Value


@dataclass(frozen=True, slots=True)
class Label(Node):
    """``NAME:``."""

    name: Name


@dataclass(frozen=True, slots=True)
class Assign(Node):
    """``SET target = value``; ``has_set`` tells whether the word SET was written."""

    has_set: bool
    target: Name
    value: Expression


@dataclass(frozen=True, slots=True)
class Command(Node):
    """Any other statement: its keyword in upper case and its operands as the statement table lists them."""

    keyword: str
    operands: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Record(Node):
    """``//!record`` and 32 hexadecimal digits: a record of a compiled image that is not a known statement."""

    data: bytes


@dataclass(frozen=True, slots=True)
class PositionRecord(Node):
    """``//!position``, an index and 36 hexadecimal digits: a row of a compiled image that a position table cannot express."""

    index: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Broken(Node):
    """A line with an error, as written. What could be understood keeps one mistake from causing others:
    the keyword (a broken IF still opens a block), the name it would have assigned, the label it would have been."""

    text: str
    keyword: str | None = None
    target: Name | None = None
    label: Name | None = None


Statement: TypeAlias = Constant | Label | Assign | Command | Record | PositionRecord | Broken


@dataclass(frozen=True, slots=True)
class Comment(Node):
    """From ``//`` to the end of the line, without trailing blanks."""

    text: str


@dataclass(frozen=True, slots=True)
class Line(Node):
    statement: Statement | None
    comment: Comment | None


@dataclass(frozen=True, slots=True)
class Program:
    lines: tuple[Line, ...]
