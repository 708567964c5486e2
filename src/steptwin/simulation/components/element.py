"""The interface of an element of a world's description: one value (`Element`) for each kind, in a file of its own.

Elements surround the controllers: mechanics, wires, buttons, sources. Registering one
(`steptwin.simulation.components.registry`) makes it available in descriptions, conditions, traces and faults; no other code
distinguishes kinds of elements.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, TypeAlias, cast

from steptwin.controller import Nanos
from steptwin.messages import Message, MessageText
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import B, ElementSpecs, ElementTable, NamedSpec, Reference, S
from steptwin.simulation.components.mount import Movement
from steptwin.simulation.faults.table import FaultKind, Layer
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.channels import MovedChannel
from steptwin.simulation.mechanics.drawing import Drawing
from steptwin.simulation.toml.table import InnerTable, TableRows, TableSpec
from steptwin.tables import IncompleteTable


@dataclass(frozen=True, slots=True, kw_only=True)
class Element(ElementTable[S, B]):
    """A kind of element. ``S`` is its table as a value, ``B`` the built object. Raises `IncompleteTable` for missing entries."""

    refers: Callable[[S, ElementSpecs], Iterable[Reference]]
    """All controllers, lines and elements with terminals that it names. Names that do not exist are reported at the path."""
    build: Callable[[S, ElementContext], B]
    """Adds it to its scheduler. Raises `Misuse` if it does not fit."""
    connect: Callable[[S, B, ElementContext], None] | None = None
    """Called after all elements of this kind were built, because they may refer to each other."""
    terminals: Callable[[S], Terminals] | None = None
    """Its own inputs and outputs, as pins of a controller: others join ``NAME.TERMINAL``. `ElementContext.terminal_block` has
    their levels."""
    signals: Callable[[B], Mapping[str, SignalOf]] | None = None
    """Signals for conditions, by name. Exactly the elements with a ``name`` have signals."""
    drawing: Callable[[B], Drawing] | None = None
    """How it is drawn, where there is more to see than levels and numbers."""
    function: Callable[[B], str] | None = None
    """The word that says what it does among those of its kind, such as ``and``."""
    moved: Callable[[B], Iterable[tuple[str, MovedChannel]]] | None = None
    """The channels of its motion, each of which follows from that of an axis, by name."""
    moves: Callable[[S, B], Sequence[Movement]] | None = None
    """How it moves what is on it, in space, outermost first. An element that has a place and moves nothing: none of them. Raises
    `Misuse` where its unit is none of a place."""
    stands: Callable[[B, Nanos], Stands | None] | None = None
    """Why it does not do what it is switched to; None while it does."""
    faults: tuple[FaultKind, ...] = ()
    """Its faults (`Layer.ELEMENT`), which act on the built object."""
    is_named: bool = field(init=False)
    """Whether its table has a ``name``."""

    @property
    def rows(self) -> TableRows:
        """The keys of its table, with meanings, units and ranges."""
        return self.spec.rows

    @property
    def inner(self) -> Mapping[str, TableRows]:
        """The tables in its table, by key."""
        return {one.key: one.rows for one in self.rows.inner if isinstance(one, InnerTable)}

    @property
    def needs_name(self) -> bool:
        """Whether none of its tables is without a name."""
        return any(key.name == "name" and key.is_required for key in self.rows.keys)

    def named(self, specs: Sequence[TableSpec]) -> Sequence[NamedSpec]:
        """Those of ``specs`` that have a name; none of a kind without names."""
        return [spec for spec in cast("Sequence[NamedSpec]", specs) if spec.name] if self.is_named else ()

    def __post_init__(self) -> None:
        ElementTable.__post_init__(self)
        object.__setattr__(self, "is_named", any(key.name == "name" for key in self.rows.keys))
        where = f"element {self.name}"
        if not self.rows.written:
            raise IncompleteTable(f'{self.spec.__name__} lacks its header: @table("[[NAME]]")')
        if left_over := sorted({one.name for one in fields(self.spec)} - {*self.rows.attributes, "path"}):
            raise IncompleteTable(f"{where}: no key becomes {', '.join(left_over)} of {self.spec.__name__}")
        if self.is_named and self.signals is None:
            raise IncompleteTable(f"{where} has a name and lacks its signals")
        if not self.is_named and self.signals is not None:
            raise IncompleteTable(f"{where} has signals and lacks a name that they could be asked for by")
        if not self.is_named and self.terminals is not None:
            raise IncompleteTable(f"{where} has terminals and lacks a name that they could be connected by")
        for fault in self.faults:
            if fault.layer is not Layer.ELEMENT or not self.is_named:
                raise IncompleteTable(f"{where}: fault {fault.name} is of the layer {Layer.ELEMENT}, and its element has a name")


class Stands(NamedTuple):
    """Why an element does not do what it is switched to."""

    text: MessageText
    since: Nanos | None = None
    """Its own last change, where there was one after those of its inputs and faults."""
    signal: str = ""
    """Signal that shows it; its first output without."""


ON_AND_STANDS = Message("simulation.on-and-stands", "is switched on, and stands")

AnyElement: TypeAlias = Element[Any, Any]
