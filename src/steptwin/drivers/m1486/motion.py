"""Motions of a chip and the reasons of their ends, as far as a driver can know them."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from steptwin.controller import SECOND, Nanos
from steptwin.drivers.m1486.talk import chip_name
from steptwin.errors import Refusal

MARGIN_S = 1.0
MARGIN = 1.2
"""A motion is overdue after this many times its computed duration, and the other margin."""
UNKNOWN_S = 60.0
"""Time-out of a motion whose duration cannot be computed, s."""
EARLY_S = 0.05
EARLY = 0.98
"""A motion that ends before this part of its computed duration, less the other, ended early."""


class ChipReason(enum.Enum):
    """Why a motion ended."""

    TARGET = "target reached"
    SOUGHT = "line reached"
    REST = "at rest"
    DONE = "commands done"
    STOPPED = "stopped"
    CAME_TO_REST = "came to rest"
    EARLY = "ended early (LIMIT, or Kill from another program)"
    DIVERTED = "redirected"
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
    """A motion command that was sent to a chip. ``target_u``: the counter after it, if known (minimum microsteps)."""

    kind: ChipMotion
    at: Nanos
    stops: int
    target_u: int | None = None
    duration_s: float | None = None
    spoilt: int = 0
    """Number of lines the chip had dropped before."""
    is_marked: bool = False
    """Whether its last command is an upload that reports its end."""
    is_unfinished: bool = False
    """Whether that upload is missing although the chip is at rest."""
    over_at: Nanos | None = None
    """The time at which its end was detected, ns."""
    asked_at: Nanos | None = None
    """The time at which the chip was asked first whether it has ended, ns."""
    label: int | None = None
    """The label at which a program was started. It has no end: behind it lies the J that starts it."""

    @property
    def end(self) -> Nanos:
        """When it ends as computed, ns; where that is not known, when it begins."""
        return self.at + round((self.duration_s or 0.0) * SECOND)

    def is_over(self, now: Nanos) -> bool:
        """Whether it must have ended by now, from its computed duration."""
        return self.duration_s is not None and now - self.at > (MARGIN * self.duration_s + MARGIN_S) * SECOND


@dataclass(frozen=True, slots=True)
class ChipMoveEnd:
    """The end of a motion. ``position`` is in ``unit``, None if unknown. ``ok``: nothing is known against it, the end that was
    intended."""

    address: int | None
    reason: ChipReason
    position: float | None
    unit: str
    after_s: float
    detail: str = ""
    cause: Exception | None = None
    target: float | None = None
    """Where the motion was to end, if that is not known to be ``position``."""

    @property
    def ok(self) -> bool:
        return self.reason in _INTENDED

    def __str__(self) -> str:
        where = "" if self.position is None else f" at {self.position:g} {self.unit}"
        target = "" if self.target is None else f", target {self.target:g} {self.unit}"
        return f"{chip_name(self.address)}: {self.reason.value}{where}{target}{f' ({self.detail})' if self.detail else ''}"


class ChipMoveFailed(Refusal):
    """A motion did not end as intended; ``end`` has the reason."""

    def __init__(self, end: ChipMoveEnd) -> None:
        self.end = end
        super().__init__(str(end))


_INTENDED = (ChipReason.TARGET, ChipReason.CAME_TO_REST, ChipReason.SOUGHT, ChipReason.REST, ChipReason.DONE)
