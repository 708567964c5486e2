"""Motions of a driver's axis as Bluesky has them: awaited to their end, and ended where nobody waits any more."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Protocol

from steptwin.errors import Refusal


class DrivenAxis(Protocol):
    """An axis of a driver: `steptwin.drivers.AsyncMic488Axis`, `steptwin.drivers.m1486.AsyncM1486`. Positions in its unit."""

    @property
    def unit(self) -> str: ...

    async def position(self) -> float: ...

    async def move_to(self, position_u: float, /) -> None: ...

    async def wait(self) -> object: ...

    async def stop(self) -> object: ...


class AwaitedMotion:
    """Moves ``axis``. Nothing is begun twice: what was refused or interrupted is reported to whoever waits for it."""

    def __init__(self, axis: DrivenAxis, show: Callable[[], Awaitable[None]]) -> None:
        self._axis = axis
        self._show = show
        self._stops = 0
        self._halting: set[asyncio.Task[object]] = set()
        self.was_stopped = False
        """Whether `stop` has ended the last motion."""

    async def move(self, position: float) -> None:
        """Returns at the end of the motion: at ``position``, or where `stop` has ended it. Raises `SteptwinError` for one that is
        refused or that something else has ended. Who is cancelled meanwhile leaves no axis that moves."""
        stops = self._stops
        try:
            await self._axis.move_to(position)
            await self._axis.wait()
        except Refusal:
            if self._stops == stops:
                raise
        except asyncio.CancelledError:
            if self._stops == stops:
                await self._halt()
            raise
        finally:
            self.was_stopped = self._stops != stops
        await self._show()

    async def stop(self) -> None:
        self._stops += 1
        await self._axis.stop()

    async def _halt(self) -> None:
        """Also where the task that waits is cancelled again."""
        task = asyncio.get_running_loop().create_task(self._axis.stop())
        self._halting.add(task)
        task.add_done_callback(self._halting.discard)
        await asyncio.shield(task)
