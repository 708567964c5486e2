"""``[[timer]]``: an output that follows an input later, or for a time: TON, TOF and TP of IEC 61131-3."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.components.logic import STUCK, Joint, TerminalComponent, TerminalComponentSpec, with_terminals
from steptwin.simulation.kinds.kind import Terminals
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import OUTPUT_PIN, Terminal, positive_time, word

IN, OUT = "IN", "OUT"
ON_DELAY, OFF_DELAY, PULSE = "on-delay", "off-delay", "pulse"


@table("[[timer]]")
class TimerSpec(TerminalComponentSpec):
    kind: str = key(word(ON_DELAY, OFF_DELAY, PULSE), "on-delay (TON), off-delay (TOF) or pulse (TP)")
    time: Nanos = key(positive_time, "such as '200 ms'")
    input: Terminal | None = key(OUTPUT_PIN, "output connected to IN; without it wires and contacts may be", default=None)

    @property
    def terminals(self) -> Terminals:
        return Terminals(digital_inputs=(IN,), outputs=(OUT,))

    @property
    def joints(self) -> Iterable[Joint]:
        if self.input is not None:
            yield Joint("input", IN, self.input)


class Timer(TerminalComponent):
    """On-delay (TON): on once the input has been on for ``time``. Off-delay (TOF): off once it has been off for ``time``.
    Pulse (TP): on for ``time`` from an edge of the input from 0 to 1; edges meanwhile do nothing."""

    FIXED: ClassVar[tuple[str, ...]] = ("_time", "kind")
    __slots__ = (*FIXED, "_due", "_was_on")

    def __init__(self, block: TerminalBlock, kind: str, time: Nanos) -> None:
        super().__init__(block)
        self.kind = kind
        self._time = time
        self._was_on = False
        self._due: Nanos | None = None
        """When the time has passed, while it runs."""

    @property
    def delays(self) -> tuple[Nanos, ...]:
        return (self._time,)

    def update(self, now: Nanos) -> None:
        is_on = self.block.is_on(IN)
        if self._due is not None and self._due <= now:
            self._due = None
        if is_on is not self._was_on:
            self._was_on = is_on
            self._turn(is_on, now)
        runs = self._due is not None
        if self.kind == ON_DELAY:
            level = is_on and not runs
        elif self.kind == OFF_DELAY:
            level = is_on or runs
        else:
            level = runs
        self.block.put(OUT, float(level))

    def _turn(self, is_on: bool, now: Nanos) -> None:
        if self.kind == PULSE:
            if is_on and self._due is None:
                self._due = now + self._time
        elif is_on is (self.kind == ON_DELAY):
            self._due = now + self._time
        else:
            self._due = None

    def deadline(self) -> Nanos | None:
        return self._due


_TIMER = with_terminals(
    TimerSpec,
    faults=STUCK,
    make=lambda spec, context: Timer(context.terminal_block(spec.name), spec.kind, spec.time),
)
TIMER = replace(_TIMER, function=lambda timer: timer.kind)
