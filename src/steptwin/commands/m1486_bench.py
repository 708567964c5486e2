"""M1486 chips in virtual time with a host that types a program to them and a hand that changes their pins."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from steptwin.files.export.m1486_axes import ChipRecorder
from steptwin.m1486.chip import M1486, Event
from steptwin.machine import SECOND, Edge, Nanos
from steptwin.world.kernel import Kernel, Wire
from steptwin.world.trace import Trace

SLICE_NS: Nanos = SECOND
"""The longest stretch of time between two looks at whether anything is still going on."""

_LINE_END = re.compile(r"\r\n|\r|\n")


class Happening(NamedTuple):
    """Something to tell of a chip."""

    chip: str
    event: Event


class Input(NamedTuple):
    """``pin`` of a chip is pulled low (0) or let go (1) at a moment."""

    time: Nanos
    chip: str
    pin: str
    level: int


class Ending(NamedTuple):
    """When the last thing happened, and why there is nothing more: ``idle``, ``waiting`` for ever, or the ``limit``."""

    at: Nanos
    why: str


class Bench:
    """Chips (by name) on one line that takes no time. The host types ``text`` as soon as there is room for it.

    ``happened`` grows until somebody takes from it; ``sent`` is what each chip has sent.
    """

    def __init__(self, chips: Mapping[str, M1486], text: str, wires: Sequence[Wire] = (), trace: Trace | None = None) -> None:
        self.chips = chips
        self.happened: list[Happening] = []
        self.sent: dict[str, bytearray] = {name: bytearray() for name in self.chips}
        self.now: Nanos = 0
        self._last: Nanos = 0
        self._to_type = deque(_LINE_END.split(text))
        self._recorders: dict[str, ChipRecorder] = {}
        # Chips that share no wire are advanced apart: then each can compute ahead.
        self._kernel = Kernel() if wires else None
        for name, chip in self.chips.items():
            chip.on_event = partial(self._event, name)
            if self._kernel is not None:
                self._kernel.add(name, chip)
            if trace is not None:
                self._recorders[name] = ChipRecorder(name, chip, trace.add)
            chip.changed = partial(self._changed, name, chip)
        if self._kernel is not None:
            self._kernel.observers.append(self._edge)
            for wire in wires:
                self._kernel.connect(wire)

    # ------------------------------------------------------------------ what the chips tell

    def _event(self, name: str, event: Event) -> None:
        self._tell(name, event)
        if name in self._recorders:
            self._recorders[name].event(event)

    def _tell(self, name: str, event: Event) -> None:
        self.happened.append(Happening(name, event))
        self._last = event.time

    def _changed(self, name: str, chip: M1486) -> None:
        if self._kernel is not None:
            self._kernel.stale = True
        else:
            for edge in chip.take_edges():
                self._edge(name, edge)
        if name in self._recorders:
            self._recorders[name].look()

    def _edge(self, name: str, edge: Edge) -> None:
        if name in self._recorders:
            self._recorders[name].edge(edge)

    # ------------------------------------------------------------------ what is done to them

    def set_pin(self, name: str, pin: str, level: int) -> None:
        """Of one chip, at the present moment."""
        self._tell(name, Event(self.now, "input", f"input {pin} {'high' if level else 'low'}"))
        if name in self._recorders:
            self._recorders[name].input(self.now, pin, float(level))
        self.chips[name].set_pin(pin, level, self.now)

    @property
    def untyped(self) -> int:
        """Lines for which there was no room yet."""
        return len(self._to_type)

    def type(self) -> None:
        while self._to_type and all(_takes_a_line(chip) for chip in self.chips.values()):
            line = self._to_type.popleft().encode("latin-1", "replace") + b"\r"
            for chip in self.chips.values():
                chip.receive(line, self.now)

    def advance(self, now: Nanos) -> None:
        if self._kernel is not None:
            self._kernel.advance(now)
        for name, chip in self.chips.items():
            chip.advance(now)
            self.sent[name] += bytes(byte for _, byte in chip.uart.take_sent())
        self.now = now

    def deadline(self) -> Nanos | None:
        if self._kernel is not None:
            return self._kernel.deadline()
        return min((due for chip in self.chips.values() if (due := chip.deadline()) is not None), default=None)

    # ------------------------------------------------------------------ a run

    def run(self, inputs: Sequence[Input], limit: Nanos, look: Callable[[], None], *, until_idle: bool = False) -> Ending:
        """Until the chips are idle and nothing is left to be typed or changed, at most to ``limit``; with ``until_idle`` also
        where nothing will happen any more. ``inputs`` in order; ``look`` is called now and then.
        """
        waiting = deque(inputs)
        while True:
            while waiting and waiting[0].time <= self.now:
                change = waiting.popleft()
                self.set_pin(change.chip, change.pin, change.level)
            self.type()
            look()
            if not waiting and not self.untyped and all(chip.is_idle() for chip in self.chips.values()):
                return Ending(self._end(), "idle")
            if self.now >= limit:
                return Ending(limit, "limit")
            due = self._next(limit)
            if due is None and not waiting and until_idle:
                return Ending(self._end(), "waiting")
            moment = limit if due is None else due if self.untyped else max(due, self.now + SLICE_NS)
            self.advance(min(moment, limit, waiting[0].time if waiting else limit))

    def _next(self, limit: Nanos) -> Nanos | None:
        """The next moment at which something happens by itself. The last W of a program ends without a deadline."""
        due = self.deadline()
        ready = max(chip.program.ready for chip in self.chips.values())
        return min(ready, limit) if due is None and ready > self.now else due

    def _end(self) -> Nanos:
        """When the last thing happened or the last command was done; the look that finds that out comes later."""
        done = (chip.program.ready for chip in self.chips.values())
        return max(self._last, *(moment for moment in done if moment <= self.now), 0)


def _takes_a_line(chip: M1486) -> bool:
    """Whether a host that heeds the chip's answers would send another line."""
    receiver = chip.receiver
    return not receiver.is_listening or not (receiver.is_stalled or receiver.busy_until is not None)
