"""``[[transducer]]``: an analog sensor, whose voltage at an analog input follows a signal of the world by a table."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import floor, isnan
from typing import ClassVar

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.state import Stateful
from steptwin.world.condition import Signal, crossing
from steptwin.world.element import Element, NamedSpec, Reference, Row, Table
from steptwin.world.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.world.faults.table import ElementEffect, number
from steptwin.world.kernel import Kernel, PinName, Source
from steptwin.world.reader import Key, TomlText, optional
from steptwin.world.sense import TableRows
from steptwin.world.signals import SignalOf, find_signal
from steptwin.world.site import Site, Terminal
from steptwin.world.sources import HIGHEST_V, LOWEST_V
from steptwin.world.spec import WorldSpec
from steptwin.world.values import ANALOG_INPUT, MOST, PinOf, name_value, points, text_value
from steptwin.world.values import number as number_value


@dataclass(frozen=True, slots=True, kw_only=True)
class TransducerSpec(NamedSpec):
    of: str
    target: Terminal
    points: tuple[tuple[float, float], ...]
    resolution: float


class Curve:
    """Volts over values: ``points``, interpolated linearly, constant before the first and after the last, in steps.

    Computed in fractions: a value at which the level changes, and the level there, fit together whatever is rounded.
    """

    __slots__ = ("_points", "step")

    def __init__(self, points: Iterable[tuple[float, float]], step: float) -> None:
        self._points = tuple((Fraction(str(value)), Fraction(str(volts))) for value, volts in points)
        self.step = Fraction(str(step))

    def level(self, value: float) -> int:
        """The nearest whole number of steps."""
        return floor(self._volts(Fraction(value)) / self.step + Fraction(1, 2))

    def _volts(self, value: Fraction) -> Fraction:
        i = bisect_right(self._points, value, key=lambda point: point[0])
        if i == 0:
            return self._points[0][1]
        if i == len(self._points):
            return self._points[-1][1]
        (x0, v0), (x1, v1) = self._points[i - 1], self._points[i]
        return v0 + (v1 - v0) * (value - x0) / (x1 - x0)

    def ends(self, value: float) -> list[Fraction]:
        """The values next to this one, below, above or here, beyond which the level may be another."""
        level = self.level(value)
        bounds = [(level + side) * self.step for side in (Fraction(-1, 2), Fraction(1, 2))]
        found = [
            x0 + (bound - v0) * (x1 - x0) / (v1 - v0)
            for (x0, v0), (x1, v1) in pairwise(self._points)
            for bound in bounds
            if v0 != v1 and min(v0, v1) <= bound <= max(v0, v1)
        ]
        below, above = [at for at in found if at <= value], [at for at in found if at >= value]
        return [*([max(below)] if below else []), *([min(above)] if above else [])]


class Transducer(Stateful):
    """Drives an analog input. It is due whenever its signal comes to a value at which the voltage is another one."""

    __slots__ = ("_curve", "_due", "_kernel", "_level", "_signal", "_spec", "_version", "is_broken", "offset")
    FIXED: ClassVar[frozenset[str]] = frozenset({"_curve", "_kernel", "_signal", "_spec", "_version"})

    def __init__(self, kernel: Kernel, spec: TransducerSpec, signal: Signal) -> None:
        self._kernel = kernel
        self._spec = spec
        self._signal = signal
        self._curve = Curve(spec.points, spec.resolution)
        self._due: Nanos | None = None
        self._version: object = None
        self._level = 0
        self.is_broken = False
        """Fault: its wire is broken."""
        self.offset = 0.0
        """Fault: volts by which it reads too high."""

    @property
    def name(self) -> str:
        return self._spec.name

    @property
    def source(self) -> Source:
        return self._kernel.source(self.name)

    def volts(self, now: Nanos) -> float:
        """The voltage that it gives."""
        if self.is_broken:
            return LOWEST_V
        return min(max(float(self._level * self._curve.step) + self.offset, LOWEST_V), HIGHEST_V)

    def update(self, now: Nanos) -> None:
        version = self._signal.version()
        if version is None or version != self._version or (self._due is not None and self._due <= now):
            self._version = version
            value = self._signal.value(now)
            self._due = None
            if not isnan(value):  # it stays where it is: a register can have a value that is no number
                value = min(max(value, -MOST), MOST)
                self._level = self._curve.level(value)
                self._due = self._next(value, now)
        self._kernel.drive(PinName(*self._spec.target), self.volts(now))

    def _next(self, value: float, now: Nanos) -> Nanos | None:
        if not self._signal.continuous:
            return None
        dues = (crossing(self._signal, end, now) for end in self._curve.ends(value))
        return min((due for due in dues if due is not None), default=None)

    def deadline(self) -> Nanos | None:
        return self._due


def _break(active: ActiveFault, transducer: Transducer, begins: bool, now: Nanos) -> str:
    transducer.is_broken = begins
    return f"the wire of {transducer.name} is {'broken' if begins else 'whole again'}"


def _drift(active: ActiveFault, transducer: Transducer, begins: bool, now: Nanos) -> str:
    transducer.offset = active.fault.number("volts") if begins else 0.0
    return f"{transducer.name} reads {transducer.offset:+g} V" if begins else f"{transducer.name} reads right again"


def _read(text: TomlText, row: Row, table: Table) -> TransducerSpec:
    spec = TransducerSpec(**row)
    volts = [volts for _, volts in spec.points]
    if not all(LOWEST_V <= one <= HIGHEST_V for one in volts):
        there = f"{min(volts):g} to {max(volts):g} V"
        message = f"{there}: an analog input takes {LOWEST_V:g} to {HIGHEST_V:g} V"
        text.wrong((*spec.path, "points"), "D007", message)
    return spec


def _refers(spec: TransducerSpec, world: WorldSpec) -> Iterator[Reference]:
    yield Reference(spec.target[0], spec.target[0], (*spec.path, "to"))
    yield Reference(spec.target[0], spec.of.partition(".")[0], (*spec.path, "of"))


def _build(spec: TransducerSpec, site: Site) -> Transducer:
    kernel = site.kernel(spec.target[0])
    site.input(spec.target, (*spec.path, "to"), ANALOG_INPUT)
    found = find_signal(site.parts, spec.of)
    found.watch(spec.of)
    if all(source.kernel is not kernel for source in found.bring(kernel.now)):
        raise Misuse(f"of = {spec.of!r} is no quantity of what {spec.target[0]!r} is joined to")
    transducer = Transducer(kernel, spec, found)
    kernel.add_part(transducer, name=spec.name)
    return transducer


TRANSDUCER: Element[TransducerSpec, Transducer] = Element(
    name="transducer",
    spec=TransducerSpec,
    rows=TableRows(
        written="[[transducer]]",
        keys=(
            Key("name", name_value, "how conditions and faults name it"),
            Key("of", text_value, "the signal that it measures, such as x.position, clamp.position, cup.pressure"),
            Key("to", PinOf(ANALOG_INPUT), "the analog input: MACHINE.AIN1 or AIN2", attribute="target"),
            Key("points", points, "[[value, volts], ...] in the unit of the signal, linear between"),
            optional(number_value(0.0001, 10.0), "resolution", "steps in which the voltage changes", 0.01),
        ),
    ),
    read=_read,
    refers=_refers,
    build=_build,
    signals=lambda built: {"volts": SignalOf((built.source,), built.volts, unit="V", bounds=(LOWEST_V, HIGHEST_V))},
    lanes=lambda spec: (),
    faults=(
        FaultKind(
            "broken-wire",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The wire of an analog sensor is broken: 0 V.",
            effect=ElementEffect(_break),
        ),
        FaultKind(
            "drift",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "An analog sensor reads too high or too low.",
            own=(number("volts", "Too high; negative: too low.", -10.0, 10.0, default=0.5),),
            effect=ElementEffect(_drift),
        ),
    ),
)
