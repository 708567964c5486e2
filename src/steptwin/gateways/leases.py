"""Jogs by clients of gateways: each lasts for the time given with every call, and ends when its client is lost.

A call that comes while a button is held is not distinguishable from a new one. So a jog that has ended by itself or by a stop is
not begun again in its direction until its client has not called for the time of its lease.

A jog of a device begins later than it was asked for. Its axis is taken meanwhile. What ends a jog ends it then, too: it is let go
of as soon as it has begun, and its call is refused.
"""

from __future__ import annotations

import asyncio
from contextlib import nullcontext, suppress
from dataclasses import dataclass

from steptwin.controller import SECOND
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.gateways.clients import GatewayClient
from steptwin.gateways.contract import GatewaySubject
from steptwin.subject.commands import Jog, StopAxes
from steptwin.subject.jogs import ExtendableJog

LEASE_S = (0.1, 5.0)
RENEWALS = 3.0
"""A jog of the subject is extended so often while it lasts."""


@dataclass(slots=True)
class _Lease:
    owner: object
    wanted: Jog
    until: float
    """By the clock of the event loop, s."""
    held: ExtendableJog | None = None
    """None while it begins."""
    cancelled: str | None = None
    """The reason for its end while it was beginning."""
    task: asyncio.Task[None] | None = None

    @property
    def over(self) -> str | None:
        """The reason for its end; None while it begins and while it is active."""
        return None if self.held is None else self.held.over

    def is_of(self, owner: object, wanted: Jog) -> bool:
        """Whether a call belongs to the same press of the button; while the jog has ended, any velocity of its direction does."""
        is_same = self.wanted == wanted if self.over is None else self.wanted.velocity * wanted.velocity > 0.0
        return self.owner is owner and is_same


class JogLeases:
    """The jogs of all sessions, at most one of an axis."""

    def __init__(self, subject: GatewaySubject) -> None:
        self._subject = subject
        self._leases: dict[tuple[str, int], _Lease] = {}

    async def jog(self, owner: object, client: GatewayClient, wanted: Jog, lease_s: float) -> None:
        """Jog for a time from now on; the same jog of the same ``owner`` goes on, and is in the audit log once.

        Raises `Misuse`, `Refusal`, `LineFailure`.
        """
        lease = self._leases.get((wanted.controller, wanted.axis))
        is_new = lease is None or not lease.is_of(owner, wanted)
        with client.audited(self._subject, wanted) if is_new else nullcontext():
            client.check(wanted)
            await self._jog(owner, wanted, lease_s)

    async def _jog(self, owner: object, wanted: Jog, lease_s: float) -> None:
        if not LEASE_S[0] <= lease_s <= LEASE_S[1]:
            raise Misuse(f"lease = {lease_s:g} s: permitted are {LEASE_S[0]:g} to {LEASE_S[1]:g} s")
        until = asyncio.get_running_loop().time() + lease_s
        lease = self._leases.get((wanted.controller, wanted.axis))
        if lease is not None:
            axis = f"{wanted.controller} axis {wanted.axis}"
            if lease.over is None and lease.owner is not owner:
                raise Refusal(f"{axis} is jogged by another client")
            if lease.held is None:
                raise Refusal(f"{axis}: a jog is being begun; repeat it when that is answered")
            if lease.is_of(owner, wanted):
                lease.until = until
                if lease.over is None:
                    return
                raise Refusal(f"{axis}: the jog has ended: {lease.over}; it can be begun again {lease_s:g} s after its last call")
            self._end(lease)
        await self._begin(_Lease(owner, wanted, until))

    async def _begin(self, lease: _Lease) -> None:
        place = lease.wanted.controller, lease.wanted.axis
        self._leases[place] = lease
        try:
            held = await self._subject.begin_jog(lease.wanted)
            if lease.cancelled is None and asyncio.get_running_loop().time() >= lease.until:
                lease.cancelled = "its time was over before it began"
            if lease.cancelled is not None:
                held.drop()
                raise Refusal(f"{place[0]} axis {place[1]}: the jog was let go of as it began: {lease.cancelled}")
        except BaseException:
            del self._leases[place]
            raise
        lease.held = held
        lease.task = asyncio.create_task(self._hold(lease, held))

    async def _hold(self, lease: _Lease, held: ExtendableJog) -> None:
        """Until it is over and its client has let go."""
        loop = asyncio.get_running_loop()
        while (left := lease.until - loop.time()) > 0:
            await asyncio.sleep(left if held.over is not None else min(left, held.lasts_ns / SECOND / RENEWALS))
            if held.over is None and loop.time() < lease.until:
                with suppress(SteptwinError):  # it has ended
                    held.extend()
        self._end(lease)

    def extend(self, owner: object, wanted: Jog, lease_s: float) -> None:
        """Let a jog go on from now on. Raises `Refusal` if it has ended."""
        lease = self._leases.get((wanted.controller, wanted.axis))
        if lease is None or lease.owner is not owner or lease.wanted != wanted or lease.held is None or lease.over is not None:
            raise Refusal(f"{wanted.controller} axis {wanted.axis}: the jog has ended")
        lease.until = asyncio.get_running_loop().time() + lease_s

    def released(self, controller: str, axis: int) -> None:
        """The client has let go of a jog that had ended: it may be begun again."""
        lease = self._leases.get((controller, axis))
        if lease is not None and lease.over is not None:
            self._end(lease)

    def replaced(self, controller: str, axis: int) -> None:
        """Another command has taken the axis."""
        lease = self._leases.get((controller, axis))
        if lease is None:
            return
        if lease.held is not None:
            lease.held.cut()
        self._end(lease, "another command has taken the axis")

    def _end(self, lease: _Lease, why: str = "") -> None:
        """Let go of the axis, which brakes. ``why``: for a jog that is still beginning."""
        if lease.held is None:
            lease.cancelled = lease.cancelled or why
            return
        if lease.held.over is None:
            lease.held.release()
        place = lease.wanted.controller, lease.wanted.axis
        if self._leases.get(place) is lease:
            del self._leases[place]
        if lease.task is not None and lease.task is not asyncio.current_task():
            lease.task.cancel()

    def stopped(self, wanted: StopAxes) -> None:
        """Axes have been stopped by a command."""
        for (controller, axis), lease in list(self._leases.items()):
            if controller != wanted.controller or wanted.axis not in (None, axis):
                continue
            if lease.held is not None:
                lease.held.cut()
            else:
                self._end(lease, "it was stopped")

    def drop(self, owner: object) -> None:
        """A client has gone, or has let go."""
        for lease in list(self._leases.values()):
            if lease.owner is owner:
                if lease.held is not None:
                    lease.held.drop()
                self._end(lease, "its client has let go")

    def close(self) -> None:
        for lease in list(self._leases.values()):
            self._end(lease, "the connection of its client has ended")
