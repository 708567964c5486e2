"""An element that the source does not know: a lamp at an output, which needs a while to light up and may burn out."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.registry import forget, register
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT, Terminal, flag, name_value, pin_name, time_value
from steptwin.state import Stateful


@table("[[lamp]]")
class LampSpec(NamedSpec):
    name: str = key(name_value, "how conditions and faults name it")
    source: Terminal = key(pin_name, "the output: CONTROLLER.PIN", name="from")
    inverted: bool = key(flag, "whether it is lit while the output is off", default=False)
    warms: Nanos = key(time_value, "how long it needs to light up", default=0)


class Lamp(Stateful):
    """Lit when its output has been on for ``warms``, unless it has burnt out. Its edges are recorded under its name."""

    FIXED: ClassVar[tuple[str, ...]] = ("_spec", "scheduler", "source")
    __slots__ = (*FIXED, "_due", "_is_on", "burnt", "lit")

    def __init__(self, spec: LampSpec, scheduler: Scheduler, source: PinName) -> None:
        self._spec = spec
        self.scheduler = scheduler
        self.source = source
        self._is_on = False
        self._due: Nanos | None = None
        self.burnt = False
        self.lit = False

    def update(self, now: Nanos) -> None:
        level = self.scheduler.controllers[self.source.controller].pin(self.source.pin)
        is_on = bool(level) is not self._spec.inverted
        if is_on is not self._is_on:
            self._is_on = is_on
            self._due = now + self._spec.warms if is_on else None
        if self._due is not None and self._due <= now:
            self._due = None
        self._show(self.would_be_lit and not self.burnt)

    @property
    def would_be_lit(self) -> bool:
        """Without faults."""
        return self._is_on and self._due is None

    @property
    def name(self) -> str:
        return self._spec.name

    def _show(self, lit: bool) -> None:
        if lit is not self.lit:
            self.lit = lit
            self.scheduler.record(self.source.controller, "edge", self._spec.name, float(lit))

    def deadline(self) -> Nanos | None:
        return self._due


def _refers(spec: LampSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.source[0], spec.source[0], (*spec.path, "from"))


def _build(spec: LampSpec, context: ElementContext) -> Lamp:
    lamp = Lamp(spec, context.scheduler(spec.source[0]), context.terminal(spec.source, OUTPUT))
    lamp.scheduler.add_part(lamp, name=spec.name)
    return lamp


def _signals(lamp: Lamp) -> Mapping[str, SignalOf]:
    return {"lit": SignalOf((lamp.scheduler.source(lamp.name),), lambda now: float(lamp.lit))}


def _burn(active: ActiveFault, lamp: Lamp, begins: bool, now: Nanos) -> str:
    lamp.burnt = begins
    lamp.scheduler.notify()
    return "it is burnt out" if begins else "it has been replaced"


def _is_dark(active: ActiveFault, lamp: Lamp, now: Nanos) -> bool:
    return lamp.burnt and lamp.would_be_lit


LAMP: Element[LampSpec, Lamp] = Element(
    spec=LampSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
    faults=(
        FaultKind(
            "burnt-out",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "A lamp stays dark.",
            effect=ElementEffect(_burn, _is_dark),
        ),
    ),
)


@contextmanager
def registered() -> Generator[None]:
    """Descriptions may have lamps meanwhile."""
    register(LAMP)
    try:
        yield
    finally:
        forget(LAMP)
