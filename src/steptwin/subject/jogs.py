"""Jogs that clients hold: the interface that a subject implements, and its implementation for worlds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Refusal
from steptwin.messages import Message, text_of
from steptwin.simulation.script.deadmanjog import DeadManJog, Given
from steptwin.subject.commands import Jog
from steptwin.subject.world import WorldSubject


class ExtendableJog(Protocol):
    """An active jog."""

    @property
    def lasts_ns(self) -> Nanos:
        """How long it goes on after it was extended, in virtual time."""
        ...

    @property
    def over(self) -> str | None:
        """The reason for its end; None while it is active."""
        ...

    def extend(self) -> None:
        """Extend it. Raises `Refusal` if it has ended."""
        ...

    def release(self) -> None:
        """End it with the ramp of the axis."""
        ...

    def drop(self) -> None:
        """The connection of its client is lost."""
        ...

    def cut(self) -> None:
        """Its axis was stopped by another command."""
        ...


class Jogs(Protocol):
    async def begin_jog(self, wanted: Jog) -> ExtendableJog:
        """Raises `Misuse`, `Refusal` and `LineFailure`. Waits for nothing but a `steptwin.later.Later`."""
        ...


AtPresent: TypeAlias = Callable[[Callable[[], Any]], Any]


def _at_once(action: Callable[[], Any]) -> Any:
    return action()


class WorldJogs:
    """Those of a world, which ends them by itself: it is an external actor of the world (`steptwin.live.world.ExternalActor`).

    ``at_present`` calls a function at the present moment of the world.
    """

    def __init__(self, subject: WorldSubject, at_present: AtPresent = _at_once) -> None:
        self._subject = subject
        self._at_present = at_present
        self._held: list[_WorldJog] = []

    async def begin_jog(self, wanted: Jog) -> ExtendableJog:
        return self._at_present(lambda: self._begin(wanted))

    def _begin(self, wanted: Jog) -> ExtendableJog:
        held = _WorldJog(self._subject, self._subject.dead_man_jog(wanted), self._at_present)
        held.extend()
        self._held.append(held)
        return held

    def deadline(self) -> Nanos | None:
        return min((due for held in self._held if (due := held.jog.deadline()) is not None), default=None)

    def advance(self, now: Nanos) -> None:
        for held in self._held:
            due = held.jog.deadline()
            if due is not None and due <= now:
                held.give(held.jog.advance(now))
        self._held = [held for held in self._held if held.jog.deadline() is not None]


JOG_HAS_ENDED = Message("subject.jog-has-ended", "the jog has ended: {why}")


class _WorldJog:
    def __init__(self, subject: WorldSubject, jog: DeadManJog, at_present: AtPresent) -> None:
        self._subject = subject
        self._at_present = at_present
        self.jog = jog

    @property
    def lasts_ns(self) -> Nanos:
        return self.jog.lasts_ns

    @property
    def over(self) -> str | None:
        return self.jog.over

    def extend(self) -> None:
        self._at_present(lambda: self.give(self.jog.extend(self._subject.world.now)))
        if self.jog.over is not None:
            raise Refusal(JOG_HAS_ENDED(why=text_of(self.jog.over)))

    def release(self) -> None:
        self._at_present(lambda: self.give(self.jog.release(self._subject.world.now)))

    def drop(self) -> None:
        self._at_present(lambda: self.give(self.jog.drop(self._subject.world.now)))

    def cut(self) -> None:
        self.jog.cut()

    def give(self, steps: Given) -> None:
        for step in steps:
            self._subject.do(step)
