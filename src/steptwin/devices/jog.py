"""A jog of a device with a lease: the driver's dead-man's switch is held while a client renews its lease."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.subject import DeviceJog
from steptwin.errors import Refusal
from steptwin.messages import Message, text_of
from steptwin.subject.jogs import JOG_HAS_ENDED

LEASE_NS: Nanos = 250 * MILLISECOND
"""The jog continues for this time after it was extended; then the axis brakes."""


JOG_NOT_BEGUN = Message("devices.jog-not-begun", "the jog was not begun: {why}")


class LeasedJog:
    """See `steptwin.subject.jogs.ExtendableJog`. ``report`` is called with an error at its end."""

    lasts_ns = LEASE_NS

    def __init__(self, jog: DeviceJog, clock: Callable[[], Nanos], report: Callable[[Exception], object]) -> None:
        self._jog = jog
        self._clock = clock
        self._report = report
        self.over: str | None = None
        self._until: Nanos = 0
        self._ending = asyncio.Event()
        self._running: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Raises `Misuse`, `Refusal`, `LineFailure`."""
        self._until = self._clock() + self.lasts_ns
        await self._jog.__aenter__()
        if self._jog.end is not None:
            await self._jog.__aexit__(None, None, None)
            raise Refusal(JOG_NOT_BEGUN(why=text_of(str(self._jog.end))))
        self._until = self._clock() + self.lasts_ns
        self._running = asyncio.get_running_loop().create_task(self._run())

    def on_end(self, action: Callable[[], object]) -> None:
        if self._running is not None:
            self._running.add_done_callback(lambda _: action())

    async def ended(self) -> None:
        if self._running is not None:
            await asyncio.wait([self._running])

    async def _run(self) -> None:
        ending = asyncio.create_task(self._ending.wait())
        try:
            while self.over is None:
                left_ns = self._until - self._clock()
                if left_ns <= 0:
                    self.over = "lapsed"
                    break
                holding = asyncio.create_task(self._jog.hold())
                await asyncio.wait([holding, ending], timeout=left_ns / SECOND, return_when=asyncio.FIRST_COMPLETED)
                if not holding.done():
                    holding.cancel()
                    with contextlib.suppress(asyncio.CancelledError):
                        await holding
                elif not holding.result():
                    self.over = self.over or str(self._jog.end)
        except Exception as error:  # noqa: BLE001  the client finds it when the jog is extended
            self.over = str(error)
            self._report(error)
        finally:
            ending.cancel()
            try:
                await self._jog.__aexit__(None, None, None)
            except Exception as error:  # noqa: BLE001  no caller waits for the end
                self._report(error)

    # ------------------------------------------------------------------ as `ExtendableJog`

    def extend(self) -> None:
        now = self._clock()
        if now > self._until:  # whoever renews it was away, or this process: what waited meanwhile extends nothing
            self._end("lapsed")
        if self.over is not None:
            raise Refusal(JOG_HAS_ENDED(why=text_of(self.over)))
        self._until = now + self.lasts_ns

    def release(self) -> None:
        self._end("let go")

    def drop(self) -> None:
        self._end("lapsed")

    def cut(self) -> None:
        self._end("stopped")

    def _end(self, why: str) -> None:
        self.over = self.over or why
        self._ending.set()
