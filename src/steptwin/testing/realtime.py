"""A twin in a thread of its own: programs reach it over sockets and pseudo terminals, as they reach a device.

`WallTime` is for the device itself.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, TypeVar

from steptwin.controller import SECOND, Nanos, Port
from steptwin.errors import Misuse, SteptwinError
from steptwin.live.clients import Clients
from steptwin.live.clock import Clock
from steptwin.live.links import Link
from steptwin.live.ptys import pty_link
from steptwin.live.realtimedriver import Advanceable, RealTimeDriver
from steptwin.live.tcp import TcpLink
from steptwin.simulation.toml.addresses import LOOPBACK, Address

T = TypeVar("T")

LOOK_S = 0.005
"""Interval of checks of a condition, s."""
ANSWER_S = 30.0
"""Time-out of calls to a twin, s."""
ROUNDS = 5
SPEEDS = (0.001, 1000.0)


class RealTime:
    """Controllers in real time, ``speed`` times as fast. Every method may be called from the test's thread.

    ``place`` names the twin in messages. Raises `Misuse` for a speed outside 0.001 to 1000.
    """

    def __init__(self, controllers: Advanceable, speed: float, place: str) -> None:
        if not SPEEDS[0] <= speed <= SPEEDS[1]:
            raise Misuse(f"{place}: speed = {speed:g}: permitted are {SPEEDS[0]:g} to {SPEEDS[1]:g}")
        self.controllers = controllers
        self.speed = speed
        self._place = place
        self._troubles: list[BaseException] = []
        self._links: list[Link] = []
        self._clients = Clients()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"steptwin {place}", daemon=True)
        self._thread.start()
        self._ready.wait(ANSWER_S)

    # ------------------------------------------------------------------ the thread of the twin

    def _run(self) -> None:
        try:
            # The standard library's loop: a test knows what it gets.
            with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
                runner.run(self._serve())
        except BaseException as error:  # noqa: BLE001 - the exception is raised by `close`
            self._troubles.append(error)
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._trouble)
        self._ended = asyncio.Event()
        self._clock = Clock(self.speed)
        self.realtime = RealTimeDriver(self.controllers, self._clock)
        self.realtime.start()
        self._ready.set()
        try:
            await self._ended.wait()
        finally:
            await _settle()
            for link in self._links:
                await link.close()
            self.realtime.close()
            await _settle()

    def _trouble(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if not isinstance(error, OSError):
            self._troubles.append(error or SteptwinError(context["message"]))

    def _wait_for(self, make: Callable[[], Awaitable[T]]) -> T:
        async def made() -> T:
            return await make()

        if not self._thread.is_alive():
            raise SteptwinError(f"{self._place} does not run any more") from next(iter(self._troubles), None)
        return asyncio.run_coroutine_threadsafe(made(), self._loop).result(ANSWER_S)

    def close(self) -> None:
        """End it; raises what failed in it and was not reported yet."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join(ANSWER_S)
        if self._troubles:
            raise SteptwinError(f"{self._place} failed: {self._troubles[0]}") from self._troubles[0]
        if self._thread.is_alive():
            raise SteptwinError(f"{self._place} did not end within {ANSWER_S:g} s")

    # ------------------------------------------------------------------ for the test

    def now(self) -> Nanos:
        return self._clock.now()

    def call(self, act: Callable[[Nanos], T]) -> T:
        """Do something with the controllers at the present moment, in their thread."""
        if threading.current_thread() is self._thread:
            return self._do(act)

        async def do() -> T:
            return self._do(act)

        return self._wait_for(do)

    def _do(self, act: Callable[[Nanos], T]) -> T:
        try:
            return act(self.realtime.enter())
        finally:
            self.controllers.is_dirty = True
            self.realtime.leave()

    def later(self, seconds: float, act: Callable[[], object]) -> None:
        """Do something when so many seconds of the twin have passed, in its thread."""
        self._loop.call_soon_threadsafe(self._loop.call_later, seconds / self.speed, act)

    def sleep(self, seconds: float) -> None:
        """``seconds`` are the twin's."""
        time.sleep(max(seconds, 0.0) / self.speed)

    def until(self, condition: Callable[[], object], within_s: float) -> bool:
        """Wait until a condition is true, at most so many seconds of the twin; whether it became true.

        A process that was held up holds up its twin too, so the twin's own clock is asked.
        """
        end = self.now() + round(within_s * SECOND)
        while not condition():
            if self.now() >= end:
                return bool(condition())
            time.sleep(LOOK_S)
        return True

    # ------------------------------------------------------------------ end points

    def open_tcp(self, make_port: Callable[[], Port]) -> Address:
        """Listen on a free port of the loopback interface."""

        async def opened() -> Address:
            link = TcpLink(self.realtime, Address(LOOPBACK, 0), make_port, self._clients)
            address = await link.open()
            self._links.append(link)
            return address

        return self._wait_for(opened)

    def open_pty(self, path: Path, make_port: Callable[[], Port]) -> Path:
        """A pseudo terminal behind the link ``path``."""

        async def opened() -> Path:
            link = pty_link(self.realtime, path, make_port)
            self._links.append(link)
            return await link.open()

        return self._wait_for(opened)


async def _settle() -> None:
    """Let connections that are being made or aborted complete, which takes asyncio a few rounds."""
    for _ in range(ROUNDS):
        await asyncio.sleep(0)


class WallTime:
    """The time of a device, which cannot be controlled."""

    def now(self) -> Nanos:
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))

    def until(self, condition: Callable[[], object], within_s: float) -> bool:
        end = self.now() + round(within_s * SECOND)
        while not condition():
            if self.now() >= end:
                return False
            time.sleep(LOOK_S)
        return True

    def close(self) -> None:
        """Nothing is open."""
