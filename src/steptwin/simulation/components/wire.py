"""``[[wire]]``: from an output to an input."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from steptwin.machine import Nanos
from steptwin.simulation.components.element import Element
from steptwin.simulation.components.elementspec import ElementSpec, ElementSpecs, Reference
from steptwin.simulation.components.site import Site
from steptwin.simulation.scheduler.wires import PinName, Wire
from steptwin.simulation.toml.reader import Key, Row, Table, TomlText, optional
from steptwin.simulation.toml.sense import TableRows
from steptwin.simulation.toml.values import INPUT_PIN, OUTPUT_PIN, Terminal, flag, time_value


@dataclass(frozen=True, slots=True, kw_only=True)
class WireSpec(ElementSpec):
    source: Terminal
    target: Terminal
    inverted: bool
    delay: Nanos


def _read(text: TomlText, row: Row, table: Table) -> WireSpec:
    return WireSpec(**row)


def _refers(spec: WireSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.source[0], spec.source[0], spec.path)
    yield Reference(spec.source[0], spec.target[0], spec.path)


def _build(spec: WireSpec, site: Site) -> Wire:
    wire = site.memo.once(spec.path, lambda: Wire(PinName(*spec.source), PinName(*spec.target), spec.inverted, spec.delay))
    site.join(wire, spec.path)
    return wire


WIRE: Element[WireSpec, Wire] = Element(
    name="wire",
    spec=WireSpec,
    rows=TableRows(
        written="[[wire]]",
        keys=(
            Key("from", OUTPUT_PIN, "the output: MACHINE.PIN", attribute="source"),
            Key("to", INPUT_PIN, "the input: MACHINE.PIN", attribute="target"),
            optional(flag, "inverted", "whether the level is turned round", False),
            optional(time_value, "delay", "how much later it arrives", 0),
        ),
    ),
    read=_read,
    refers=_refers,
    build=_build,
)
