"""Where a fault is placed, and whether it can happen there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.messages import NONE, Message
from steptwin.simulation.faults.kinds import KINDS
from steptwin.simulation.faults.table import Fault, Layer, LineProtocol


class RequestRoute(NamedTuple):
    """A link or line that carries requests. ``name`` with its verb is for messages: ``"line 'bus' carries"``."""

    name: str
    line: LineProtocol | None
    """None: it carries no bytes, so that the only fault of a request is its refusal."""
    link: str = ""
    """Its name in faults, alone or with a number (``tcp``: tcp-1…). Empty: not known."""
    units: tuple[int, ...] = ()
    is_usual: bool = True
    """Whether a fault without a link applies to it."""
    on: str = ""
    """The name of its line in faults."""

    def lets_happen(self, fault: Fault) -> bool:
        if self.line is None:
            return fault.refuses
        return self.line in fault.kind.lines

    def is_called(self, link: str) -> bool:
        name, _, number = link.rpartition("-")
        return not self.link or link == self.link or (name == self.link and number.isdecimal())

    @property
    def offers(self) -> str:
        """The faults that are possible here."""
        if self.line is None:
            return self.name
        kinds = (kind.name for kind in KINDS.values() if self.line in kind.lines)
        return f"{self.name} {self.line.value}, where {', '.join(kinds)} can happen"


UNKNOWN_LINE_OF_A_FAULT = Message("simulation.unknown-line-of-a-fault", "fault {name}: line = {line}: there are {names}")
UNKNOWN_LINK_OF_A_FAULT = Message("simulation.unknown-link-of-a-fault", "fault {name}: link = {link}: there are {names}")
FAULT_HAPPENS_ELSEWHERE = Message("simulation.fault-happens-elsewhere", "fault {name} happens on {lines}: {offers}{hint}")
UNKNOWN_UNIT_OF_A_FAULT = Message("simulation.unknown-unit-of-a-fault", "fault {name}: unit = {unit}: served are {names}")


def check_route(fault: Fault, wires: Sequence[RequestRoute]) -> None:
    """Raises `Misuse` for a fault of bytes, frames or protocol that none of ``wires`` can show."""
    kind, link, unit = fault.kind, fault.get("link"), fault.get("unit")
    if kind.layer in (Layer.PHYSICS, Layer.ELEMENT):
        return
    line = fault.get("line")
    if line is not None:
        there = list(dict.fromkeys(wire.on for wire in wires if wire.on)) or NONE()
        wires = [wire for wire in wires if wire.on == line]
        if not wires:
            raise Misuse(UNKNOWN_LINE_OF_A_FAULT(name=kind.name, line=repr(line), names=there))
    meant = [wire for wire in wires if (wire.is_usual if link is None else wire.is_called(str(link)))]
    if link is not None and not meant:
        there = list(dict.fromkeys(wire.link for wire in wires if wire.link)) or NONE()
        raise Misuse(UNKNOWN_LINK_OF_A_FAULT(name=kind.name, link=repr(link), names=there))
    able = [wire for wire in meant if wire.lets_happen(fault)]
    if not able:
        offers = "; ".join(dict.fromkeys(wire.offers for wire in meant)) or "there is no line"
        others = [wire for wire in wires if not wire.is_usual and wire.lets_happen(fault)] if link is None else []
        hint = f"; with link={others[0].link} it happens to the scripts' own requests, as {others[0].line}" if others else ""
        raise Misuse(FAULT_HAPPENS_ELSEWHERE(name=kind.name, lines=" and ".join(kind.lines), offers=offers, hint=hint))
    units = sorted({one for wire in able for one in wire.units})
    if unit is not None and unit not in units:
        raise Misuse(UNKNOWN_UNIT_OF_A_FAULT(name=kind.name, unit=unit, names=list(units) or NONE()))
