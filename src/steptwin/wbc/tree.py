"""The syntax tree of a WBC program, line by line, with the place of every word.

``start`` and ``end`` are character offsets of the source. Nodes are compared by content, not by place:
two programs are equal when they differ in nothing but blanks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from steptwin.diagnostics import Span


@dataclass(frozen=True, slots=True)
class TreeNode:
    start: int = field(compare=False)
    end: int = field(compare=False)

    @property
    def span(self) -> Span:
        return Span(self.start, self.end)


@dataclass(frozen=True, slots=True)
class DecimalNumber(TreeNode):
    """``20,5`` or ``-20.5``: the text as written, without blanks, and its value."""

    text: str
    value: float


@dataclass(frozen=True, slots=True)
class Identifier(TreeNode):
    """A register, constant, variable, label, function or predefined name as written; ``key`` is it in upper case."""

    text: str
    key: str


@dataclass(frozen=True, slots=True)
class Position(TreeNode):
    """``@name``."""

    name: Identifier


ValueNode: TypeAlias = DecimalNumber | Identifier


@dataclass(frozen=True, slots=True)
class Relation(TreeNode):
    left: ValueNode
    comparison: str
    right: ValueNode


@dataclass(frozen=True, slots=True)
class Binary(TreeNode):
    left: ValueNode
    operator: str
    right: ValueNode


@dataclass(frozen=True, slots=True)
class FunctionCall(TreeNode):
    function: Identifier
    arguments: tuple[ValueNode, ...]


ExpressionNode: TypeAlias = ValueNode | Binary | FunctionCall
OperandNode: TypeAlias = ValueNode | Position | Relation


@dataclass(frozen=True, slots=True)
class ConstantDefinition(TreeNode):
    """``#name value``."""

    name: Identifier
    value: ValueNode


@dataclass(frozen=True, slots=True)
class Label(TreeNode):
    """``NAME:``."""

    name: Identifier


@dataclass(frozen=True, slots=True)
class Assign(TreeNode):
    """``SET target = value``; ``has_set``: the word SET was written."""

    has_set: bool
    target: Identifier
    value: ExpressionNode


@dataclass(frozen=True, slots=True)
class KeywordStatement(TreeNode):
    """Any other statement: its keyword in upper case and its operands as the statement table lists them."""

    keyword: str
    operands: tuple[OperandNode, ...]


@dataclass(frozen=True, slots=True)
class ImageRecord(TreeNode):
    """``//!record`` and 32 hexadecimal digits: a record of a compiled image that is not a known statement."""

    data: bytes


@dataclass(frozen=True, slots=True)
class PositionRecord(TreeNode):
    """``//!position``, an index and 36 hexadecimal digits: a row of a compiled image that a position table cannot express."""

    index: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Broken(TreeNode):
    """A line with an error, as written. What could be understood keeps one mistake from causing others:
    the keyword (a broken IF still opens a block), the name it would have assigned, the label it would have been."""

    text: str
    keyword: str | None = None
    target: Identifier | None = None
    label: Identifier | None = None


StatementNode: TypeAlias = ConstantDefinition | Label | Assign | KeywordStatement | ImageRecord | PositionRecord | Broken


@dataclass(frozen=True, slots=True)
class Comment(TreeNode):
    """From ``//`` to the end of the line, without trailing blanks."""

    text: str


@dataclass(frozen=True, slots=True)
class SourceLine(TreeNode):
    statement: StatementNode | None
    comment: Comment | None


@dataclass(frozen=True, slots=True)
class ProgramTree:
    lines: tuple[SourceLine, ...]

    @property
    def naming(self) -> list[StatementNode]:
        """The statements that may give names a meaning, in their order."""
        return [statement for line in self.lines if type(statement := line.statement) in _NAMING]  # type: ignore[misc]


_NAMING = frozenset({ConstantDefinition, Label, Assign, Broken})
