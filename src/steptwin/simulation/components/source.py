"""``[[source]]``: a voltage at an analog input, as `steptwin.simulation.logic.sources` computes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, SECOND, Nanos
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.site import Site
from steptwin.simulation.components.voltage import BROKEN_WIRE, DRIFT
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.logic.sources import (
    HIGHEST_V,
    LOWEST_V,
    AnalogSource,
    ConstantWaveform,
    SineWaveform,
    TableWaveform,
    Waveform,
)
from steptwin.simulation.toml.reader import Key, Row, Table, TomlText, optional
from steptwin.simulation.toml.sense import TableRows
from steptwin.simulation.toml.values import (
    ANALOG_INPUT,
    PinOf,
    Terminal,
    name_value,
    number,
    points,
    positive_time,
    time_value,
    word,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSpec(NamedSpec):
    target: Terminal
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


def _repeat_s(spec: SourceSpec) -> float | None:
    return None if spec.repeat is None else spec.repeat / SECOND


def _ramp(spec: SourceSpec) -> Waveform:
    if spec.ramp_time <= 0:
        raise Misuse("a ramp needs 'over': how long it takes")
    return TableWaveform(((0.0, spec.begin), (spec.ramp_time / SECOND, spec.end)), _repeat_s(spec))


def _table(spec: SourceSpec) -> Waveform:
    if not spec.points:
        raise Misuse("a table needs points")
    return TableWaveform(spec.points, _repeat_s(spec))


WAVEFORMS: Mapping[str, Callable[[SourceSpec], Waveform]] = {
    "constant": lambda spec: ConstantWaveform(spec.value),
    "ramp": _ramp,
    "sine": lambda spec: SineWaveform(spec.value, spec.amplitude, spec.frequency, spec.phase),
    "table": _table,
}
"""By ``kind``. They raise `Misuse` for values that are missing."""


def _read(text: TomlText, row: Row, table: Table) -> SourceSpec:
    return SourceSpec(**row)


def _refers(spec: SourceSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.target[0], spec.target[0], (*spec.path, "to"))


def _build(spec: SourceSpec, site: Site) -> AnalogSource:
    kernel = site.kernel(spec.target[0])
    target = site.input(spec.target, spec.path, ANALOG_INPUT)
    source = AnalogSource(kernel, target, WAVEFORMS[spec.kind](spec), spec.period, spec.name)
    kernel.add_part(source, (), spec.name or None)
    return source


SOURCE: Element[SourceSpec, AnalogSource] = Element(
    name="source",
    spec=SourceSpec,
    rows=TableRows(
        written="[[source]]",
        keys=(
            optional(name_value, "name", "how conditions and faults name it; without it they cannot", ""),
            Key("to", PinOf(ANALOG_INPUT), "the analog input: MACHINE.AIN1 or AIN2", attribute="target"),
            optional(word(*WAVEFORMS), "kind", "constant, ramp, sine or table", "constant"),
            optional(number(), "value", "volts; of a sine its mean", 0.0),
            optional(number(), "amplitude", "sine: volts", 0.0),
            optional(number(0.0), "frequency", "sine: Hz", 1.0),
            optional(number(), "phase", "sine: degrees", 0.0),
            optional(points, "points", "table: [[seconds, volts], ...]", ()),
            optional(number(), "begin", "ramp: volts at first", 0.0),
            optional(number(), "end", "ramp: volts in the end", 0.0),
            optional(time_value, "over", "ramp: how long it takes", 0, "ramp_time"),
            optional(positive_time, "repeat", "ramp, table: begins anew after this time"),
            optional(positive_time, "period", "how often the voltage is renewed", 10 * MILLISECOND),
        ),
        only={
            "value": ("constant", "sine"),
            "amplitude": ("sine",),
            "frequency": ("sine",),
            "phase": ("sine",),
            "points": ("table",),
            "begin": ("ramp",),
            "end": ("ramp",),
            "over": ("ramp",),
            "repeat": ("ramp", "table"),
            "period": ("ramp", "sine", "table"),
        },
    ),
    read=_read,
    refers=_refers,
    build=_build,
    signals=lambda built: {"volts": SignalOf((built.source,), built.volts, unit="V", bounds=(LOWEST_V, HIGHEST_V))},
    faults=(BROKEN_WIRE, DRIFT),
)
