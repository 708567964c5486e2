"""``[[button]]``: a contact that a person presses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from steptwin.simulation.components.contact import ContactSpec
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.logic.contacts import Button
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import name_value


@table("[[button]]")
class ButtonSpec(ContactSpec, NamedSpec):
    name: str = key(name_value, "how scripts name it")


def _refers(spec: ButtonSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.target[0], spec.target[0], (*spec.path, "to"))


def _build(spec: ButtonSpec, context: ElementContext) -> tuple[Button, Scheduler]:
    scheduler = context.scheduler(spec.target[0])
    circuit = context.circuit(scheduler, spec.target, spec.path, spec.join)
    button = Button(
        circuit,
        normally_closed=spec.contact == "NC",
        bounce_ns=spec.bounce,
        bounces=spec.bounces,
        chance=context.bounce_of(circuit),
        channel=spec.name,
    )
    button.rest_at(spec.contact == "NC")
    scheduler.add_part(button, (circuit.target.controller,), spec.name, circuit.target.controller)
    return button, scheduler


def _signals(built: tuple[Button, Scheduler]) -> Mapping[str, SignalOf]:
    button, scheduler = built
    return {"pressed": SignalOf((scheduler.source(button.channel),), lambda now: float(button.pressed))}


BUTTON: Element[ButtonSpec, tuple[Button, Scheduler]] = Element(
    spec=ButtonSpec,
    refers=_refers,
    build=_build,
    signals=_signals,
)
