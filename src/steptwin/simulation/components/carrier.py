"""Common part of suction cups and grippers: where they pick workpieces up, and where they put them down."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.conveyor import Conveyor, find_conveyor
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs
from steptwin.simulation.components.logic import Joint, TerminalComponent, TerminalComponentSpec
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.mechanics.belt import Belt, Placed, Workpiece
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, NameOf, Terminal, number

PICK, PLACE, HELD = "PICK", "PLACE", "HELD"


@table()
class CarrierSpec(TerminalComponentSpec):
    pick: Terminal | None = key(OUTPUT_PIN, "output connected to PICK: it is where it picks up", default=None)
    place: Terminal | None = key(OUTPUT_PIN, "output connected to PLACE: it is where it puts down", default=None)
    source: str | None = key(
        NameOf("conveyor"),
        "conveyor that it picks from; without one a workpiece is there whenever PICK is on",
        default=None,
        name="from",
    )
    pick_at: float = key(number(0.0), "with from: mm from the beginning of the belt", default=0.0)
    onto: str | None = key(NameOf("conveyor"), "conveyor that it puts on", default=None)
    place_at: float = key(number(0.0), "with onto: mm from the beginning of the belt, of the front of the workpiece", default=0.0)

    @property
    @abstractmethod
    def own_joint(self) -> Joint | None:
        """Joint of its own key, besides the places."""

    @property
    def joints(self) -> Iterable[Joint]:
        own = self.own_joint
        if own is not None:
            yield own
        for name, terminal, source in (("pick", PICK, self.pick), ("place", PLACE, self.place)):
            if source is not None:
                yield Joint(name, terminal, source)

    def others(self, described: ElementSpecs) -> Iterable[tuple[str, str]]:
        if self.source is not None:
            yield "from", self.source
        if self.onto is not None:
            yield "onto", self.onto


HOLDS = Message("simulation.holds-a-workpiece", "{cup} holds {workpiece}")
FALLS_FROM = Message("simulation.falls-from", "{workpiece} falls from {cup}")


class Carrier(TerminalComponent):
    """It carries a workpiece while it holds it. Then it lies on the belt below, or has fallen."""

    FIXED: ClassVar[tuple[str, ...]] = ("_pick_at", "_place_at", "onto", "source")
    __slots__ = (*FIXED, "carried", "dropped")

    def __init__(self, block: TerminalBlock, spec: CarrierSpec, context: ElementContext) -> None:
        super().__init__(block)
        self.source, self.onto = (None if name is None else find_conveyor(name, context) for name in (spec.source, spec.onto))
        self._pick_at, self._place_at = spec.pick_at, spec.place_at
        self.carried: Workpiece | None = None
        self.dropped = 0
        """How many have fallen."""

    @property
    def depends_on(self) -> tuple[str, ...]:
        return (self.block.name, *(() if self.source is None else self.source.line))

    def is_occupied(self, now: Nanos) -> bool:
        """Whether it carries a workpiece, or one is where it would pick it up."""
        if self.carried is not None or not self.block.is_on(PICK):
            return self.carried is not None
        return self.source is None or self._below(self.source, now) is not None

    def _below(self, source: Conveyor, now: Nanos) -> tuple[Belt, Placed] | None:
        """The workpiece where it picks up, and the belt that moves it."""
        place = source.belt.to_grid(self._pick_at)
        return source.belt.occupant(place, place, now)

    def take(self, now: Nanos) -> None:
        """It holds what is there from now on. Without a conveyor there is a workpiece wherever PICK is on."""
        if self.carried is not None or not self.block.is_on(PICK):
            return
        source = self.source
        if source is None:
            self.carried = Workpiece("workpiece", 0)
        elif (found := self._below(source, now)) is not None:
            belt, placed = found
            self.carried = placed.workpiece
            source.take(belt, placed)
            source.report(HOLDS(cup=self.block.name, workpiece=self.carried.name), self.carried.name, "held")

    def let_go(self, now: Nanos) -> None:
        """It does not hold anything from now on."""
        workpiece, self.carried = self.carried, None
        source, onto = self.source, self.onto
        if workpiece is None or source is None:
            return
        if onto is not None and self.block.is_on(PLACE):
            lies = onto.put(workpiece, self._place_at, now)
        elif self.block.is_on(PICK):
            lies = source.put(workpiece, self._pick_at, now)
        else:
            lies = False
            source.report(FALLS_FROM(workpiece=workpiece.name, cup=self.block.name), workpiece.name, "falls")
        if not lies:
            self.dropped += 1

    def passing(self, now: Nanos) -> Nanos | None:
        """When a belt that moves brings a workpiece to where it picks up, or takes it away."""
        source = self.source
        if source is None or self.carried is not None or not self.block.is_on(PICK):
            return None
        return source.belt.next_change(source.belt.to_grid(self._pick_at), now)


def carrier_signals(carrier: Carrier) -> Mapping[str, SignalOf]:
    source = (carrier.block.source,)
    return {
        "dropped": SignalOf(source, lambda now: float(carrier.dropped)),
        "mass": SignalOf(source, lambda now: 0.0 if carrier.carried is None else carrier.carried.mass, unit="kg"),
    }
