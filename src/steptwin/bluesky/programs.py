"""The program of a MIC488 as a device: Triggerable, Flyable, Stoppable."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from bluesky.protocols import Flyable, Stoppable, Triggerable
from ophyd_async.core import AsyncStatus, Device

from steptwin.controllerstate import StatusLevel
from steptwin.drivers import AsyncMic488, ProgramState
from steptwin.errors import Refusal
from steptwin.mic488.present import controller_status

PERIOD_S = 0.1
"""Period at which a program is polled, s."""


class RunnableProgram(Device, Triggerable, Flyable, Stoppable):
    """Starts the program of ``mic`` and waits for its end. A program that runs already is not started again."""

    def __init__(self, mic: AsyncMic488, place: Callable[[], str], name: str = "") -> None:
        self._mic = mic
        self._place = place
        self._is_stopped = self._is_failure = False
        super().__init__(name)

    @AsyncStatus.wrap
    async def trigger(self) -> None:
        """It runs to its end. Raises as `kickoff` and `complete`."""
        await self._start()
        await self._over()

    @AsyncStatus.wrap
    async def kickoff(self) -> None:
        """Raises `Refusal` for a program that is not stopped."""
        await self._start()

    @AsyncStatus.wrap
    async def complete(self) -> None:
        """Raises `Refusal` where the controller has an error at its end, `RuntimeError` where `stop` has ended it."""
        await self._over()

    async def stop(self, success: bool = True) -> None:
        """Pause it and stop all axes: drives hold their load. Without ``success`` a `complete` that follows fails.

        The end of a program switches drives and outputs off: that is ``program.stop`` of the driver.
        """
        self._is_stopped, self._is_failure = True, not success
        await self._mic.halt()

    async def _start(self) -> None:
        state = await self._mic.program.state()
        if state is not ProgramState.STOPPED:
            raise Refusal(f"{self._place()}: the program is {state.name.lower()}")
        self._is_stopped = self._is_failure = False
        await self._mic.program.start()

    async def _over(self) -> None:
        while True:
            if self._is_stopped or await self._mic.program.state() is ProgramState.STOPPED:
                break
            await asyncio.sleep(PERIOD_S)
        if self._is_failure:
            raise RuntimeError(f"{self.name} was stopped; its program is paused")
        code = (await self._mic.status()).controller
        if code is not None and (status := controller_status(code)).level is StatusLevel.ERROR:
            raise Refusal(f"{self._place()}: the program has ended: {status.text}")
