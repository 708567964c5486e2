"""The description of a world as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from steptwin.machine import Nanos
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.describe.arrangement import DrawnPlace
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.faults import Fault
from steptwin.simulation.kinds.kind import ControllerSpec, LineSpec
from steptwin.simulation.script.steps import Step
from steptwin.simulation.toml.reader import Path, TomlText


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
    """A world as its file describes it. ``text`` is the file, which also keeps the tables of services beside the world
    (`steptwin.simulation.describe.servicetables`)."""

    name: str
    seed: int
    state: str | None
    """Directory of the non-volatile memories."""
    trace: str | None
    """Trace of a live run: a file, ``ring N``, ``off``."""
    lines: tuple[LineSpec, ...]
    controllers: tuple[ControllerSpec, ...]
    elements: ElementSpecs
    scripts: tuple[ScriptSpec, ...]
    drawing: tuple[DrawnPlace, ...]
    faults: tuple[Fault | None, ...]
    """None for one with errors, which are in ``text``."""
    text: TomlText
    overrides: Overrides
    """Values that replace those of the text."""
    pieces: Mapping[str, Path]
    """Files of tables that it uses, and the keys that name them first."""

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
