"""The signals of elements, which only the world that a description builds has: of its tables that are not being edited."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from steptwin.errors import Misuse
from steptwin.lsp.positions import LineIndex
from steptwin.lsp.world.outline import TableOutline
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.build import build
from steptwin.simulation.describe.description import describe
from steptwin.simulation.describe.includes import USE
from steptwin.simulation.kinds.registry import KINDS

UnitsOfSignals = Mapping[str, Mapping[str, str]]
"""By element and signal."""

_BUILT = frozenset({*KINDS, *ELEMENTS, "world", "line", USE})
"""Tables without which elements are others. The rest, such as scripts, may be wrong."""


class ElementSignals:
    """Signals of the elements of one description, whose states come one after the other. A state that cannot be
    built leaves what is known."""

    def __init__(self) -> None:
        self._text: str | None = None
        self._known: UnitsOfSignals = {}

    def known(
        self,
        lines: LineIndex,
        tables: Sequence[TableOutline],
        edited: TableOutline | None,
        name: str,
        read: Callable[[str], bytes],
    ) -> UnitsOfSignals:
        """``edited``: the table that is being typed in. ``read`` gives the content of a file by the name it has in the text."""
        text = "\n".join(lines.line(number) for table in _others(tables, edited) for number in range(table.first, table.last + 1))
        if text != self._text:
            with suppress(Misuse):
                self._known = _built(name, text, read)
            self._text = text
        return self._known


def _others(tables: Sequence[TableOutline], edited: TableOutline | None) -> Sequence[TableOutline]:
    """The tables that are built, without the edited one and what is inside of it."""
    found: list[TableOutline] = []
    left_out = False
    for table in tables:
        if table is edited:
            left_out = True
        elif len(table.names) == 1:
            left_out = False
        if not left_out and table.names[0] in _BUILT:
            found.append(table)
    return found


def _built(name: str, text: str, read: Callable[[str], bytes]) -> UnitsOfSignals:
    """Raises `Misuse` for a text with errors."""
    files: dict[str, bytes] = {}

    def keep(file: str) -> bytes:
        files[file] = read(file)
        return files[file]

    spec = describe(name, text, read=keep)
    for file, _ in spec.files():
        with suppress(Misuse):
            files.get(file) or keep(file)
    parts = build(Blueprint(spec, files), lambda record: None)
    named = (element for built in parts.elements.values() for element in built)
    return {element: {signal: of.unit for signal, of in (parts.element_signals(element) or {}).items()} for element in named}
