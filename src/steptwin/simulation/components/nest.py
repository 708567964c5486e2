"""``[[nest]]``: places for workpieces in a grid, such as a fixture, a magazine or a pallet, on anything that moves."""

from __future__ import annotations

from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.logic import TerminalComponent, with_terminals
from steptwin.simulation.components.nesttable import NestSpec
from steptwin.simulation.components.resting import Resting, resting_of
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import TerminalBlock


class Nest(TerminalComponent):
    """Counts the workpieces in it, those on others too, and which of them lie crooked."""

    FIXED: ClassVar[tuple[str, ...]] = ("resting", "spec")
    __slots__ = (*FIXED, "count", "crooked")

    def __init__(self, block: TerminalBlock, spec: NestSpec, resting: Resting) -> None:
        super().__init__(block)
        self.spec = spec
        self.resting = resting
        self.count = self.crooked = 0

    @property
    def depends_on(self) -> tuple[str, ...]:
        return (self.block.name, WORKPIECES)

    def update(self, now: Nanos) -> None:
        name, piles = self.block.name, self.resting.piles()
        count, crooked = piles.count.get(name, 0), piles.crooked.get(name, 0)
        if (count, crooked) != (self.count, self.crooked):
            self.count, self.crooked = count, crooked
            self.block.scheduler.notify(self.block.name)


def _make(spec: NestSpec, context: ElementContext) -> Nest:
    block = context.terminal_block(spec.name)
    return Nest(block, spec, resting_of(context, block.scheduler))


NEST = with_terminals(
    NestSpec,
    make=_make,
    signals=lambda nest: {
        "count": SignalOf((nest.block.source,), lambda now: float(nest.count)),
        "crooked": SignalOf((nest.block.source,), lambda now: float(nest.crooked)),
    },
    moves=lambda spec, nest: (),
)
