"""A jog that lasts only while it is extended, like a dead man's switch; each kind of controller implements it.

The controller never gets an endless motion, but repeated bounded ones, each of which ends by itself. An axis that still moves
`STOP_NS` after the last extension is stopped. It is therefore at rest at most `REST_NS` of virtual time after that extension,
even if the operator's program has failed. That is within the hold time of the drivers (ADR 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeAlias

from steptwin.controller import MILLISECOND, Nanos
from steptwin.simulation.script import steps as do

REST_NS: Nanos = 300 * MILLISECOND
STOP_NS: Nanos = 270 * MILLISECOND
"""The rest of `REST_NS` is for the stop to get over a line."""

Given: TypeAlias = Sequence[do.Write | do.Send]
"""Steps for the controller at the present moment."""


class DeadManJog(Protocol):
    """One axis that is jogged; the controller is at ``now`` in every call."""

    @property
    def lasts_ns(self) -> Nanos:
        """How long it goes on after it was extended, before it begins to stop."""
        ...

    @property
    def over(self) -> str | None:
        """The reason for its end as text; None while it is active."""
        ...

    def extend(self, now: Nanos) -> Given:
        """Start the jog (first call) or extend it. Returns no steps if it has ended; `over` then has the reason."""
        ...

    def release(self, now: Nanos) -> Given:
        """End it with the ramp of the axis."""
        ...

    def drop(self, now: Nanos) -> Given:
        """The operator's connection is lost: as `release`; an axis still moving `STOP_NS` after the last extension is stopped."""
        ...

    def cut(self) -> None:
        """The axis was stopped by another command; only its settings are restored."""
        ...

    def deadline(self) -> Nanos | None:
        """When `advance` is to be called; None when there is nothing more to do."""
        ...

    def advance(self, now: Nanos) -> Given: ...
