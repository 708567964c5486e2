"""The signals that conditions, steps and elements of a description name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property

from steptwin.datasheet import Access, Datasheet, Pin, PinDirection, Point
from steptwin.diagnostics import Span
from steptwin.lsp.answers import Completion, CompletionKind, Hover
from steptwin.lsp.world.built import UnitsOfSignals
from steptwin.lsp.world.outline import TableOutline, WorldOutline
from steptwin.simulation.components.axis import MECHANICS
from steptwin.simulation.kinds.kind import AnyKind
from steptwin.symbols import SymbolKind

_CONDITION = re.compile(r"""\b(?:until|expect|when|of)[ \t]*=[ \t]*(?:"[^"]*|'[^']*)\Z""")
_LEVELS = re.compile(r"""\b(write|set)[ \t]*=[ \t]*\{(?:[^"'}]|"[^"]*"|'[^']*')*(?:"[^"]*|'[^']*)\Z""")
_WORD = re.compile(r"[\w.-]*\Z")
_SIGNAL = re.compile(r"[A-Za-z_][\w-]*\.[\w.]+")
_WORLD = ("time", "idle")


class WorldSignals:
    """For one text. ``controllers`` are the kinds by name; ``elements`` gives the signals of what is not in a table."""

    def __init__(
        self,
        outline: WorldOutline,
        controllers: Mapping[str, AnyKind],
        elements: Callable[[TableOutline | None], UnitsOfSignals],
    ) -> None:
        self._outline = outline
        self.controllers = controllers
        self._elements = elements

    @cached_property
    def _sheets(self) -> Mapping[str, Datasheet]:
        return {name: kind.datasheet_of(None) for name, kind in self.controllers.items()}

    def items(self, before: str, place: int, table: TableOutline) -> Iterator[Completion] | None:
        """Names that fit a place in a table; None where no signal fits. ``before``: the line up to there."""
        is_read = _CONDITION.search(before) is not None
        levels = None if is_read else _LEVELS.search(before)
        if not is_read and levels is None:
            return None
        found = _WORD.search(before)
        word = "" if found is None else found[0]
        return self._items(word, Span(place - len(word), place), "" if levels is None else levels[1], table)

    def _items(self, word: str, span: Span, step: str, table: TableOutline) -> Iterator[Completion]:
        """``step``: write, set, or nothing in a condition."""
        owner, dot, _ = word.partition(".")
        if not dot:
            names = list(self._sheets)
            if not step:
                kinds = (SymbolKind.AXIS, SymbolKind.LINE, SymbolKind.BUTTON, SymbolKind.ELEMENT)
                names += [use.symbol.text for use in self._outline.definitions.values() if use.symbol.kind in kinds]
                names += [*self._elements(table), *_WORLD]
            yield from (Completion(name, CompletionKind.VALUE, span) for name in dict.fromkeys(names))
        elif owner in self._sheets:
            for one in _permitted(self._sheets[owner], step):
                detail = one.direction.value if isinstance(one, Pin) else one.meaning
                yield Completion(f"{owner}.{_name(one)}", CompletionKind.VALUE, span, detail)
        elif not step:
            use = self._outline.definitions.get(owner)
            of = () if use is None else {SymbolKind.AXIS: MECHANICS, SymbolKind.LINE: ("idle",)}.get(use.symbol.kind, ())
            units = dict.fromkeys(of, "") | dict(self._elements(table).get(owner, {}))
            yield from (Completion(f"{owner}.{name}", CompletionKind.VALUE, span, unit) for name, unit in units.items())

    def hover(self, line: str, start: int, place: int) -> Hover | None:
        """Meaning of a signal. ``start``: the place of the line."""
        for found in _SIGNAL.finditer(line):
            if start + found.start() <= place <= start + found.end():
                owner, _, name = found[0].partition(".")
                sheet = self._sheets.get(owner)
                if sheet is not None:
                    known = (*sheet.points, *sheet.pins)
                    text = next((_meaning(one) for one in known if _name(one).upper() == name.upper()), None)
                else:
                    text = self._of_element(owner, name.lower())
                return None if text is None else Hover(Span(start + found.start(), start + found.end()), f"`{found[0]}`: {text}")
        return None

    def _of_element(self, owner: str, name: str) -> str | None:
        """Meaning of a signal of an element."""
        use, unit = self._outline.definitions.get(owner), self._elements(None).get(owner, {}).get(name)
        if use is None or unit is None:
            return None
        return f"{name} of the {use.symbol.kind.value} {owner}.{f' Unit: {unit}.' if unit else ''}"


def _permitted(sheet: Datasheet, step: str) -> Iterator[Pin | Point]:
    if step != "set":
        unwanted = Access.READ if step else Access.WRITE
        yield from (point for point in sheet.points if point.access is not unwanted)
    if step != "write":
        pins = {pin.name: pin for pin in sheet.pins if not step or pin.direction is not PinDirection.OUTPUT}
        known = set() if step else {point.path.upper() for point in sheet.points}
        yield from (pin for name, pin in pins.items() if name.upper() not in known)


def _name(known: Pin | Point) -> str:
    return known.name if isinstance(known, Pin) else known.path


def _meaning(known: Pin | Point) -> str:
    unit = f" Unit: {known.unit}." if known.unit else ""
    if isinstance(known, Pin):
        return f"{'analog ' if known.is_analog else ''}{known.direction.value}.{unit}"
    values = ", ".join(f"{number} = {text}" for number, text in known.values.items())
    return f"{known.meaning.rstrip('.')}.{unit}{f' Values: {values}.' if values else ''}"
