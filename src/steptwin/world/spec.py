"""What a description of a world says, as values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from steptwin.machine import Nanos
from steptwin.world.faults import Fault
from steptwin.world.overrides import Overrides
from steptwin.world.reader import Path, Text
from steptwin.world.script import Step


@dataclass(frozen=True, slots=True, kw_only=True)
class LineSpec:
    name: str
    kind: str
    baud: int | None
    timing: str
    tcp: str | None
    rtu_tcp: str | None
    rfc2217: str | None
    gap: Nanos | None
    pty: str | None
    serial: str | None
    path: Path = ()

    @property
    def is_open(self) -> bool:
        """Whether programs outside can talk on it."""
        return any((self.tcp, self.rtu_tcp, self.rfc2217, self.pty, self.serial))


Banks: TypeAlias = tuple[tuple[int, str], ...]
"""Numbers of banks and the files that are for them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mic488Spec:
    name: str
    line: str | None
    unit: int | None
    firmware: str
    config: str | None
    program: str | None
    programs: Banks
    positions: Banks
    start: bool
    statement_time: Nanos | None
    lenient: bool
    vision: str | None
    trigger_keeps: bool | None
    axes: Mapping[int, Mapping[str, Any]]
    """Changed attributes of `AxisConfig`, by axis from 1."""
    inputs: Mapping[int, Mapping[str, Any]]
    path: Path = ()

    @property
    def all_programs(self) -> Banks:
        """``programs``, and ``program`` in bank 0."""
        return self.programs if self.program is None else ((0, self.program), *self.programs)


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Spec:
    name: str
    line: str | None
    variant: str
    address: int
    interface: str
    baud: int | None
    statement_time: Nanos | None
    program: str | None
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
    lines: tuple[LineSpec, ...]
    mic488: tuple[Mic488Spec, ...]
    m1486: tuple[M1486Spec, ...]
    axes: tuple[AxisSpec, ...]
    wires: tuple[WireSpec, ...]
    buttons: tuple[ButtonSpec, ...]
    sources: tuple[SourceSpec, ...]
    scripts: tuple[ScriptSpec, ...]
    faults: tuple[Fault | None, ...]
    """None for one that is wrong, as ``text`` says."""
    text: Text
    overrides: Overrides
    """Values that replace those of the text."""

    def files(self) -> Iterator[tuple[str, Path]]:
        """Names of the files the description refers to, and the keys that do."""
        for spec in self.mic488:
            for key in ("config", "program"):
                name = getattr(spec, key)
                if name is not None:
                    yield name, (*spec.path, key)
            for key in ("programs", "positions"):
                for _, name in getattr(spec, key):
                    yield name, (*spec.path, key)
        for chip in self.m1486:
            if chip.program is not None:
                yield chip.program, (*chip.path, "program")
