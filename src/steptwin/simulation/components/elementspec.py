"""The tables of elements as values, and what they refer to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar, cast

from steptwin.simulation.components.mount import MountSpec, places
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.table import TableSpec, table


@table()
class NamedSpec(TableSpec):
    """The specification of an element with a name, which may be empty where its key is optional."""

    name: str

    @property
    def turns_encoders(self) -> bool:
        """Whether encoders of axes may follow it, though it is no axis."""
        return False


S = TypeVar("S", bound=TableSpec)
B = TypeVar("B")


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementTable(Generic[S, B]):
    """The table of a kind of element. ``S`` is a table as a value, ``B`` the object that is built of it."""

    spec: type[S]
    name: str = field(init=False)
    """Its header: ``[[NAME]]``."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.spec.rows.written.strip("[]"))


class ElementSpecs(dict[str, tuple[TableSpec, ...]]):
    """The elements of a description by the names of their tables."""

    def of(self, element: ElementTable[S, Any]) -> tuple[S, ...]:
        """Those of one kind."""
        return cast("tuple[S, ...]", self[element.name])

    @property
    def holders(self) -> list[str]:
        """Those in space that workpieces may be on, or in."""
        placed = places(self.mounts)
        return [name for name, its in self.mounts.items() if name in placed and its.holds_workpieces]

    def carried_by(self, name: str) -> list[str]:
        """Itself, and all that it carries, directly or through others."""
        mounts, found = self.mounts, [name]
        for one in found:
            found += (other for other, its in mounts.items() if its.on == one and other not in found)
        return found

    def carriers(self, name: str) -> list[str]:
        """All that carry it, directly or through others."""
        mounts, found = self.mounts, list[str]()
        while name in mounts and (on := mounts[name].on) is not None and on not in found:
            found.append(on)
            name = on
        return found

    @property
    def mounts(self) -> dict[str, MountSpec]:
        """Those that may have a place in space, by name."""
        every = (one for specs in self.values() for one in specs)
        return {one.name: one for one in every if isinstance(one, MountSpec) and isinstance(one, NamedSpec) and one.name}


class Reference(NamedTuple):
    """Two controllers, lines or elements with terminals that an element connects, so that they share a scheduler. ``path``: the
    key that names ``other``; what names ``one`` is its own table, or another reference, in which both are the same."""

    one: str
    other: str
    path: Path
