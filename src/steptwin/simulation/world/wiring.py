"""The wiring of a world as it was built: what drives each input."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from steptwin.controller import Nanos
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.elementspec import NamedSpec
from steptwin.simulation.scheduler.wires import PinName


@dataclass(frozen=True, slots=True)
class Connection:
    """One of the sources of an input."""

    source: str
    """An output, a switch of an axis or element, a button, or the name of an element; the table of an element without a name."""
    target: PinName
    inverted: bool = False
    """The input is 0 while the source is 1: an inverted wire, a contact that is normally closed."""
    delay: Nanos = 0
    join: str | None = None
    """``parallel`` or ``series`` where several contacts share the input."""


def connections(objects: BuiltObjects) -> Iterator[Connection]:
    """The connections in the order in which the description has them."""
    wires = {wire.target: wire for scheduler in objects.schedulers for wire in scheduler.wires}
    for target, path in objects.driven.items():
        circuit, wire = objects.circuits.get(target), wires.get(target)
        if wire is not None:
            yield Connection(terminal_name(objects, wire.source), target, wire.inverted, wire.delay)
        elif circuit is not None:
            join = None if len(circuit.contacts) < 2 else "series" if circuit.in_series else "parallel"
            for contact in circuit.contacts:
                yield Connection(contact.channel, target, contact.normally_closed, join=join)
        else:
            kind, number = str(path[0]), path[1]
            spec = objects.described[kind][int(number)]
            yield Connection((spec.name if isinstance(spec, NamedSpec) else "") or kind, target)


def terminal_name(objects: BuiltObjects, pin: PinName) -> str:
    """A pin as conditions name it: terminals of elements in small letters."""
    return f"{pin.controller}.{pin.pin.lower()}" if pin.controller in objects.terminals else str(pin)
