"""A process that is suspended once, at any of the points where it reads the clock, sends, receives or sleeps.

The twin goes on meanwhile. `Suspension` is put between a driver's line and a wire of `line_rig`.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from line_rig import MemoryChannel, MemoryEndpoint, MemoryTransport, VirtualWire, run_virtual

from steptwin.controller import SECOND
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.threads import ThreadLine

T = TypeVar("T")
AWAY_S = 1000.0
"""Longer than any time a driver knows."""
AT_THE_LAST_MOMENT = ("before writing", "after the clock")
"""Between the last look at the clock and the bytes' leaving: that cannot be avoided, but noticed right afterwards."""


class Suspension:
    """The process is suspended at point ``at``, for ``away_s``; None: never. ``count`` tells how many points there were."""

    def __init__(self, wire: VirtualWire, away_s: float = AWAY_S) -> None:
        self.wire = wire
        self.away_s = away_s
        self.count = 0
        self.at: int | None = None
        self.back: int | None = None
        """When the process went on."""
        self.on_back: Callable[[], object] = lambda: None
        self.what = ""
        self.loss = 0
        """Every so-manyth piece that arrives is lost; 0: none."""
        self._arrived = 0
        self._elapse: Callable[[float], object] = wire.sleep

    def arm(self, at: int | None) -> None:
        self.count, self.at, self.back = 0, at, None

    def point(self, what: str) -> None:
        if self.count == self.at:
            self.what = what
            self._elapse(self.away_s)
            self.back = self.wire.now
            self.on_back()
        self.count += 1

    def around(self, what: str, action: Callable[..., T]) -> Callable[..., T]:
        def call(*args: Any) -> T:
            self.point(f"before {what}")
            result = action(*args)
            self.point(f"after {what}")
            return result

        return call

    def is_lost(self) -> bool:
        self._arrived += 1
        return bool(self.loss) and self._arrived % self.loss == 0

    # ------------------------------------------------------------------ lines

    def thread(self, line: ThreadLine[Any, Any]) -> ThreadLine[Any, Any]:
        wire = self.wire
        line.now = self.around("the clock", wire.clock)
        line._sleeping = self.around("sleeping", wire.sleep)
        line._endpoint = _Endpoint(self)
        return line

    def task(self, line: TaskLine[Any, Any]) -> TaskLine[Any, Any]:
        line.now = self.around("the clock", line.now)  # type: ignore[method-assign]
        line._endpoint = _Endpoint(self)
        return line

    def run(self, main: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine in the time of the wire, which the suspension moves too."""
        wire = self.wire

        async def body() -> T:
            import asyncio

            loop: Any = asyncio.get_running_loop()

            def elapse(seconds: float) -> None:
                end = max(wire.now, loop.now_ns) + round(seconds * SECOND)
                arrived: list[bytes] = []
                while pieces := wire.run(end):
                    arrived += pieces
                loop.now_ns = end
                for piece in arrived:
                    wire.inject(piece)

            self._elapse = elapse
            return await main

        return run_virtual(wire, body())


class _Endpoint(MemoryEndpoint):
    def __init__(self, suspension: Suspension) -> None:
        super().__init__(suspension.wire)
        self._suspension = suspension

    def open(self) -> MemoryChannel:
        channel = super().open()
        suspension = self._suspension
        read = channel.read
        channel.write = suspension.around("writing", channel.write)  # type: ignore[method-assign]

        def lossy(timeout_s: float) -> bytes:
            data = read(timeout_s)
            return b"" if data and suspension.is_lost() else data

        channel.read = suspension.around("reading", lossy)  # type: ignore[method-assign]
        return channel

    async def connect(self, make: Callable[[], Any]) -> MemoryTransport:
        suspension = self._suspension

        def protocol() -> Any:
            made = make()
            received = made.data_received
            made.data_received = lambda data: (
                suspension.point("before receiving"),
                None if suspension.is_lost() else received(data),
                suspension.point("after receiving"),
            )
            return made

        transport = await super().connect(protocol)
        transport.write = suspension.around("writing", transport.write)  # type: ignore[method-assign]
        return transport
