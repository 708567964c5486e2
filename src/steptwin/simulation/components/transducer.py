"""``[[transducer]]``: an analog sensor, whose voltage at an analog input follows a signal of the world by a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.quantity import check_expression, owners_in
from steptwin.simulation.components.signals import find_signal
from steptwin.simulation.components.voltage import BROKEN_WIRE, DRIFT
from steptwin.simulation.logic.calculated import CalculatedSignal
from steptwin.simulation.logic.condition import Signal
from steptwin.simulation.logic.curve import Stepped
from steptwin.simulation.logic.expression import parse_expression
from steptwin.simulation.logic.quantities import SignalName
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.logic.sources import HIGHEST_V, LOWEST_V
from steptwin.simulation.scheduler.scheduler import Scheduler, Source
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import ANALOG_INPUT, PinOf, Terminal, name_value, points, text_value
from steptwin.simulation.toml.values import number as number_value
from steptwin.state import Stateful


@table("[[transducer]]")
class TransducerSpec(NamedSpec):
    name: str = key(name_value, "how conditions and faults name it")
    of: str = key(text_value, "a signal, such as x.position, or an expression, such as 0.4 * there.seen + bottle.value")
    target: Terminal = key(PinOf(ANALOG_INPUT), "the analog input: CONTROLLER.AIN1 or AIN2", name="to")
    points: tuple[tuple[float, float], ...] = key(points, "[[value, volts], ...] in the unit of the signal, linear between")
    resolution: float = key(number_value(0.0001, 10.0), "V: steps in which the voltage changes", default=0.01)

    def check(self, text: TomlText) -> None:
        check_expression(text, (*self.path, "of"), self.name, self.of)
        volts = [volts for _, volts in self.points]
        if not all(LOWEST_V <= one <= HIGHEST_V for one in volts):
            there = f"{min(volts):g} to {max(volts):g} V"
            message = f"{there}: an analog input takes {LOWEST_V:g} to {HIGHEST_V:g} V"
            text.wrong((*self.path, "points"), "D007", message)


class Transducer(Stateful):
    """Drives an analog input. It is due whenever its signal comes to a value at which the voltage is another one."""

    FIXED: ClassVar[tuple[str, ...]] = ("_scheduler", "_spec")
    __slots__ = (*FIXED, "_level", "is_broken", "offset")

    def __init__(self, scheduler: Scheduler, spec: TransducerSpec, signal: Signal) -> None:
        self._scheduler = scheduler
        self._spec = spec
        self._level = Stepped(signal, spec.points, spec.resolution)
        self.is_broken = False
        """Fault: its wire is broken."""
        self.offset = 0.0
        """Fault: volts by which it reads too high."""

    @property
    def name(self) -> str:
        return self._spec.name

    @property
    def source(self) -> Source:
        return self._scheduler.source(self.name)

    def volts(self, now: Nanos) -> float:
        """The voltage that it gives."""
        if self.is_broken:
            return LOWEST_V
        return min(max(self._level.value + self.offset, LOWEST_V), HIGHEST_V)

    def own_volts(self) -> float:
        """The voltage that it would give without faults."""
        return min(max(self._level.value, LOWEST_V), HIGHEST_V)

    def update(self, now: Nanos) -> None:
        self._level.update(now)
        self._scheduler.drive(PinName(*self._spec.target), self.volts(now))

    def deadline(self) -> Nanos | None:
        return self._level.due


def _refers(spec: TransducerSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.target[0], spec.target[0], (*spec.path, "to"))
    yield from (Reference(spec.target[0], owner, (*spec.path, "of")) for owner in owners_in(spec.of))


def _measured(spec: TransducerSpec, scheduler: Scheduler, context: ElementContext) -> Signal:
    """The signal that it follows. Raises `Misuse` for one of nothing that shares its scheduler."""
    quantity = parse_expression(spec.of)
    signals = {name: find_signal(context.objects, name) for name in dict.fromkeys(quantity.names())}
    for name, signal in signals.items():
        signal.watch(name)
        if all(source.scheduler is not scheduler for source in signal.sync(scheduler.now)):
            raise Misuse(f"of = {spec.of!r} is not a quantity of what {spec.target[0]!r} is connected to")
    if isinstance(quantity, SignalName):
        return signals[quantity.text]
    return CalculatedSignal(quantity, signals, lambda: scheduler.now)


def _build(spec: TransducerSpec, context: ElementContext) -> Transducer:
    scheduler = context.scheduler(spec.target[0])
    context.input(spec.target, (*spec.path, "to"), ANALOG_INPUT)
    transducer = Transducer(scheduler, spec, _measured(spec, scheduler, context))
    scheduler.add_part(transducer, (), spec.name, reads=owners_in(spec.of))
    return transducer


TRANSDUCER: Element[TransducerSpec, Transducer] = Element(
    spec=TransducerSpec,
    refers=_refers,
    build=_build,
    signals=lambda built: {"volts": SignalOf((built.source,), built.volts, unit="V", bounds=(LOWEST_V, HIGHEST_V))},
    faults=(BROKEN_WIRE, DRIFT),
)
