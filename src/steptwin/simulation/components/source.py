"""``[[source]]``: a voltage at an analog input, as `steptwin.simulation.logic.sources` computes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
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
from steptwin.simulation.toml.table import key, table
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


@table("[[source]]")
class SourceSpec(NamedSpec):
    name: str = key(name_value, "how conditions and faults name it; without it they cannot", default="")
    target: Terminal = key(PinOf(ANALOG_INPUT), "the analog input: CONTROLLER.AIN1 or AIN2", name="to")
    kind: str = key(word(*WAVEFORMS), "constant, ramp, sine or table", default="constant")
    value: float = key(number(), "volts; of a sine its mean", default=0.0, kinds=("constant", "sine"))
    amplitude: float = key(number(), "sine: volts", default=0.0, kinds=("sine",))
    frequency: float = key(number(0.0), "sine: Hz", default=1.0, kinds=("sine",))
    phase: float = key(number(), "sine: degrees", default=0.0, kinds=("sine",))
    points: tuple[tuple[float, float], ...] = key(points, "table: [[seconds, volts], ...]", default=(), kinds=("table",))
    begin: float = key(number(), "ramp: volts at first", default=0.0, kinds=("ramp",))
    end: float = key(number(), "ramp: volts in the end", default=0.0, kinds=("ramp",))
    ramp_time: Nanos = key(time_value, "ramp: how long it takes", default=0, name="over", kinds=("ramp",))
    repeat: Nanos | None = key(positive_time, "ramp, table: begins anew after this time", default=None, kinds=("ramp", "table"))
    period: Nanos = key(
        positive_time, "how often the voltage is renewed", default=10 * MILLISECOND, kinds=("ramp", "sine", "table")
    )


def _refers(spec: SourceSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.target[0], spec.target[0], (*spec.path, "to"))


def _build(spec: SourceSpec, context: ElementContext) -> AnalogSource:
    scheduler = context.scheduler(spec.target[0])
    target = context.input(spec.target, spec.path, ANALOG_INPUT)
    source = AnalogSource(scheduler, target, WAVEFORMS[spec.kind](spec), spec.period, spec.name)
    scheduler.add_part(source, (), spec.name or None)
    return source


SOURCE: Element[SourceSpec, AnalogSource] = Element(
    spec=SourceSpec,
    refers=_refers,
    build=_build,
    signals=lambda built: {"volts": SignalOf((built.source,), built.volts, unit="V", bounds=(LOWEST_V, HIGHEST_V))},
    faults=(BROKEN_WIRE, DRIFT),
)
