"""The digital shadow of a device: a twin that gets the same commands and inputs, and is compared with it.

Pure: moments are arguments. The twin goes on in a world of its own, whose time begins with the shadow.

Of commands only beginning and end are known, and a poll takes a while, so positions of a moving axis are compared with a
tolerance: the distance that it can go meanwhile. Where an axis comes to rest after a stop or a dead-man jog depends on the moment
of its end, so it is not compared until then, and the twin takes that place over.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isclose
from typing import Annotated, NamedTuple, TypeAlias

from steptwin.controller import SECOND, Nanos
from steptwin.datasheet import AxisDescription, Datasheet, PinDirection
from steptwin.errors import SteptwinError
from steptwin.jsonvalues import NUMBER, JsonForm, Moment, or_null
from steptwin.simulation.describe.blueprint import Blueprint
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.script import steps
from steptwin.simulation.world.simulation import Simulation
from steptwin.subject import commands as command
from steptwin.subject.commands import Command, type_of
from steptwin.subject.devicetwin import DeviceTwin
from steptwin.subject.world import WorldSubject

MOST_SAMPLES = 3000
MOST_PROBLEMS = 20
PULSES = 2.0
"""Tolerance of an axis at rest."""
LEAST_LAG_NS: Nanos = SECOND // 100
"""By which a command or a poll is uncertain at least."""
MIRRORED = (
    *(command.Enable, command.Move, command.Home, command.StopAxes, command.StopAll, command.ControlProgram),
    *(steps.Write, steps.Request),
)
OF_AXES = (command.Enable, command.Move, command.Home, command.StopAxes)
Known = Mapping[str, float | None]
"""Values of a device by point."""


class AxisSample(NamedTuple):
    """Position of the device and of the twin, and by how much they may differ; None: unknown, or not compared."""

    device: float
    twin: float
    tolerance: float | None


class Deviation(NamedTuple):
    """Since when a value is another one."""

    at_ns: Annotated[Moment, "Since when, from the beginning of the digital shadow, as decimal text [ns]"]
    what: Annotated[str, "An axis or a register."]
    device: float
    twin: float


_Sample: TypeAlias = Annotated[
    tuple[float | None, ...],
    JsonForm(
        {
            "type": "array",
            "items": or_null(NUMBER),
            "minItems": 4,
            "maxItems": 4,
            "description": "Time from the beginning [s], position of the device, of the twin, tolerance; null: not compared.",
        },
        tuple,
        list,
    ),
]


class ShadowAxis(NamedTuple):
    """Differences of an axis of a device from that of its digital shadow."""

    axis: int
    name: str
    unit: str
    first: Deviation | None
    samples: tuple[_Sample, ...]


class ShadowState(NamedTuple):
    """Differences of a device from its digital shadow."""

    controller: str
    axes: tuple[ShadowAxis, ...]
    registers: Annotated[tuple[Deviation, ...], "Those that differ now."]
    compared: Annotated[int, "Registers that are compared at rest."]
    first: Annotated[Deviation | None, "The first difference of all."]
    problems: Annotated[tuple[str, ...], "Commands that the twin refused."]


@dataclass(slots=True)
class _ComparedAxis:
    sheet: AxisDescription
    lag_ns: Nanos = LEAST_LAG_NS
    """By how much its last command was uncertain."""
    is_jogged: bool = False
    takes_over: bool = False
    """Whether the twin has to be put where the device has come to rest."""
    samples: deque[tuple[Nanos, AxisSample]] = field(default_factory=lambda: deque(maxlen=MOST_SAMPLES))
    first: Deviation | None = None


class DigitalShadow:
    """Digital shadow of the controller ``name``, from the moment ``now`` on. Raises `SteptwinError` where its twin cannot be
    made."""

    def __init__(self, name: str, sheet: Datasheet, twin: DeviceTwin, now: Nanos) -> None:
        self.name = name
        self.begin = now
        self._twin = twin
        self._world = Simulation(Blueprint(read_world("twin", twin.text), twin.files), keep_trace=False, keep_inputs=False)
        self._world.stop_recording()
        self._subject = WorldSubject(self._world)
        self._axes = {axis.number: _ComparedAxis(axis) for axis in sheet.axes}
        self._inputs = tuple(pin.name for pin in sheet.pins if pin.direction is PinDirection.INPUT)
        self._registers: dict[str, Deviation] = {}
        self.first: Deviation | None = None
        """The first difference of all."""
        self.problems: list[str] = []
        """Commands that the twin refused."""
        for register, value in twin.values:
            self._forward(steps.Write(((name, register, value),)))
        for number in twin.enabled:
            self._forward(command.Enable(name, number, on=True))

    @property
    def points(self) -> tuple[str, ...]:
        """Values to be read of the device for each sample."""
        axes = (f"{axis.sheet.name}.{what}" for axis in self._axes.values() for what in ("position", "velocity"))
        return tuple(f"{self.name}.{path}" for path in (*axes, *self._inputs))

    @property
    def registers(self) -> tuple[str, ...]:
        """Values to be read of the device for `compare_registers`."""
        return tuple(f"{self.name}.{register}" for register in self._twin.compared)

    # ------------------------------------------------------------------ the twin

    def _forward(self, wanted: Command) -> None:
        try:
            self._subject.do(wanted)
        except SteptwinError as error:
            text = f"{type_of(wanted).name}: {error}"
            if text not in self.problems and len(self.problems) < MOST_PROBLEMS:
                self.problems.append(text)

    def _to(self, now: Nanos) -> None:
        self._world.advance(max(now - self.begin, self._world.now))

    def _read(self, *points: str) -> list[float]:
        return [0.0 if one.value is None else float(one.value) for one in self._subject.read(*points)]

    # ------------------------------------------------------------------ what happens to the device

    def did(self, wanted: Command, begun: Nanos, ended: Nanos) -> None:
        """It has been given a command, which took so long."""
        if type(wanted) not in MIRRORED:
            return
        self._to(ended)
        number = wanted.axis if isinstance(wanted, OF_AXES) else None
        for axis in self._axes.values():
            if number in (None, axis.sheet.number):
                axis.lag_ns = max(ended - begun, LEAST_LAG_NS)
                axis.takes_over |= _stops(wanted)
        self._forward(replace(wanted, line=self._twin.line) if isinstance(wanted, steps.Request) else wanted)

    def jogs(self, number: int, *, on: bool) -> None:
        """A dead-man jog of an axis begins or has ended. The twin waits where it is."""
        axis = self._axes[number]
        axis.is_jogged, axis.takes_over = on, True

    # ------------------------------------------------------------------ comparison

    def compare(self, known: Known, begun: Nanos, ended: Nanos) -> bool:
        """With values of `points`, read between these moments. Whether all axes of both are at rest."""
        self._to(ended)
        for pin in self._inputs:
            level = known.get(f"{self.name}.{pin}")
            if level is not None and self._read(f"{self.name}.{pin}") != [level]:
                self._forward(steps.Set(((self.name, pin, level),)))
        resting = [self._compare_axis(axis, known, begun, ended) for axis in self._axes.values()]
        return all(resting)

    def _compare_axis(self, axis: _ComparedAxis, known: Known, begun: Nanos, ended: Nanos) -> bool:
        """Whether it is at rest."""
        head = f"{self.name}.{axis.sheet.name}"
        position, velocity = (known.get(f"{head}.{what}") for what in ("position", "velocity"))
        if position is None or velocity is None:
            return False
        twin, twin_velocity = self._read(f"{head}.position", f"{head}.velocity")
        is_at_rest = velocity == twin_velocity == 0.0
        if axis.takes_over and is_at_rest and not axis.is_jogged:
            twin = self._take_over(axis, position)
        tolerance: float | None = None
        if not axis.takes_over:
            tolerance = self._tolerance(axis, abs(velocity), abs(twin_velocity), ended - begun)
        sample = AxisSample(position, twin, tolerance)
        axis.samples.append((ended - self.begin, sample))
        if tolerance is not None and abs(position - twin) > tolerance and axis.first is None:
            axis.first = Deviation(ended - self.begin, axis.sheet.name, position, twin)
            self._note(axis.first)
        return is_at_rest and not axis.is_jogged

    def _tolerance(self, axis: _ComparedAxis, velocity: float, twin_velocity: float, poll_ns: Nanos) -> float:
        pulse = 1.0 / (axis.sheet.pulses_per_unit or 1.0)
        lag_s = (axis.lag_ns + poll_ns) / SECOND
        if velocity == twin_velocity == 0.0:
            return PULSES * pulse
        ramp = max(self._read(*(f"{self.name}.{axis.sheet.name}_{what}" for what in ("ACC", "DEC"))))
        return PULSES * pulse + (max(velocity, twin_velocity) + ramp * lag_s) * lag_s

    def _take_over(self, axis: _ComparedAxis, position: float) -> float:
        """The place of the device at rest after a stop or a jog."""
        axis.takes_over = False
        self._forward(steps.Write(((self.name, f"{axis.sheet.name}_POS_ACT", position),)))
        return self._read(f"{self.name}.{axis.sheet.name}.position")[0]

    def compare_registers(self, known: Known, ended: Nanos) -> None:
        """With values of `registers`, read at rest."""
        self._to(ended)
        for point, twin in zip(self.registers, self._read(*self.registers), strict=True):
            device = known.get(point)
            name = point.partition(".")[2]
            if device is None or isclose(device, twin, rel_tol=1e-6, abs_tol=1e-9):
                self._registers.pop(name, None)
            else:
                before = self._registers.get(name)
                found = Deviation(ended - self.begin if before is None else before.at_ns, name, device, twin)
                self._registers[name] = found
                self._note(found)

    def _note(self, found: Deviation) -> None:
        if self.first is None:
            self.first = found

    def state(self, after: Nanos) -> ShadowState:
        """With samples later than ``after``, from the beginning of the digital shadow."""
        axes = tuple([_state(axis, after) for axis in self._axes.values()])
        registers, compared = tuple(self._registers.values()), len(self._twin.compared)
        return ShadowState(self.name, axes, registers, compared, self.first, tuple(self.problems))


def _stops(wanted: Command) -> bool:
    if isinstance(wanted, command.ControlProgram):
        return wanted.action != "start"
    return isinstance(wanted, command.StopAxes | command.StopAll)


def _state(axis: _ComparedAxis, after: Nanos) -> ShadowAxis:
    samples = tuple([(at / SECOND, *sample) for at, sample in axis.samples if at > after])
    return ShadowAxis(axis.sheet.number, axis.sheet.name, axis.sheet.unit, axis.first, samples)
