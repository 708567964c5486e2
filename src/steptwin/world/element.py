"""What a world wants of an element that its description may have: one value (`Element`), in a file of its own.

An element is what is around the controllers: mechanics, wires, buttons, sources. It becomes part of descriptions, conditions,
traces and faults by being registered (`steptwin.world.elements`); nothing else asks which one it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias, TypeVar, cast

from steptwin.tables import IncompleteTable
from steptwin.world.faults.table import FaultKind, Layer
from steptwin.world.reader import TomlText
from steptwin.world.sense import TableRows
from steptwin.world.tomlplaces import Path

if TYPE_CHECKING:
    from steptwin.world.signals import SignalOf
    from steptwin.world.site import Site
    from steptwin.world.spec import WorldSpec

Row: TypeAlias = Mapping[str, Any]
"""Values of a table by attribute, read and checked one by one, with its ``path``."""
Table: TypeAlias = Mapping[str, Any]
"""The table as it was written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSpec:
    """An element as its table describes it. ``path`` is where the table is in the text."""

    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedSpec(ElementSpec):
    """One that others refer to."""

    name: str


S = TypeVar("S", bound=ElementSpec)
B = TypeVar("B")


class Reference(NamedTuple):
    """Two machines or lines that an element joins, or one twice; they are in one kernel. ``path`` is the key that names them."""

    one: str
    other: str
    path: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Element(Generic[S, B]):
    """An element: ``S`` is its table as a value, ``B`` what is built of it. `IncompleteTable` where something is missing."""

    name: str
    """Of its table: ``[[NAME]]``."""
    spec: type[S]
    rows: TableRows
    """Its keys, with meanings, units and ranges."""
    inner: Mapping[str, TableRows] = field(default_factory=dict)
    """Tables in it, by their keys; ``spec`` has an attribute for each."""
    inner_attributes: Mapping[str, str] = field(default_factory=dict)
    """The attributes of inner tables, where these are not their keys."""
    read: Callable[[TomlText, Row, Table], S]
    """Reports what is wrong with keys taken together, and with inner tables."""
    refers: Callable[[S, WorldSpec], Iterable[Reference]]
    """Every machine and line that it names. What is not there is reported at the path."""
    build: Callable[[S, Site], B]
    """Puts it into its kernel. Raises `Misuse` where it does not fit."""
    connect: Callable[[S, B, Site], None] | None = None
    """What is done when all elements of this kind are built: they may refer to each other."""
    signals: Callable[[B], Mapping[str, SignalOf]] | None = None
    """What conditions may speak of, by name. An element with a ``name`` has signals; none but those have."""
    lanes: Callable[[S], tuple[str, ...]]
    """Subjects under which it records edges of its own in traces."""
    faults: tuple[FaultKind, ...] = ()
    """What can fail of it (`Layer.ELEMENT`); they are given what was built."""

    def named(self, specs: Sequence[ElementSpec]) -> Sequence[NamedSpec]:
        """The same with their names; none where the kind has none."""
        return cast("Sequence[NamedSpec]", specs) if self.is_named else ()

    @property
    def is_named(self) -> bool:
        return any(key.name == "name" for key in self.rows.keys)

    def __post_init__(self) -> None:
        where = f"element {self.name}"
        attributes = {*self.rows.attributes, *(self.inner_attributes.get(key, key) for key in self.inner), "path"}
        having = {one.name for one in fields(self.spec)}
        if lacking := sorted(attributes - having):
            raise IncompleteTable(f"{where}: {self.spec.__name__} lacks {', '.join(lacking)}")
        if left_over := sorted(having - attributes):
            raise IncompleteTable(f"{where}: no key becomes {', '.join(left_over)} of {self.spec.__name__}")
        if self.is_named and self.signals is None:
            raise IncompleteTable(f"{where} has a name and lacks its signals")
        if not self.is_named and self.signals is not None:
            raise IncompleteTable(f"{where} has signals and lacks a name that they could be asked for by")
        for fault in self.faults:
            if fault.layer is not Layer.ELEMENT or not self.is_named:
                raise IncompleteTable(f"{where}: fault {fault.name} is of the layer {Layer.ELEMENT}, and its element has a name")


AnyElement: TypeAlias = Element[Any, Any]
