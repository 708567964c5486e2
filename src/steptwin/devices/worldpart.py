"""A world as a part of a subject: its answers are there at once."""

from __future__ import annotations

from typing import Any, Protocol

from steptwin.subject import commands as command
from steptwin.subject.commands import Command
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.following import Filter, Followers
from steptwin.subject.jogs import Jogs


class PlannedSubject(Protocol):
    """A subject in this process with plans: `steptwin.subject.world.WorldSubject`, or what lets its time go on."""

    @property
    def description(self) -> Description: ...
    def read(self, *points: str) -> tuple[Reading, ...]: ...
    def do(self, wanted: Command, /) -> Result: ...
    async def answer(self, wanted: Command, /) -> Result: ...
    def plans(self, what: Filter) -> list[Event]: ...


def present_of(world: PlannedSubject) -> dict[str, Any]:
    """``state`` by machine and ``faults``."""
    states = {part.name: world.do(command.ReadState(part.name)).value for part in world.description.machines}
    return {"state": states, "faults": world.do(command.ListFaults()).value}


class WorldPart:
    """Satisfies `steptwin.devices.composite.SubjectPart`."""

    lost = None

    def __init__(self, world: PlannedSubject, followers: Followers, jogs: Jogs) -> None:
        self._world = world
        self.followers = followers
        self.begin_jog = jogs.begin

    @property
    def description(self) -> Description:
        return self._world.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self._world.read(*points)

    async def do(self, wanted: Command, /) -> Result:
        return await self._world.answer(wanted)

    def result_of(self, value: object) -> Result:
        """The result of a request that is not a command of the world, at its present moment."""
        return self._world.do(command.Time())._replace(value=value)

    def present(self) -> dict[str, Any]:
        return present_of(self._world)

    def selected(self, data: bytes) -> None:
        """Its lines take characters as they are."""

    def plans(self, what: Filter) -> list[Event]:
        return self._world.plans(what)
