"""Taking workpieces from a belt while a terminal says that the cup or the jaws are there, and putting them on one."""

from __future__ import annotations

from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.carrier import PICK, PLACE, CarrierSpec
from steptwin.simulation.components.conveyor import Conveyor, find_conveyor
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.mechanics.belt import Belt, Placed
from steptwin.simulation.mechanics.workpiece import Workpiece
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.state import Stateful

HOLDS = Message("simulation.holds-a-workpiece", "{cup} holds {workpiece}")
FALLS_FROM = Message("simulation.falls-from", "{workpiece} falls from {cup}")


class BeltGrip(Stateful):
    """A `steptwin.simulation.components.carrier.Grip` in one dimension. Without a conveyor there is a workpiece wherever PICK is
    on."""

    FIXED: ClassVar[tuple[str, ...]] = ("_block", "_onto", "_pick_at", "_place_at", "_source")
    __slots__ = (*FIXED, "dropped", "workpiece")

    def __init__(self, block: TerminalBlock, spec: CarrierSpec, context: ElementContext) -> None:
        self._block = block
        self._source, self._onto = (None if name is None else find_conveyor(name, context) for name in (spec.source, spec.onto))
        self._pick_at, self._place_at = spec.pick_at, spec.place_at
        self.workpiece: Workpiece | None = None
        self.dropped = 0

    @property
    def mass(self) -> float:
        return 0.0 if self.workpiece is None else self.workpiece.mass

    @property
    def depends_on(self) -> tuple[str, ...]:
        return (self._block.name, *(() if self._source is None else self._source.line))

    def is_met(self, now: Nanos) -> bool:
        if not self._block.is_on(PICK):
            return False
        return self._source is None or self._below(self._source, now) is not None

    def _below(self, source: Conveyor, now: Nanos) -> tuple[Belt, Placed] | None:
        """The workpiece where it picks up, and the belt that moves it."""
        place = source.belt.to_grid(self._pick_at)
        return source.belt.occupant(place, place, now)

    def hold(self, now: Nanos) -> None:
        source, name = self._source, self._block.name
        if not self._block.is_on(PICK):
            return
        if source is None:
            self.workpiece = Workpiece("workpiece", 0)
        elif (found := self._below(source, now)) is not None:
            belt, placed = found
            self.workpiece = placed.workpiece
            source.remove(belt, placed)
            source.report(HOLDS(cup=name, workpiece=self.workpiece.name), self.workpiece.name, "held")

    def release(self, now: Nanos) -> None:
        workpiece, self.workpiece = self.workpiece, None
        source, onto = self._source, self._onto
        if workpiece is None or source is None:
            return
        if onto is not None and self._block.is_on(PLACE):
            lies = onto.lay(workpiece, onto.belt.to_grid(self._place_at), now)
        elif self._block.is_on(PICK):
            lies = source.lay(workpiece, source.belt.to_grid(self._pick_at), now)
        else:
            lies = False
            source.report(FALLS_FROM(workpiece=workpiece.name, cup=self._block.name), workpiece.name, "falls")
        if not lies:
            self.dropped += 1

    def lose(self, now: Nanos) -> None:
        """It has its workpiece no more."""
        self.workpiece = None
        self._block.scheduler.notify(self._block.name)

    def change(self, now: Nanos) -> Nanos | None:
        source = self._source
        if source is None or not self._block.is_on(PICK):
            return None
        return source.belt.next_change(source.belt.to_grid(self._pick_at), now)
