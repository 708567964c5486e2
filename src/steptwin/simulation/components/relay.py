"""``[[relay]]``: a coil with a change-over contact, whose terminals NO and NC may be wired to any number of inputs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.element import Stands
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.faults import ActiveFault, FaultKind, Layer, Occasion
from steptwin.simulation.faults.effects import ElementEffect
from steptwin.simulation.faults.table import FaultCategory
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, time_value

COIL, NO, NC = "COIL", "NO", "NC"


@table("[[relay]]")
class RelaySpec(TerminalComponentSpec):
    coil: Terminal | None = key(
        OUTPUT_PIN, "output connected to COIL; without it wires and contacts may be, such as emergency stops", default=None
    )
    pull_in: Nanos = key(time_value, "from energising the coil to the contact", default=0)
    drop_out: Nanos = key(time_value, "from switching the coil off to the contact", default=0)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(COIL,), outputs=(NO, NC))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.coil is not None:
            yield Joint("coil", COIL, self.coil)


class Relay(TerminalComponent):
    """NO is on and NC off from ``pull_in`` after its coil is energised until ``drop_out`` after it is not. A shorter pulse, or a
    shorter gap, does not move the contact."""

    FIXED: ClassVar[tuple[str, ...]] = ("_drop_out", "_pull_in")
    __slots__ = (*FIXED, "_due", "_was_on", "is_on", "is_open", "is_welded")

    def __init__(self, block: TerminalBlock, pull_in: Nanos, drop_out: Nanos) -> None:
        super().__init__(block)
        self._pull_in = pull_in
        self._drop_out = drop_out
        self._was_on = False
        self._due: Nanos | None = None
        """When the contact moves."""
        self.is_on = False
        self.is_open = False
        """Fault: its coil is interrupted."""
        self.is_welded = False
        """Fault: the contact NO stays closed once it is."""

    @property
    def delays(self) -> tuple[Nanos, ...]:
        return self._pull_in, self._drop_out

    def update(self, now: Nanos) -> None:
        self._move(now)  # before the coil changes: an input at a moment comes after what is due then
        is_on = self.block.is_on(COIL) and not self.is_open
        if is_on is not self._was_on:
            self._was_on = is_on
            self._due = None if is_on is self.is_on else now + (self._pull_in if is_on else self._drop_out)
            self._move(now)
        closed = self.is_on or (self.is_welded and self.block.is_on(NO))
        self.block.put(NO, float(closed))
        self.block.put(NC, float(not closed))

    @property
    def is_kept_closed(self) -> bool:
        """Whether only the weld keeps the contact closed."""
        return self.is_welded and not self.is_on and self.block.is_on(NO)

    def _move(self, now: Nanos) -> None:
        """Move the contact if that is due."""
        if self._due is not None and self._due <= now:
            self._due = None
            self.is_on = self._was_on

    def deadline(self) -> Nanos | None:
        return self._due


CONTACT_WELDS = Message("simulation.contact-welds", "the contact of {name} welds once it is closed")
CONTACT_IS_FREE = Message("simulation.contact-is-free", "the contact of {name} is free again")


def _weld(active: ActiveFault, relay: Relay, begins: bool, now: Nanos) -> str:
    relay.is_welded = begins
    return (CONTACT_WELDS if begins else CONTACT_IS_FREE)(name=relay.block.name)


def _is_kept_closed(active: ActiveFault, relay: Relay, now: Nanos) -> bool:
    return relay.is_kept_closed


COIL_IS_INTERRUPTED = Message("simulation.coil-is-interrupted", "the coil of {name} is interrupted")
COIL_IS_CONNECTED = Message("simulation.coil-is-connected", "the coil of {name} is connected")


def _interrupt(active: ActiveFault, relay: Relay, begins: bool, now: Nanos) -> str:
    relay.is_open = begins
    return (COIL_IS_INTERRUPTED if begins else COIL_IS_CONNECTED)(name=relay.block.name)


def _is_wanted(active: ActiveFault, relay: Relay, now: Nanos) -> bool:
    return relay.is_open and relay.block.is_on(COIL)


STAYS_OPEN = Message("simulation.relay-stays-open", "is switched on, and stays open")
STAYS_CLOSED = Message("simulation.relay-stays-closed", "is switched off, and stays closed")


def _stands(relay: Relay, now: Nanos) -> Stands | None:
    if relay.is_kept_closed:
        return Stands(STAYS_CLOSED())
    return Stands(STAYS_OPEN()) if relay.is_open and relay.block.is_on(COIL) else None


RELAY = with_terminals(
    RelaySpec,
    make=lambda spec, context: Relay(context.terminal_block(spec.name), spec.pull_in, spec.drop_out),
    stands=_stands,
    faults=(
        *STUCK,
        FaultKind(
            "welded-contact",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The contact NO of a relay stays closed once it is.",
            effect=ElementEffect(_weld, _is_kept_closed),
            faulty=FaultCategory.LOGIC,
        ),
        FaultKind(
            "open-coil",
            Layer.ELEMENT,
            Occasion.ALWAYS,
            "The coil of a relay is interrupted.",
            effect=ElementEffect(_interrupt, _is_wanted),
            faulty=FaultCategory.LOGIC,
        ),
    ),
)
