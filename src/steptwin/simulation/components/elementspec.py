"""The tables of elements as values, and what they refer to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar, cast

from steptwin.simulation.toml.tomlplaces import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSpec:
    """An element as its table describes it. ``path``: the place of the table in the text."""

    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedSpec(ElementSpec):
    """The specification of an element with a name, which may be empty where its key is optional."""

    name: str


S = TypeVar("S", bound=ElementSpec)
B = TypeVar("B")


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementTable(Generic[S, B]):
    """The table of a kind of element. ``S`` is a table as a value, ``B`` the object that is built of it."""

    name: str
    """How it is written: ``[[NAME]]``."""


class ElementSpecs(dict[str, tuple[ElementSpec, ...]]):
    """The elements of a description by the names of their tables."""

    def of(self, element: ElementTable[S, Any]) -> tuple[S, ...]:
        """Those of one kind."""
        return cast("tuple[S, ...]", self[element.name])


class Reference(NamedTuple):
    """Two machines, lines or elements with terminals that an element connects, so that they share a kernel. ``path``: the key
    that names ``other``; what names ``one`` is its own table, or another reference, in which both are the same."""

    one: str
    other: str
    path: Path
