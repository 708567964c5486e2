"""Present values of controllers for gateways, taken when they may have changed."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, cast

from steptwin.errors import LineFailure, Refusal
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.points import CLOCK, State
from steptwin.machine import Nanos
from steptwin.subject import commands as command
from steptwin.subject.following import USUAL, Filter

ACTIVE = ("running", "waiting")
"""Programs in these states change what they show without an event."""
MOST_EVENTS = 4096
RESTING_SAMPLES = 10
"""Of a controller at rest, one in so many samples is taken: for what changes without an event, such as a register."""


@dataclass(frozen=True, slots=True)
class Sample:
    """``state`` at the moment ``at``; None for a controller that does not answer, or refuses what it is asked."""

    machine: str
    state: State | None
    at: datetime
    time: Nanos = 0
    """The same moment by the clock of the subject, which may stand; 0 without an answer."""


class Sampler:
    """Samples of the controllers of ``subject``, with the registers that are named by controller."""

    def __init__(self, subject: GatewaySubject, registers: Mapping[str, Iterable[str]]) -> None:
        self._subject = subject
        self._registers = {name: tuple(of) for name, of in registers.items()}
        self._following = subject.follow(Filter(USUAL), MOST_EVENTS)
        self._resting: dict[str, int] = {}
        """Controllers that rest, and how many samples have been left out."""

    def close(self) -> None:
        self._following.close()

    async def take(self, machine: str) -> Sample:
        """The present values of a controller, or of the `CLOCK`."""
        if machine == CLOCK:
            return Sample(CLOCK, cast("State", (await self._subject.do(command.Time())).value), datetime.now(UTC))
        try:
            answer = await self._subject.do(command.ReadState(machine))
            state = cast("Mapping[str, Any]", answer.value)
            registers = await self._read(machine)
        except (LineFailure, Refusal):  # a device may refuse a register
            return Sample(machine, None, datetime.now(UTC))
        if _is_resting(state):
            self._resting[machine] = 0
        else:
            self._resting.pop(machine, None)
        return Sample(machine, {**state, "registers": registers}, datetime.now(UTC), answer.time)

    async def _read(self, machine: str) -> Mapping[str, float | None]:
        names = self._registers.get(machine, ())
        if not names:
            return {}
        points = tuple(f"{machine}.{name}" for name in names)
        readings = cast("list[Mapping[str, Any]]", (await self._subject.do(command.ReadPoints(points))).value)
        return {name: reading["value"] for name, reading in zip(names, readings, strict=True)}

    async def changed(self, machines: Iterable[str]) -> list[Sample]:
        """Samples of those ``machines`` that may have changed since their last one."""
        return await asyncio.gather(*map(self.take, self.due(machines)))

    def due(self, machines: Iterable[str]) -> list[str]:
        """Those ``machines`` that may have changed since their last sample."""
        missed, events = self._following.take()
        if missed:
            self._resting.clear()
        for event in events:
            self._resting.pop(event.machine, None)
        return [name for name in machines if self._is_due(name)]

    def _is_due(self, machine: str) -> bool:
        left_out = self._resting.get(machine)
        if left_out is None or left_out >= RESTING_SAMPLES or self._registers.get(machine):
            return True
        self._resting[machine] = left_out + 1
        return False


def _is_resting(state: State) -> bool:
    return state["program"]["state"] not in ACTIVE and not any(axis["moving"] for axis in state["axes"])
