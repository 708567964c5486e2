"""A jog that lasts only while it is extended, as a dead man's switch: what the kinds of controllers make of it.

The controller is never given a motion without end. It gets bounded ones, again and again, each of which ends by itself; and what
is still in motion `STOP_NS` after the jog was extended last is stopped. So an axis stands at most `STANDS_NS` of virtual time
after that, whatever has become of whoever held it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeAlias

from steptwin.machine import MILLISECOND, Nanos
from steptwin.world import script as do

STANDS_NS: Nanos = 300 * MILLISECOND
STOP_NS: Nanos = 270 * MILLISECOND
"""What is left is for the stop to get over a line."""

Given: TypeAlias = Sequence[do.Write | do.Send]
"""What goes to the controller at the present moment."""


class HeldJog(Protocol):
    """One axis that is jogged; the machine is at ``now`` in every call."""

    @property
    def lasts_ns(self) -> Nanos:
        """How long it goes on after it was extended, before it begins to stop."""
        ...

    @property
    def over(self) -> str | None:
        """Why it has ended, in words; None while it has not."""
        ...

    def extend(self, now: Nanos) -> Given:
        """It goes on. The first call begins it. Nothing where it is over, which `over` tells then."""
        ...

    def release(self, now: Nanos) -> Given:
        """It ends, with the ramp of the axis."""
        ...

    def drop(self, now: Nanos) -> Given:
        """Whoever held it has gone: as `release`, and what still moves `STOP_NS` after it was extended is stopped."""
        ...

    def cut(self) -> None:
        """The axis was stopped otherwise; nothing more is given to it but settings that are put back."""
        ...

    def deadline(self) -> Nanos | None:
        """When `advance` is to be called; None when there is nothing more to do."""
        ...

    def advance(self, now: Nanos) -> Given: ...
