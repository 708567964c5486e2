"""Shared part of the records of one controller: its samples, and its commands."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from typing import Protocol

from steptwin.access.commands import PERMITS
from steptwin.access.roles import Role
from steptwin.gateways.clients import GatewayClient, address_text
from steptwin.gateways.contract import GatewaySubject
from steptwin.gateways.epics.records import Putter
from steptwin.gateways.leases import LEASE_S, JogLeases
from steptwin.gateways.sampling import Sample, Sampler
from steptwin.subject.commands import Command, Jog, ReadPoints, StopAxes
from steptwin.subject.subscriptions import Filter, Subscription

JOG_LEASE_S = 1.0
"""A jog ends so long after the gateway has last looked after it."""
MOST_INPUTS = 1000
"""Inputs between two samples."""


class SampledRecord(Protocol):
    @property
    def is_asked_for(self) -> bool: ...

    @property
    def is_busy(self) -> bool:
        """Whether it has to be read even where nobody asks."""
        ...

    async def take(self, sample: Sample, *, is_sure: bool) -> None:
        """A sample has come; it is ``is_sure`` where no command was on its way meanwhile."""
        ...

    def stopped(self, axis: int | None) -> None:
        """An axis is being stopped; None: all of them."""
        ...

    async def leave(self, circuit: object) -> None:
        """A client has gone."""
        ...


class EpicsController:
    """The controller ``name``, or the clock of the subject. ``role``: that of its clients."""

    def __init__(self, name: str, subject: GatewaySubject, sampler: Sampler, leases: JogLeases, role: Role) -> None:
        self.name = name
        self.records: list[SampledRecord] = []
        self._subject = subject
        self._sampler = sampler
        self._leases = leases
        self._role = role
        self._commands = 0
        self._on_their_way = 0
        self._sampling: asyncio.Task[None] | None = None
        self._is_asked = False
        self._is_part = False
        """Whether the sample that is being taken only has what events have named."""

    @property
    def is_wanted(self) -> bool:
        return any(record.is_asked_for for record in self.records)

    @property
    def is_busy(self) -> bool:
        return any(record.is_busy for record in self.records)

    # ------------------------------------------------------------------ values

    async def refresh(self) -> None:
        """Take a sample; those who ask while one is taken get that one, unless it only has what events have named."""
        while self._sampling is not None and self._is_part:
            await asyncio.wait((self._sampling,))
        self._is_asked = True
        await asyncio.shield(self.look())

    def look(self) -> asyncio.Task[None]:
        """Begin to take a sample, without waiting for a device that may not answer."""
        if self._sampling is None:
            self._sampling = asyncio.create_task(self._sample())
        return self._sampling

    async def close(self) -> None:
        if self._sampling is not None:
            self._sampling.cancel()
            await asyncio.wait((self._sampling,))

    async def _sample(self) -> None:
        try:
            before = self._commands
            # Of a motion the moment counts; a client that asks is given what is so now.
            is_whole = self._is_asked or self.is_busy
            self._is_asked, self._is_part = False, not is_whole
            sample = await (self._sampler.take(self.name) if is_whole else self._sampler.present(self.name))
            self._sampler.taken(sample)
            is_sure = before == self._commands and not self._on_their_way
        finally:
            self._sampling, self._is_part = None, False
        for record in self.records:
            await record.take(sample, is_sure=is_sure)

    async def read(self, points: Sequence[str]) -> list[float | None]:
        """Values of points of this controller. Raises `SteptwinError`."""
        if not points:
            return []
        found = (await self._subject.do(ReadPoints(tuple(f"{self.name}.{point}" for point in points)))).value
        return [reading["value"] for reading in found]

    async def leave(self, circuit: object) -> None:
        for record in self.records:
            await record.leave(circuit)

    # ------------------------------------------------------------------ commands

    def client(self, who: Putter) -> GatewayClient:
        return GatewayClient(f"{who.user}@{who.host}", self._role, f"EPICS, {address_text(who.circuit)}")

    def check_may_change(self, who: Putter) -> None:
        """Settings of records are for those who move. Raises `NotPermitted`."""
        self.client(who).check_role("a put", PERMITS["move"].role)

    async def do(self, who: Putter, wanted: Command) -> None:
        """Raises `SteptwinError`."""
        await self._guarded(lambda: self._do(who, wanted))

    async def _do(self, who: Putter, wanted: Command) -> None:
        await self.client(who).do(self._subject, wanted)
        if isinstance(wanted, StopAxes):
            self._leases.stopped(wanted)
            for record in self.records:
                record.stopped(wanted.axis)

    async def jog(self, owner: object, who: Putter, wanted: Jog) -> None:
        """Begin it. Raises `SteptwinError`."""
        client = self.client(who)
        self._leases.released(wanted.controller, wanted.axis)
        await self._guarded(lambda: self._leases.jog(owner, client, wanted, JOG_LEASE_S))

    def extend_jog(self, owner: object, wanted: Jog) -> None:
        """Let it go on. Raises `Refusal` if it has ended."""
        self._leases.extend(owner, wanted, JOG_LEASE_S)

    def end_jog(self, owner: object) -> None:
        self._commands += 1
        self._leases.drop(owner)

    def subscribe_to_inputs(self) -> Subscription:
        """Stops by anybody are among them (`steptwin.subject.payloads.InputPayload`)."""
        return self._subject.subscribe(Filter(frozenset({"input"}), frozenset({self.name})), MOST_INPUTS)

    def replace_jog(self, axis: int) -> None:
        """Another command has taken the axis."""
        self._leases.replaced(self.name, axis)

    async def _guarded(self, act: Callable[[], Awaitable[None]]) -> None:
        self._commands += 1
        self._on_their_way += 1
        try:
            await act()
        finally:
            self._on_their_way -= 1
            self._commands += 1


if not LEASE_S[0] <= JOG_LEASE_S <= LEASE_S[1]:
    raise AssertionError
