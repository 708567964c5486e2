"""Completions in descriptions of worlds: tables, keys, and values of keys."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from steptwin.diagnostics import Span
from steptwin.lsp.answers import Completion, CompletionKind, Completions
from steptwin.lsp.world.outline import TableOutline, WorldOutline
from steptwin.lsp.world.signals import WorldSignals
from steptwin.lsp.world.snippets import table_snippet, value_snippet
from steptwin.simulation.components.mount import MountSpec
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.describe.servicetables import SERVICE_TABLES, inner_tables
from steptwin.simulation.describe.steptable import ACTIONS
from steptwin.simulation.describe.tables import all_keys, written
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.values import (
    ANALOG_INPUT,
    DIGITAL_INPUT,
    OUTPUT,
    NameOf,
    NamesInSpace,
    PinOf,
    ValueReader,
    Word,
    flag,
)
from steptwin.symbols import SymbolKind

_KEY = re.compile(r"[ \t]*([A-Za-z0-9_-]*)\Z")
_VALUE = re.compile(r"[ \t]*([A-Za-z0-9_-]+)[ \t]*=[ \t]*(?:\[(?:[^#]*,)?[ \t\[]*)?([\"']?)([^\"'=,#\[\]]*)\Z")
"""Part of a key, or an item of its list in the same line."""
_STEP = re.compile(r"[{,][ \t]*([A-Za-z_]*)\Z")
_STEP_VALUE = re.compile(r"([A-Za-z_]+)[ \t]*=[ \t]*([\"'])([^\"']*)\Z")
_STEP_NAMES = {
    "press": SymbolKind.BUTTON,
    "release": SymbolKind.BUTTON,
    "put": SymbolKind.ELEMENT,
    "send": SymbolKind.LINE,
    "power_cycle": SymbolKind.CONTROLLER,
}
_STEP_AXES = ("move", "home", "wait_for", "turn", "couple")
_FILES = {
    "config": (".cfg",),
    "program": (".prg", ".m1486"),
    "programs": (".prg",),
    "positions": (".csv",),
    "file": (".toml",),
}


def keys_of(table: TableOutline) -> Sequence[Key]:
    """The permitted keys of a table."""
    if len(table.names) > 1 and table.names[0] in KINDS:
        kind = KINDS[table.names[0]]
        return kind.inner_tables.get(table.names[1], ())
    if len(table.names) > 1 and table.names[0] in SERVICE_TABLES:
        inner = SERVICE_TABLES[table.names[0]].inner
        return inner[table.names[1]].keys if table.names[1] in inner else ()
    return all_keys().get(table.kind, ())


class ItemBuilder:
    """For one text. ``files`` gives the names of files beside it by ending."""

    def __init__(self, outline: WorldOutline, signals: WorldSignals, files: Iterable[str]) -> None:
        self._outline = outline
        self._signals = signals
        self._controllers = signals.controllers
        self._files = tuple(files)

    def items(self, before: str, place: int, present: Iterable[str]) -> Completions:
        """``before`` is the line up to the cursor, ``present`` the keys that the table there has."""
        if before.lstrip().startswith("["):
            return Completions(tuple(_tables(Span(place - len(before.lstrip()), place))))
        table = self._outline.table_at(place)
        if table is None:
            return Completions(())
        signals = self._signals.items(before, place, table)
        if signals is not None:
            return Completions(tuple(signals))
        if table.kind in ("event", "script") and (steps := self._step(before, place)) is not None:
            return Completions(tuple(steps))
        found = _KEY.match(before)
        if found is not None:
            return Completions(tuple(_keys(table, Span(place - len(found[1]), place), frozenset(present))))
        found = _VALUE.match(before)
        if found is None:
            return Completions(())
        return Completions(tuple(self._values(table, found[1], found[2], Span(place - len(found[3]), place))))

    def _step(self, before: str, place: int) -> Iterator[Completion] | None:
        """Within steps: their keys and the names they take; None elsewhere."""
        found = _STEP.search(before)
        if found is not None:
            return _actions(Span(place - len(found[1]), place))
        found = _STEP_VALUE.search(before)
        if found is not None and found[1] in _STEP_AXES:
            return self._axes(Span(place - len(found[3]), place), "")
        if found is None or found[1] not in _STEP_NAMES:
            return None
        return self._names(_STEP_NAMES[found[1]], Span(place - len(found[3]), place), "")

    def _values(self, table: TableOutline, name: str, quote: str, span: Span) -> Iterator[Completion]:
        mark = "" if quote else '"'
        key = next((key for key in keys_of(table) if key.name == name), None)
        if key is None:
            return
        if isinstance(key.read, NamesInSpace):
            kinds = (kind for kind, element in ELEMENTS.items() if issubclass(element.spec, MountSpec))
            yield from (_text(word, span, mark, key.meaning) for word in key.read.words)
            yield from (_text(named, span, mark, kind) for kind in kinds for named in self._outline.named(kind))
        elif isinstance(key.read, Word | ValueReader) and key.read.words:
            yield from (_text(word, span, mark, key.meaning) for word in key.read.words)
        elif key.read is flag:
            yield from (Completion(word, CompletionKind.VALUE, span, key.meaning) for word in ("true", "false"))
        elif name == "line":
            yield from self._names(SymbolKind.LINE, span, mark)
        elif name == "feeds":
            yield from self._names(SymbolKind.CONTROLLER, span, mark)
        elif name == "follows":
            yield from self._names(SymbolKind.AXIS, span, mark)
        elif name == "drive":
            yield from self._axes(span, mark)
        elif isinstance(key.read, PinOf):
            yield from self._pins(key.read.kind, span, mark)
        elif isinstance(key.read, NameOf):
            yield from (_text(named, span, mark, key.read.element) for named in self._outline.named(key.read.element))
        elif name in _FILES:
            endings = _FILES[name]
            yield from (_text(file, span, mark, "file") for file in self._files if file.lower().endswith(endings))

    def _axes(self, span: Span, mark: str) -> Iterator[Completion]:
        for controller, kind in self._controllers.items():
            axes = [table for table in kind.inner_tables if table.startswith("M")] or ["M1"]
            yield from (_text(f"{controller}.{axis}", span, mark, kind.title) for axis in axes)

    def _names(self, kind: SymbolKind, span: Span, mark: str) -> Iterator[Completion]:
        for use in self._outline.definitions.values():
            if use.symbol.kind is kind:
                yield _text(use.symbol.text, span, mark, kind.value)

    def _pins(self, kind: str, span: Span, mark: str) -> Iterator[Completion]:
        for controller, of in self._controllers.items():
            there = of.terminals
            pins = {DIGITAL_INPUT: there.digital_inputs, ANALOG_INPUT: there.analog_inputs, OUTPUT: there.outputs}[kind]
            yield from (_text(f"{controller}.{pin}", span, mark, kind) for pin in pins)


def _text(text: str, span: Span, mark: str, detail: str) -> Completion:
    return Completion(text, CompletionKind.VALUE, span, detail, insert=f"{mark}{text}{mark}")


def _tables(span: Span) -> Iterator[Completion]:
    found: dict[str, Sequence[Key]] = {written(name): keys for name, keys in all_keys().items()}
    for text, keys in ({written("fault"): ()} | found | dict(_inner_tables())).items():
        insert = table_snippet(text, keys)
        yield Completion(text, CompletionKind.KEY, span, "table", "", insert, is_snippet=True)


def _inner_tables() -> Iterator[tuple[str, Sequence[Key]]]:
    """Tables in those of elements, which may have them from another one, of services and controllers, with their keys."""
    for element in ELEMENTS.values():
        for key, rows in element.inner.items():
            name = f"[{element.name}.{key}]"
            yield f"[{name}]" if rows.written.startswith("[[") else name, rows.keys
    yield from ((name, rows.keys) for name, rows in inner_tables().items())
    for kind in KINDS.values():
        yield from ((f"[{kind.name}.{inner}]", ()) for inner in kind.inner_tables)


def _keys(table: TableOutline, span: Span, present: frozenset[str]) -> Iterator[Completion]:
    for key in keys_of(table):
        if key.name not in present:
            detail = f"{key.meaning} (needed)" if key.is_required else key.meaning
            yield _key(key, span, detail, rank=0 if key.is_required else 5)


def _actions(span: Span) -> Iterator[Completion]:
    for action in ACTIONS.values():
        yield _key(action.main, span, action.main.meaning)


def _key(key: Key, span: Span, detail: str, rank: int = 5) -> Completion:
    insert = f"{key.name} = {value_snippet(key, 1)}"
    return Completion(key.name, CompletionKind.KEY, span, detail, "", insert, is_snippet=True, rank=rank)
