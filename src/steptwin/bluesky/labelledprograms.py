"""The program in the command memory of an M1486 as a device: Flyable, Stoppable."""

from __future__ import annotations

from collections.abc import Callable

from bluesky.protocols import Flyable, Stoppable
from ophyd_async.core import AsyncStatus, StandardReadable, StandardReadableFormat, soft_signal_rw

from steptwin.drivers.m1486 import AsyncM1486
from steptwin.errors import Refusal


class LabelledProgram(StandardReadable, Flyable, Stoppable):
    """Starts the program of ``chip`` at ``label``, which a plan can set.

    It has no end that could be awaited: behind the last command of a file the chip finds what was typed since, and runs that,
    too (manual chapter II, Memory). So `complete` ends it.
    """

    def __init__(self, chip: AsyncM1486, place: Callable[[], str], label: int, name: str = "") -> None:
        self._chip = chip
        self._place = place
        self._is_begun = False
        self._is_failure = False
        with self.add_children_as_readables(StandardReadableFormat.CONFIG_SIGNAL):
            self.label = soft_signal_rw(int, label)
        super().__init__(name)

    @AsyncStatus.wrap
    async def kickoff(self) -> None:
        """Raises `Busy` for a chip that is not at rest, `Misuse` for a number that is not a label."""
        await self._chip.start_program(await self.label.get_value())
        self._is_begun, self._is_failure = True, False

    @AsyncStatus.wrap
    async def complete(self) -> None:
        """Ends it, after which the position is unknown (`AsyncM1486.stop_program`).

        Raises `Refusal` where it was not started, `Busy` where it goes on, `RuntimeError` where `stop` has ended it before.
        """
        if self._is_failure:
            raise RuntimeError(f"{self.name} was stopped")
        if not self._is_begun:
            raise Refusal(f"{self._place()}: the program was not started here, or was ended already")
        await self._chip.stop_program()
        self._is_begun = False

    async def stop(self, success: bool = True) -> None:
        """Ends it at once, whoever has started it; without ``success`` a `complete` that follows fails."""
        self._is_failure = not success
        await self._chip.stop_program()
        self._is_begun = False
