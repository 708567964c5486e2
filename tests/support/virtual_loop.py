"""An event loop in virtual time: sockets are real, timers come when nothing else is left to do, and nobody waits."""

from __future__ import annotations

import asyncio
import selectors
import sys
from collections.abc import Coroutine
from typing import Any, TypeVar

from steptwin.live.clock import Clock

T = TypeVar("T")


class _Selector(selectors.DefaultSelector):
    """Where the loop would sleep, its time jumps."""

    loop: VirtualLoop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        if ready or timeout == 0:
            return ready
        if timeout is None and self.loop.is_alone:
            raise RuntimeError("nothing will ever happen in this loop any more")
        if timeout is None:
            return super().select(5.0)  # nothing is planned: something outside has to happen
        self.loop.now_ns += max(round(timeout * 1e9), 1)
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    now_ns: int

    def __init__(self, now_ns: int = 0, *, is_alone: bool = False) -> None:
        """``is_alone``: nothing outside can make anything happen."""
        selector = _Selector()
        selector.loop = self
        self.now_ns = now_ns
        self.is_alone = is_alone
        super().__init__(selector)

    def time(self) -> float:
        return self.now_ns / 1e9

    async def shutdown_default_executor(self, timeout: float | None = None) -> None:  # noqa: ASYNC109  that of asyncio
        """Threads end in wall time: a limit in virtual time would be over at once."""
        if sys.version_info >= (3, 12):
            await super().shutdown_default_executor(None)
        else:
            await super().shutdown_default_executor()

    def hold_up(self, seconds: float) -> None:
        """Time passes in which the process does nothing."""
        self.now_ns += round(seconds * 1e9)

    def clock(self) -> Clock:
        return Clock(wall_ns=lambda: self.now_ns)


def run_virtually(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run in virtual time; what the loop has to complain about fails the test."""
    complaints: list[dict[str, Any]] = []

    def loop() -> VirtualLoop:
        made = VirtualLoop()
        made.set_exception_handler(lambda _, context: complaints.append(context))
        return made

    with asyncio.Runner(loop_factory=loop) as runner:
        result = runner.run(coroutine)
    assert complaints == []
    return result
