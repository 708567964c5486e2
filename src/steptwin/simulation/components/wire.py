"""``[[wire]]``: from an output to an input."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.controller import Nanos
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, Reference
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import INPUT_PIN, OUTPUT_PIN, Terminal, flag, time_value


@table("[[wire]]")
class WireSpec(TableSpec):
    source: Terminal = key(OUTPUT_PIN, "the output: CONTROLLER.PIN", name="from")
    target: Terminal = key(INPUT_PIN, "the input: CONTROLLER.PIN", name="to")
    inverted: bool = key(flag, "whether the level is turned round", default=False)
    delay: Nanos = key(time_value, "how much later it arrives", default=0)


def _refers(spec: WireSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.source[0], spec.source[0], spec.path)
    yield Reference(spec.source[0], spec.target[0], spec.path)


def _build(spec: WireSpec, context: ElementContext) -> Wire:
    wire = context.memo.once(spec.path, lambda: Wire(PinName(*spec.source), PinName(*spec.target), spec.inverted, spec.delay))
    context.join(wire, spec.path)
    return wire


WIRE: Element[WireSpec, Wire] = Element(
    spec=WireSpec,
    refers=_refers,
    build=_build,
)
