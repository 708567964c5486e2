"""The answers of an analysis in terms of editors: spans of characters and plain texts, no protocol."""

from __future__ import annotations

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from steptwin.diagnostics import Diagnostic, Span
from steptwin.messages import MessageText
from steptwin.symbols import SymbolKind


@dataclass(frozen=True, slots=True)
class Hover:
    """``text`` is Markdown."""

    span: Span
    text: str


class CompletionKind(enum.Enum):
    """The kind of a completion, for its icon."""

    KEYWORD = enum.auto()
    SNIPPET = enum.auto()
    REGISTER = enum.auto()
    CONSTANT = enum.auto()
    VARIABLE = enum.auto()
    VALUE = enum.auto()
    LABEL = enum.auto()
    POSITION = enum.auto()
    FUNCTION = enum.auto()
    KEY = enum.auto()
    FILE = enum.auto()


@dataclass(frozen=True, slots=True)
class Completion:
    """A completion: ``insert`` (or else the label) takes the place of ``span``; a snippet has tab stops such as ``$1``.

    Items are ordered by ``rank``, low first."""

    label: str
    kind: CompletionKind
    span: Span
    detail: str = ""
    text: str = ""
    """Markdown."""
    insert: str = ""
    is_snippet: bool = False
    rank: int = 5


@dataclass(frozen=True, slots=True)
class Completions:
    """``is_complete`` is False where there are more, of which others come when more has been typed."""

    items: Sequence[Completion]
    is_complete: bool = True


@dataclass(frozen=True, slots=True)
class Signature:
    """How something is written; ``active`` is the number of the parameter being typed, None after the last."""

    label: str
    text: str
    parameters: Sequence[str]
    active: int | None


SHARED = frozenset({SymbolKind.POSITION})
"""Names that mean the same in all files of a controller."""


@dataclass(frozen=True, slots=True)
class TextLocation:
    """A span of a file."""

    uri: str
    span: Span


@dataclass(frozen=True, slots=True)
class Edit:
    span: Span
    text: str


Edits = Mapping[str, Sequence[Edit]]
"""By file."""


@dataclass(frozen=True, slots=True)
class OutlineItem:
    """A row of the outline. ``span`` is all that belongs to it, ``name_span`` its name."""

    name: str
    kind: SymbolKind
    span: Span
    name_span: Span
    detail: str = ""
    children: tuple[OutlineItem, ...] = ()


class FoldKind(enum.Enum):
    REGION = "region"
    COMMENT = "comment"


@dataclass(frozen=True, slots=True)
class Fold:
    """Lines from 0, both included."""

    first: int
    last: int
    kind: FoldKind = FoldKind.REGION


class TokenKind(enum.Enum):
    """The values are the protocol's names."""

    KEYWORD = "keyword"
    COMMENT = "comment"
    NUMBER = "number"
    STRING = "string"
    OPERATOR = "operator"
    FUNCTION = "function"
    LABEL = "label"
    VARIABLE = "variable"
    CONSTANT = "macro"
    REGISTER = "property"
    VALUE = "enumMember"
    POSITION = "struct"
    SECTION = "namespace"


TOKEN_KINDS = {
    SymbolKind.CONSTANT: TokenKind.CONSTANT,
    SymbolKind.VARIABLE: TokenKind.VARIABLE,
    SymbolKind.REGISTER: TokenKind.REGISTER,
    SymbolKind.LINE: TokenKind.REGISTER,
    SymbolKind.VALUE: TokenKind.VALUE,
    SymbolKind.FUNCTION: TokenKind.FUNCTION,
    SymbolKind.LABEL: TokenKind.LABEL,
    SymbolKind.POSITION: TokenKind.POSITION,
}
"""Meanings of the names in programs."""


@dataclass(frozen=True, slots=True)
class SemanticToken:
    """``written`` marks what is given a value here, ``fixed`` what cannot be given one."""

    span: Span
    kind: TokenKind
    written: bool = False
    fixed: bool = False


@dataclass(frozen=True, slots=True)
class CodeAction:
    """A change that fixes a finding."""

    title: MessageText
    edits: Edits
    mends: Diagnostic


@dataclass(frozen=True, slots=True)
class Hint:
    """A text shown behind a character, which is not part of the file."""

    place: int
    label: str
    text: str = ""
    """Its meaning."""


@dataclass(frozen=True, slots=True)
class DocumentLink:
    span: Span
    uri: str


@dataclass(frozen=True, slots=True)
class CallEdge:
    """From the lines of one label to another, by key; the caller "" is the program before its first label.

    ``span`` is the name in the statement that calls."""

    caller: str
    callee: str
    span: Span
