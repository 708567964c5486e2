"""The description of a world as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from steptwin.machine import Nanos
from steptwin.world.faults import Fault
from steptwin.world.overrides import Overrides
from steptwin.world.reader import Path, TomlText
from steptwin.world.script import Step

if TYPE_CHECKING:
    from steptwin.world.kind import AnyKind


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpec:
    name: str
    kind: str
    baud: int | None
    timing: str
    gap: Nanos | None
    links: Mapping[str, str]
    """What opens it for programs outside, by key."""
    path: Path = ()

    @property
    def is_open(self) -> bool:
        """Whether programs outside can talk on it."""
        return bool(self.links)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerSpec:
    """What the table of any controller has; each kind has more."""

    kind: AnyKind
    name: str
    line: str | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchSpec:
    """On at and below ``below``, at and above ``above``, or around ``position`` over ``width``, again after each ``period``.

    Units of the axis.
    """

    target: tuple[str, str]
    below: float | None
    above: float | None
    position: float | None
    width: float
    period: float | None
    hysteresis: float
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderSpec:
    counts_per_rev: int | None
    counts_per_unit: float | None
    index: bool
    offset: float
    index_width: int
    mount: str
    follows: str | None
    slip: float
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorSpec:
    """Torques in N·m at the motor, speeds in rev/min; for linear axes mass in kg and forces in N as well."""

    torque: tuple[tuple[float, float], ...]
    inertia: float
    mass: float
    friction: float
    friction_force: float
    load: float
    force: float
    start_speed: float | None
    full_steps: int | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSpec:
    name: str
    drive: tuple[str, str]
    kind: str
    unit: str | None
    pulses_per_unit: float | None
    pitch: float | None
    pulses_per_rev: int | None
    inverted: bool
    travel: tuple[float, float] | None
    start: float
    backlash: float
    switches: tuple[SwitchSpec, ...]
    encoder: EncoderSpec | None
    motor: MotorSpec | None
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class WireSpec:
    source: tuple[str, str]
    target: tuple[str, str]
    inverted: bool
    delay: Nanos
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ButtonSpec:
    name: str
    target: tuple[str, str]
    contact: str
    join: str | None
    bounce: Nanos
    bounces: int
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSpec:
    target: tuple[str, str]
    kind: str
    value: float
    amplitude: float
    frequency: float
    phase: float
    points: tuple[tuple[float, float], ...]
    begin: float
    end: float
    ramp_time: Nanos
    repeat: Nanos | None
    period: Nanos
    path: Path = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ScriptSpec:
    """An event or a script: when it begins, what it does."""

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
    """How much is kept of what happens in real time: a file, ``ring N``, ``off``."""
    lines: tuple[LineSpec, ...]
    controllers: tuple[ControllerSpec, ...]
    axes: tuple[AxisSpec, ...]
    wires: tuple[WireSpec, ...]
    buttons: tuple[ButtonSpec, ...]
    sources: tuple[SourceSpec, ...]
    scripts: tuple[ScriptSpec, ...]
    faults: tuple[Fault | None, ...]
    """None for one with errors, which ``text`` has."""
    text: TomlText
    overrides: Overrides
    """Values that replace those of the text."""

    def vision_addresses(self) -> Iterator[tuple[str, str]]:
        """Controllers that take records of a vision system, and where."""
        for spec in self.controllers:
            address = None if spec.kind.vision is None else spec.kind.vision.address(spec)
            if address is not None:
                yield spec.name, address

    def files(self) -> Iterator[tuple[str, Path]]:
        """Names of the files the description refers to, and the keys that do."""
        for spec in self.controllers:
            for name, key in spec.kind.files(spec):
                yield name, (*spec.path, key)
