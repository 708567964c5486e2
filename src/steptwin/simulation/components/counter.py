"""``[[counter]]``: counts edges up and down, with an output from a preset on: CTUD of IEC 61131-3."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.logic.signal import SignalOf
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, whole

UP, DOWN, RESET, OUT = "UP", "DOWN", "RESET", "OUT"
MOST = 2**31 - 1


@table("[[counter]]")
class CounterSpec(TerminalComponentSpec):
    preset: int = key(whole(1, MOST), "the count from which OUT is on")
    up: Terminal | None = key(OUTPUT_PIN, "output connected to UP, whose edges from 0 to 1 count up", default=None)
    down: Terminal | None = key(OUTPUT_PIN, "output connected to DOWN, whose edges from 0 to 1 count down", default=None)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET; the count is 0 while it is on", default=None)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(UP, DOWN, RESET), outputs=(OUT,))

    @property
    def joints(self) -> Iterable[Joint]:
        for name, terminal, source in (("up", UP, self.up), ("down", DOWN, self.down), ("reset", RESET, self.reset)):
            if source is not None:
                yield Joint(name, terminal, source)


class Counter(TerminalComponent):
    """Counts edges from 0 to 1, from 0 to `MOST`, and begins anew at 0 while RESET is on. OUT is on from ``preset`` on."""

    FIXED: ClassVar[tuple[str, ...]] = ("preset",)
    __slots__ = (*FIXED, "_levels", "count")

    def __init__(self, block: TerminalBlock, preset: int) -> None:
        super().__init__(block)
        self.preset = preset
        self._levels = (False, False)
        self.count = 0

    def update(self, now: Nanos) -> None:
        before, self._levels = self._levels, (self.block.is_on(UP), self.block.is_on(DOWN))
        up, down = (after and not level for level, after in zip(before, self._levels, strict=True))
        self.count = 0 if self.block.is_on(RESET) else min(max(self.count + up - down, 0), MOST)
        self.block.put(OUT, float(self.count >= self.preset))


def _signals(counter: Counter) -> Mapping[str, SignalOf]:
    return {"count": SignalOf((counter.block.source,), lambda now: float(counter.count))}


COUNTER = with_terminals(
    CounterSpec,
    faults=STUCK,
    make=lambda spec, context: Counter(context.terminal_block(spec.name), spec.preset),
    signals=_signals,
)
