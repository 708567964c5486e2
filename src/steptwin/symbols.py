"""Names in source text: what they name and what is done with it there. One type for all languages."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from steptwin.diagnostics import Span


class SymbolKind(enum.Enum):
    """The kind of object that a name denotes; the values are texts for users."""

    CONSTANT = "constant"
    VARIABLE = "variable"
    REGISTER = "register"
    VALUE = "predefined name"
    FUNCTION = "function"
    LABEL = "label"
    POSITION = "position"
    SECTION = "section"
    KEY = "key"
    CONTROLLER = "controller"
    LINE = "line"
    AXIS = "axis"
    BUTTON = "button"
    ELEMENT = "element"
    SCRIPT = "script"


class SymbolRole(enum.Enum):
    """``DEFINE``: the symbol is defined here."""

    DEFINE = "define"
    WRITE = "write"
    READ = "read"


@dataclass(frozen=True, slots=True)
class Symbol:
    """The object of a name: two uses belong together when kind and key are equal. ``text`` is the name as written there."""

    kind: SymbolKind
    key: str
    text: str = field(compare=False)


@dataclass(frozen=True, slots=True)
class Use:
    """A name at one place."""

    symbol: Symbol
    span: Span
    role: SymbolRole
