"""Contacts that are reported or jam: of bodies, by a condition, and a gantry that is too skewed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar, NamedTuple, Protocol

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.components.logic import TerminalComponent
from steptwin.simulation.components.mount import Block
from steptwin.simulation.scheduler.scheduler import TerminalBlock
from steptwin.state import Plain

RESET, HIT = "RESET", "HIT"
REPORT, JAM = "report", "jam"


class Meeting(Protocol):
    """When parts touch."""

    def holds(self, now: Nanos) -> bool: ...
    def change(self, now: Nanos) -> Nanos | None:
        """When they may touch, or part, without an event; None if never."""
        ...

    def forget(self) -> None:
        """Compute anew what was found before: a snapshot was restored."""


class Contact(NamedTuple):
    """Parts that may touch. ``blocks`` block what moves them; ``text`` says what happens when they touch."""

    meeting: Meeting
    blocks: tuple[Block, ...]
    text: Callable[[], str]


APART_AGAIN = Message("simulation.apart-again", "{zone}: apart again")


class Touch(TerminalComponent):
    """The output is on while anything touches. If that jams it, its drives stand from then on; they are free again when RESET is
    switched on, and jam again when it touches the next time."""

    FIXED: ClassVar[tuple[str, ...]] = ("_contacts", "_depends_on", "_jams", "_reads")
    __slots__ = (*FIXED, "_due", "_jammed", "_short", "_touching", "_was_reset", "count")

    def __init__(
        self,
        block: TerminalBlock,
        jams: bool,
        contacts: Sequence[Contact],
        reads: tuple[str, ...],
        depends_on: tuple[str, ...] = (),
    ) -> None:
        """``reads``: as `TerminalComponent.reads`; ``depends_on``: what else moves them."""
        super().__init__(block)
        self._jams = jams
        self._contacts = tuple(contacts)
        self._reads, self._depends_on = reads, (block.name, *depends_on)
        self._due: Nanos | None = None
        """When parts may touch, or part, without an event."""
        none = (False,) * len(self._contacts)
        self._touching, self._jammed = none, none
        self._short = none
        """Which stand less than a pulse before where they touched: a jammed axis stands at a whole pulse."""
        self._was_reset = False
        self.count = 0
        """How often parts touched."""

    @property
    def depends_on(self) -> tuple[str, ...]:
        return self._depends_on

    @property
    def reads(self) -> tuple[str, ...]:
        return self._reads

    @property
    def output(self) -> str:
        """The terminal that is on while they touch."""
        return HIT

    def update(self, now: Nanos) -> None:
        before = self._touching
        self._touching = tuple(
            contact.meeting.holds(now) or short for contact, short in zip(self._contacts, self._short, strict=True)
        )
        if self._touching != before:
            for n, (touches, touched) in enumerate(zip(self._touching, before, strict=True)):
                if touches and not touched:
                    self._touch(n, now)
            if not any(self._touching):
                self._report(APART_AGAIN(zone=self.block.name), touches=False)
        is_reset = self.block.is_on(RESET)
        if is_reset and not self._was_reset and any(self._jammed):
            self._release(now)
        self._was_reset = is_reset
        self.block.put(self.output, float(any(self._touching)))
        changes = (contact.meeting.change(now) for contact in self._contacts)
        self._due = min((due for due in changes if due is not None), default=None)

    def _touch(self, n: int, now: Nanos) -> None:
        contact = self._contacts[n]
        self.count += 1
        self._report(contact.text(), touches=True)
        if self._jams and not self._jammed[n]:
            self._jammed = _with(self._jammed, n, True)
            for block in contact.blocks:
                block(True, now, self.block.name)
            self._short = _with(self._short, n, not contact.meeting.holds(now))

    def _release(self, now: Nanos) -> None:
        jammed = [contact for contact, is_jammed in zip(self._contacts, self._jammed, strict=True) if is_jammed]
        self._jammed = self._short = (False,) * len(self._contacts)
        for block in dict.fromkeys(block for contact in jammed for block in contact.blocks):
            block(False, now, self.block.name)

    def _report(self, text: str, *, touches: bool) -> None:
        scheduler = self.block.scheduler
        facts = ("element", self.block.name), ("touches", touches), ("jams", self._jams)
        scheduler.record(scheduler.owner(self.block.name), "event", "collision", text, *facts)

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        for contact in self._contacts:
            contact.meeting.forget()


def _with(flags: tuple[bool, ...], n: int, flag: bool) -> tuple[bool, ...]:
    return (*flags[:n], flag, *flags[n + 1 :])
