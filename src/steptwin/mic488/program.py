"""Program control: banks, start, stop, pause (manual 4.1, MIC-22, MIC-26, MIC-28, MIC-31)."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

from steptwin.machine import Nanos
from steptwin.mic488.registers import OUTPUTS
from steptwin.state import Stateful

if TYPE_CHECKING:
    from steptwin.mic488.device import Mic488


class ProgramState(enum.IntEnum):
    """PROGRAM_CTRL as read (MIC-22); the same numbers written are commands."""

    STOPPED = 0
    RUNNING = 1
    PAUSED = 2


class ProgramControl(Stateful):
    """Which program runs on a controller. Bank selections take effect at the next start (MIC-31)."""

    __slots__ = ("_device", "error", "position_bank", "program_bank", "state")
    FIXED = frozenset({"_device"})

    def __init__(self, device: Mic488) -> None:
        self._device = device
        self.program_bank = 0
        self.position_bank = 0
        self.state = ProgramState.STOPPED
        self.error = False
        """A program error is pending; cleared by the next start or stop (MIC-26)."""

    def power_on(self, now: Nanos) -> None:
        """Nothing runs but what the configuration starts."""
        configured = self._device.config.program
        self.program_bank = configured.prog_bank if configured.activate else 0
        self.position_bank = configured.pos_bank if configured.activate else 0
        self.state = ProgramState.STOPPED
        self.error = False
        if configured.activate:
            self._start(now)

    def command(self, value: int, now: Nanos) -> None:
        """PROGRAM_CTRL written: 0 stop, 1 start, 2 pause."""
        if value == ProgramState.RUNNING:
            if self.state is ProgramState.STOPPED:
                self._start(now)
        elif value == ProgramState.STOPPED:
            self._end(now)

    def _start(self, now: Nanos) -> None:
        self.error = True
        self._device.event("program-error", f"program bank {self.program_bank} is empty")

    def _end(self, now: Nanos) -> None:
        """As the statement END: drives and outputs off (MIC-31)."""
        self.error = False
        for axis in self._device.axes:
            axis.disable(now)
        for number in range(OUTPUTS):
            self._device.set_output(number, False)

    def deadline(self) -> Nanos | None:
        return None

    def advance(self, now: Nanos) -> None:
        """Run what is due at ``now``."""

    def registers_written(self, now: Nanos) -> None:
        """A user register was written over Modbus."""

    def inputs_changed(self, numbers: list[int], now: Nanos) -> None:
        """Filtered inputs ``numbers`` (from 0) changed."""

    def interrupt_by_position_error(self, now: Nanos) -> None:
        """ERRMODE1: the program stops; firmware 1.70 pauses it [1.74]."""
