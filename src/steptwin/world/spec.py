"""The description of a world as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar, cast

from steptwin.machine import Nanos
from steptwin.world.faults import Fault
from steptwin.world.links import TlsFiles
from steptwin.world.overrides import Overrides
from steptwin.world.reader import Path, TomlText
from steptwin.world.script import Step

if TYPE_CHECKING:
    from steptwin.world.arrangement import DrawnPlace
    from steptwin.world.element import Element, ElementSpec
    from steptwin.world.gateways import GatewaySpec
    from steptwin.world.historytable import HistorySpec
    from steptwin.world.kind import AnyKind

S = TypeVar("S", bound="ElementSpec")


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpec:
    name: str
    kind: str
    baud: int | None
    timing: str
    gap: Nanos | None
    links: Mapping[str, str]
    """Addresses of its external links, by key."""
    tls: TlsFiles | None = None
    """Of encrypted ones, relative to the description."""
    path: Path = ()

    @property
    def is_open(self) -> bool:
        """Whether it has external links."""
        return bool(self.links)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerSpec:
    """The common part of all controllers' tables; each kind adds its own."""

    kind: AnyKind
    name: str
    line: str | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ScriptSpec:
    """An event or a script: its start and its steps."""

    name: str
    at: Nanos | None
    every: Nanos | None
    when: str | None
    once: bool
    repeat: int
    steps: tuple[Step, ...]
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSpec:
    """A world as its file describes it. ``text`` is the file."""

    name: str
    seed: int
    state: str | None
    """Directory of the non-volatile memories."""
    trace: str | None
    """Trace of a live run: a file, ``ring N``, ``off``."""
    lines: tuple[LineSpec, ...]
    controllers: tuple[ControllerSpec, ...]
    elements: Mapping[str, tuple[ElementSpec, ...]]
    """The elements by the names of their tables."""
    scripts: tuple[ScriptSpec, ...]
    gateways: tuple[GatewaySpec, ...]
    history: HistorySpec | None
    drawing: tuple[DrawnPlace, ...]
    faults: tuple[Fault | None, ...]
    """None for one with errors, which are in ``text``."""
    text: TomlText
    overrides: Overrides
    """Values that replace those of the text."""
    pieces: Mapping[str, Path]
    """Files of tables that it uses, and the keys that name them first."""

    def elements_of(self, element: Element[S, Any]) -> tuple[S, ...]:
        """The tables of a kind of element."""
        return cast("tuple[S, ...]", self.elements[element.name])

    def vision_addresses(self) -> Iterator[tuple[str, str]]:
        """Controllers with an input for records of a vision system, and its address."""
        for spec in self.controllers:
            address = None if spec.kind.vision is None else spec.kind.vision.address(spec)
            if address is not None:
                yield spec.name, address

    def files(self) -> Iterator[tuple[str, Path]]:
        """Names of the files the description refers to, and the keys that do."""
        yield from self.pieces.items()
        for spec in self.controllers:
            for name, key in spec.kind.files(spec):
                yield name, (*spec.path, key)
