"""``[[latch]]``: an output that is set by one input and reset by another."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, word

SET, RESET, OUT = "SET", "RESET", "OUT"


@table("[[latch]]")
class LatchSpec(TerminalComponentSpec):
    set: Terminal | None = key(OUTPUT_PIN, "output connected to SET; without it wires and contacts may be", default=None)
    reset: Terminal | None = key(OUTPUT_PIN, "output connected to RESET; without it wires and contacts may be", default=None)
    priority: str = key(word("set", "reset"), "what wins while both are on", default="reset")

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(SET, RESET), outputs=(OUT,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.set is not None:
            yield Joint("set", SET, self.set)
        if self.reset is not None:
            yield Joint("reset", RESET, self.reset)


class Latch(TerminalComponent):
    """On once SET is on, off once RESET is on; while both are, ``priority`` decides."""

    FIXED: ClassVar[tuple[str, ...]] = ("_reset_wins",)
    __slots__ = (*FIXED, "_is_on")

    def __init__(self, block: TerminalBlock, priority: str) -> None:
        super().__init__(block)
        self._reset_wins = priority == "reset"
        self._is_on = False

    def update(self, now: Nanos) -> None:
        is_set, is_reset = self.block.is_on(SET), self.block.is_on(RESET)
        if is_set and is_reset:
            self._is_on = not self._reset_wins
        elif is_set or is_reset:
            self._is_on = is_set
        self.block.put(OUT, float(self._is_on))


LATCH = with_terminals(
    LatchSpec,
    faults=STUCK,
    make=lambda spec, context: Latch(context.terminal_block(spec.name), spec.priority),
)
