"""The moment of the past that one viewer is shown, while the world continues for the others."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Protocol

from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.later import Later
from steptwin.machine import Nanos
from steptwin.studio.programs import ProgramTexts
from steptwin.studio.shownworld import PlannedSubject, present_of
from steptwin.studio.watches import Watched
from steptwin.subject.commands import Command, Encoders, ListFaults, ReadPins, ReadPoints, State
from steptwin.subject.contract import Result
from steptwin.subject.following import filter_of

OF_A_MOMENT = frozenset({ReadPoints, ReadPins, State, Encoders, ListFaults})
"""Commands whose answer is about a moment."""


class PastMoment(Protocol):
    """A moment of the past, in a world whose time advances only on request."""

    @property
    def subject(self) -> PlannedSubject: ...
    @property
    def programs(self) -> ProgramTexts: ...
    @property
    def now(self) -> Nanos: ...

    def go(self, moment: Nanos) -> Later[None]:
        """To another moment. Raises `Misuse` for one that is not kept, `Refusal` when yet another one is wanted meanwhile."""
        ...

    def go_back(self) -> None:
        """Return the world itself to this moment, and pause it. Raises `Refusal`."""
        ...

    def close(self) -> None: ...


class KeptPast(Protocol):
    """The past of a world that is kept."""

    @property
    def begin(self) -> Nanos: ...

    def open(self) -> PastMoment:
        """For one more viewer. Raises `Refusal` where there are too many."""
        ...


class Looking:
    """The shown moment of one viewer: the present until `go`."""

    def __init__(self, lookback: KeptPast | None) -> None:
        self._lookback = lookback
        self._look: PastMoment | None = None
        self._going: Later[None] | None = None
        self.is_changed = False
        """Whether the viewer has to be sent `message`."""
        self.unsent: set[int] = set()
        """Numbers of the watches whose values of the moment have to be sent."""

    @property
    def is_back(self) -> bool:
        """Whether it is the past."""
        return self._look is not None

    async def go(self, moment: Nanos, watches: Mapping[int, Watched]) -> dict[str, object]:
        """Show a moment. Raises `Misuse`, and `Refusal` if no past is kept."""
        if self._lookback is None:
            raise Refusal("look: no past is kept here")
        look = self._look or self._lookback.open()
        try:
            self._going = look.go(moment)
            await self._going
        except SteptwinError:
            if self._look is None:
                look.close()
            raise
        self._look = look
        self.is_changed = True
        self.unsent = set(watches)
        return {"time_ns": str(look.now), "from_ns": str(self._lookback.begin)}

    def leave(self) -> None:
        """Back to the present."""
        if self._look is not None:
            self._look.close()
            self._look = None
            self.is_changed = True
            self.unsent.clear()

    async def _there(self) -> PastMoment:
        """The moment requested last, when it has been computed."""
        while self._going is not None and not self._going.is_done:
            try:
                await self._going
            except SteptwinError:
                continue  # another moment is wanted by now
        if self._look is None:
            raise Refusal("this viewer looks at the present")
        return self._look

    async def do(self, wanted: Command) -> Result:
        """The answer to one of `OF_A_MOMENT`."""
        look = await self._there()
        return look.subject.do(wanted)

    async def programs(self) -> ProgramTexts:
        return (await self._there()).programs

    async def go_back(self) -> None:
        """Return the world itself to the moment. Raises `Refusal`."""
        (await self._there()).go_back()
        self.leave()

    # ------------------------------------------------------------------ what the viewer is sent

    def message(self, may: list[str]) -> dict[str, object] | None:
        """What there was at the moment; None for the present."""
        self.is_changed = False
        look, lookback = self._look, self._lookback
        if look is None or lookback is None:
            return None
        plans = [plan.plain() for plan in look.subject.plans(filter_of(["plan"]))]
        moments = {"time_ns": str(look.now), "from_ns": str(lookback.begin)}
        return {**moments, "may": may, **present_of(look.subject), "plans": plans}

    def take(self, watches: Mapping[int, Watched]) -> dict[int, str]:
        """Values of the moment by watch, as JSON."""
        numbers, self.unsent = self.unsent & set(watches), set()
        return {number: self._values(watches[number]) for number in sorted(numbers)}

    def _values(self, watched: Watched) -> str:
        look = self._look
        points = () if look is None else watched.values.points
        return json.dumps([[index, _value(look, point)] for index, point in enumerate(points)], separators=(",", ":"))


def _value(look: PastMoment | None, point: str) -> float | None:
    """The value at a moment; None if unknown, as for a device, of which no past is kept."""
    try:
        return None if look is None else look.subject.read(point)[0].value
    except Misuse:
        return None
