"""Jogs by clients of gateways: each lasts for the time given with every call, and ends when its client is lost.

A call that comes while a button is held is not distinguishable from a new one. So a jog that has ended by itself or by a stop is
not begun again in its direction until its client has not called for the time of its lease.
"""

from __future__ import annotations

import asyncio
from contextlib import nullcontext, suppress
from dataclasses import dataclass

from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.machine import SECOND
from steptwin.subject.commands import Jog, StopAxes
from steptwin.subject.jogs import Held

LEASE_S = (0.1, 5.0)
RENEWALS = 3.0
"""A jog of the subject is extended so often while it lasts."""


@dataclass(slots=True)
class _Lease:
    owner: object
    wanted: Jog
    held: Held
    until: float
    """By the clock of the event loop, s."""
    task: asyncio.Task[None] | None = None


class JogLeases:
    """The jogs of all sessions, at most one of an axis."""

    def __init__(self, subject: GatewaySubject) -> None:
        self._subject = subject
        self._leases: dict[tuple[str, int], _Lease] = {}

    async def jog(self, owner: object, client: GatewayClient, wanted: Jog, lease_s: float) -> None:
        """Jog for a time from now on; the same jog of the same ``owner`` goes on, and is in the audit log once.

        Raises `Misuse`, `Refusal`, `LineFailure`.
        """
        lease = self._leases.get((wanted.machine, wanted.axis))
        is_new = lease is None or lease.held.over is not None or lease.owner is not owner or lease.wanted != wanted
        with client.noted(self._subject, wanted) if is_new else nullcontext():
            client.check(wanted)
            await self._jog(owner, wanted, lease_s)

    async def _jog(self, owner: object, wanted: Jog, lease_s: float) -> None:
        if not LEASE_S[0] <= lease_s <= LEASE_S[1]:
            raise Misuse(f"lease = {lease_s:g} s: permitted are {LEASE_S[0]:g} to {LEASE_S[1]:g} s")
        place = wanted.machine, wanted.axis
        until = asyncio.get_running_loop().time() + lease_s
        lease = self._leases.get(place)
        if lease is not None and lease.held.over is None:
            if lease.owner is not owner:
                raise Refusal(f"{wanted.machine} axis {wanted.axis} is jogged by another client")
            if lease.wanted == wanted:
                lease.until = until
                return
        elif lease is not None and lease.owner is owner and lease.wanted.velocity * wanted.velocity > 0.0:
            lease.until = until
            over = f"{wanted.machine} axis {wanted.axis}: the jog has ended: {lease.held.over}"
            raise Refusal(f"{over}; it can be begun again {lease_s:g} s after its last call")
        if lease is not None:
            self._end(lease)
        held = await self._subject.begin_jog(wanted)
        lease = self._leases[place] = _Lease(owner, wanted, held, until)
        lease.task = asyncio.create_task(self._hold(lease))

    async def _hold(self, lease: _Lease) -> None:
        """Until it is over and its client has let go."""
        loop = asyncio.get_running_loop()
        while (left := lease.until - loop.time()) > 0:
            await asyncio.sleep(left if lease.held.over is not None else min(left, lease.held.lasts_ns / SECOND / RENEWALS))
            if lease.held.over is None and loop.time() < lease.until:
                with suppress(SteptwinError):  # it has ended
                    lease.held.extend()
        self._end(lease)

    def extend(self, owner: object, wanted: Jog, lease_s: float) -> None:
        """Let a jog go on from now on. Raises `Refusal` if it has ended."""
        lease = self._leases.get((wanted.machine, wanted.axis))
        if lease is None or lease.owner is not owner or lease.wanted != wanted or lease.held.over is not None:
            raise Refusal(f"{wanted.machine} axis {wanted.axis}: the jog has ended")
        lease.until = asyncio.get_running_loop().time() + lease_s

    def released(self, machine: str, axis: int) -> None:
        """The client has let go of a jog that had ended: it may be begun again."""
        lease = self._leases.get((machine, axis))
        if lease is not None and lease.held.over is not None:
            self._end(lease)

    def replaced(self, machine: str, axis: int) -> None:
        """Another command has taken the axis."""
        lease = self._leases.get((machine, axis))
        if lease is not None:
            lease.held.cut()
            self._end(lease)

    def _end(self, lease: _Lease) -> None:
        """Let go of the axis, which brakes."""
        if lease.held.over is None:
            lease.held.release()
        place = lease.wanted.machine, lease.wanted.axis
        if self._leases.get(place) is lease:
            del self._leases[place]
        if lease.task is not None and lease.task is not asyncio.current_task():
            lease.task.cancel()

    def stopped(self, wanted: StopAxes) -> None:
        """Axes have been stopped by a command."""
        for (machine, axis), lease in list(self._leases.items()):
            if machine == wanted.machine and wanted.axis in (None, axis):
                lease.held.cut()

    def drop(self, owner: object) -> None:
        """A client has gone."""
        for lease in list(self._leases.values()):
            if lease.owner is owner:
                lease.held.drop()
                self._end(lease)

    def close(self) -> None:
        for lease in list(self._leases.values()):
            self._end(lease)
