"""The description of a world as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from steptwin.controller import Nanos
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.describe.arrangement import DrawnPosition
from steptwin.simulation.describe.overrides import Overrides
from steptwin.simulation.describe.steptable import STEPS
from steptwin.simulation.faults import Fault
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.script.steps import Step
from steptwin.simulation.toml.reader import Path, TomlText
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import flag, name_value, positive_time, text_value, time_value, whole

SEED = whole(0, 2**63 - 1)


@table("[[script]]")
class ScriptSpec(TableSpec):
    """A script or an event: its start and its steps."""

    name: str = key(name_value, "for the trace")
    at: Nanos | None = key(time_value, "when it begins", default=0)
    repeat: int = key(whole(1, 10**9), "how often all of it is done", default=1)
    steps: tuple[Step, ...] = key(STEPS.read, STEPS.meaning, order=1)
    every: Nanos | None = None
    when: str | None = None
    once: bool = True


@table("[[event]]")
class EventSpec(ScriptSpec):
    name: str = key(name_value, "for the trace", default="")
    at: Nanos | None = key(time_value, "when", default=None)
    every: Nanos | None = key(positive_time, "again and again", default=None)
    when: str | None = key(text_value, "a condition, such as 'x.position > 100'", default=None)
    once: bool = key(flag, "when: only the first time the condition comes true", default=False, needs="when")
    repeat: int = 1

    def check(self, text: TomlText) -> None:
        if sum(text.is_given((*self.path, name)) for name in ("at", "every", "when")) != 1:
            text.wrong(self.path, "D007", "an event needs one of at, every and when")


@table("[world]")
class WorldTable(TableSpec):
    """Name of a world, and what it keeps."""

    name: str = key(text_value, "a name for people", default="world")
    seed: int = key(SEED, "where all chance comes from", default=0)
    trace: str = key(
        text_value, "what 'up' keeps of what happens: a FILE that grows, 'ring N' (records), or 'off'", default="off"
    )
    state: str | None = key(
        text_value, "directory that keeps non-volatile memory; without it, memory ends with the world", default=None
    )


@dataclass(frozen=True, kw_only=True)
class WorldSpec(WorldTable):
    """A world as its file describes it. ``text`` is the file, which also keeps the tables of services beside the world
    (`steptwin.simulation.describe.servicetables`)."""

    lines: tuple[LineSpec, ...]
    controllers: tuple[ControllerSpec, ...]
    elements: ElementSpecs
    scripts: tuple[ScriptSpec, ...]
    drawing: tuple[DrawnPosition, ...]
    faults: tuple[Fault | None, ...]
    """None for one with errors, which are in ``text``."""
    text: TomlText
    overrides: Overrides
    """Values that replace those of the text."""
    includes: Mapping[str, Path]
    """Files of tables that it uses, and the keys that name them first."""

    def vision_addresses(self) -> Iterator[tuple[str, str]]:
        """Controllers with an input for records of a vision system, and its address."""
        for spec in self.controllers:
            address = None if spec.kind.vision is None else spec.kind.vision.address(spec)
            if address is not None:
                yield spec.name, address

    def files(self) -> Iterator[tuple[str, Path]]:
        """Names of the files the description refers to, and the keys that do."""
        yield from self.includes.items()
        for spec in self.controllers:
            for name, at in spec.kind.files(spec):
                yield name, (*spec.path, at)
