"""Contacts by a condition, which are reported or jam: a collision, and a gantry that is too skewed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.logic import TerminalComponent
from steptwin.simulation.logic.condition import SignalCondition
from steptwin.simulation.mechanics.mechanics import Mechanism
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.state import Plain

RESET, HIT = "RESET", "HIT"
REPORT, JAM = "report", "jam"


APART_AGAIN = Message("simulation.apart-again", "{zone}: apart again")
TOUCH = Message("simulation.axes-touch", "{zone}: {axes} touch")
PARTS_TOUCH = Message("simulation.parts-touch", "{zone}: parts touch")


class Touch(TerminalComponent):
    """The output is on while parts touch. If that jams them, the axes stand from then on; they are free again when RESET is
    switched on, and jam again when they touch the next time."""

    FIXED: ClassVar[tuple[str, ...]] = ("_axes", "_condition", "_jams")
    __slots__ = (*FIXED, "_due", "_is_jammed", "_is_short", "_touches", "_was_reset", "count")

    def __init__(self, block: TerminalBlock, jams: bool, condition: SignalCondition, axes: Mapping[str, Mechanism]) -> None:
        super().__init__(block)
        self._jams = jams
        self._condition = condition
        self._axes = axes
        self._due: Nanos | None = None
        """When parts may touch, or part, without an event."""
        self._touches = False
        self._is_jammed = False
        self._is_short = False
        """Whether they stand less than a pulse before where they touched: a jammed axis stands at a whole pulse."""
        self._was_reset = False
        self.count = 0
        """How often they touched."""

    @property
    def depends_on(self) -> None:
        """The condition may be over anything."""

    def is_moved_by(self, mechanism: Mechanism) -> bool:
        return any(one is mechanism for one in self._axes.values())

    @property
    def output(self) -> str:
        """The terminal that is on while they touch."""
        return HIT

    def touching(self) -> str:
        """Text of what happens when they touch."""
        return TOUCH(zone=self.block.name, axes=" and ".join(self._axes)) if self._axes else PARTS_TOUCH(zone=self.block.name)

    def update(self, now: Nanos) -> None:
        touches = self._condition.holds(now) or self._is_short
        if touches is not self._touches:
            self._touches = touches
            if touches:
                self._touch(now)
            else:
                self._report(APART_AGAIN(zone=self.block.name), touches=False)
        is_reset = self.block.is_on(RESET)
        if is_reset and not self._was_reset and self._is_jammed:
            self._block(False, now)
        self._was_reset = is_reset
        self.block.put(self.output, float(touches))
        self._due = self._condition.change(now)

    def _touch(self, now: Nanos) -> None:
        self.count += 1
        self._report(self.touching(), touches=True)
        if self._jams and not self._is_jammed:
            self._block(True, now)
            self._is_short = not self._condition.holds(now)

    def _block(self, blocked: bool, now: Nanos) -> None:
        self._is_jammed, self._is_short = blocked, False
        for mechanism in self._axes.values():
            mechanism.block(blocked, now, by=self.block.name)

    def _report(self, text: str, *, touches: bool) -> None:
        scheduler = self.block.scheduler
        facts = ("element", self.block.name), ("touches", touches), ("jams", self._jams)
        scheduler.record(scheduler.owner(self.block.name), "event", "collision", text, *facts)

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._condition.forget()
