"""A live world as a subject: commands at the present moment, and commands for its time, files and end points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from steptwin.live.debugging import Debugging
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.why import LiveWhy
from steptwin.live.world import LiveWorld
from steptwin.subject import commands as command
from steptwin.subject import debugcommands
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.events import Event
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingState
from steptwin.subject.subscriptions import Filter, Subscription

T = TypeVar("T")


class WorldControl:
    """The commands of a live world. ``end_points``: its addresses; None where it cannot have any."""

    def __init__(self, realtime: RealTimeDriver, live: LiveWorld, pace: Pace, end_points: Callable[[], object] | None) -> None:
        self._realtime = realtime
        self._live = live
        self.subject = live.subject
        self._of_pace = pace.actions()
        self.subject.dispatcher.add(
            {
                **self._of_pace,
                **Debugging(live, realtime, pace).actions(),
                debugcommands.AskWhy: LiveWhy(live).ask,
                command.Time: lambda _: pace.where(),
            }
        )
        if end_points is not None:
            self.subject.dispatcher.add({command.EndPoints: lambda _: end_points()})
        else:
            described = self.subject.description
            self.subject.description = replace(
                described, commands=tuple([one for one in described.commands if one != "end_points"])
            )

    @property
    def description(self) -> Description:
        return self.subject.description

    def read(self, *points: str) -> tuple[Reading, ...]:
        return self.at_present(lambda: self.subject.read(*points))

    def do(self, wanted: command.Command) -> Result:
        if type(wanted) in self._of_pace:  # they bring the world to the present themselves
            return self.subject.do(wanted)
        return self.at_present(lambda: self.subject.do(wanted))

    async def answer(self, wanted: command.Command) -> Result:
        """As `do`, also for commands that are answered later. Awaits only `steptwin.later.Later`."""
        result: Any = self.do(wanted)
        if type(wanted) is debugcommands.AskWhy:
            return result._replace(value=await result.value)
        return result

    def subscribe(self, what: Filter, bound: int) -> Subscription:
        return self.subject.subscribe(what, bound)

    def plans(self, what: Filter) -> list[Event]:
        return self.at_present(lambda: self.subject.plans(what))

    def workpieces(self) -> Sequence[WorkpieceState]:
        return self.at_present(self.subject.workpieces)

    def standing(self) -> Sequence[StandingState]:
        return self.at_present(self.subject.standing)

    def at_present(self, action: Callable[[], T]) -> T:
        """Do something at the present moment, and set the timer for its consequences."""
        self._realtime.enter()
        try:
            return action()
        finally:
            self._live.is_dirty = True
            self._realtime.leave()
