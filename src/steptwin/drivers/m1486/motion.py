"""Motions of a chip as a driver sees them, and why they ended."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from steptwin.drivers.m1486.talk import chip_name
from steptwin.machine import SECOND, Nanos

MARGIN_S = 1.0
MARGIN = 1.2
"""A motion is overdue after this many times its computed duration, and the other margin."""
UNKNOWN_S = 60.0
"""Time-out of a motion whose end nobody can compute."""
EARLY_S = 0.05
EARLY = 0.98
"""A motion that is over before so much of its computed duration, less the other, did not go all its way."""


class ChipReason(enum.Enum):
    """Why a motion ended."""

    TARGET = "target reached"
    SOUGHT = "line reached"
    REST = "at rest"
    DONE = "commands done"
    STOPPED = "stopped"
    EARLY = "ended early (LIMIT, or Kill from another program)"
    DIVERTED = "stopped elsewhere than its target"
    CUT = "cut short"
    LIMIT = "stopped without a command (LIMIT, or Kill from another program)"
    OVERDUE = "not done yet"
    COMMUNICATION = "communication lost"


class ChipMotion(enum.Enum):
    """Kinds of motion commands."""

    MOVE = "a move"
    ENDLESS = "a run without end"
    SEEK = "a seek"
    BLOCK = "a block of commands"


@dataclass(slots=True, eq=False)
class ChipMotionCommand:
    """A motion command that a chip was sent. ``target_u``: the counter after it, if known (minimum microsteps)."""

    kind: ChipMotion
    at: Nanos
    stops: int
    target_u: int | None = None
    duration_s: float | None = None
    spoilt: int = 0
    """Lines the chip was made to drop before."""
    is_marked: bool = False
    """Whether its last command is an upload, by which its end is known."""
    is_unfinished: bool = False
    """Whether that did not come, although the chip is at rest."""
    over_at: Nanos | None = None
    """When its end was seen."""

    def is_over(self, now: Nanos) -> bool:
        """Whether it has ended for certain, although nobody has looked."""
        return self.duration_s is not None and now - self.at > (MARGIN * self.duration_s + MARGIN_S) * SECOND


@dataclass(frozen=True, slots=True)
class ChipMoveEnd:
    """How a motion ended. ``position`` is in ``unit``, None where it is not known. ``ok``: as it was meant to."""

    address: int | None
    reason: ChipReason
    position: float | None
    unit: str
    after_s: float
    detail: str = ""
    cause: Exception | None = None

    @property
    def ok(self) -> bool:
        return self.reason in (ChipReason.TARGET, ChipReason.SOUGHT, ChipReason.REST, ChipReason.DONE)

    def __str__(self) -> str:
        where = "" if self.position is None else f" at {self.position:g} {self.unit}"
        return f"{chip_name(self.address)}: {self.reason.value}{where}{f' ({self.detail})' if self.detail else ''}"
