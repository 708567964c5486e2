"""The program in the controller: select, start, pause, stop."""

from __future__ import annotations

from steptwin.drivers.mic488.unit import ALL_AXES, Unit
from steptwin.mic488.status import ProgramState


class AsyncMic488Program:
    """The program of a controller. Programs are downloaded with the vendor's tool; Modbus has no function for that."""

    def __init__(self, unit: Unit) -> None:
        self._unit = unit

    async def state(self) -> ProgramState:
        return ProgramState((await self._unit.control()).program)

    async def select(self, program_bank: int, position_bank: int | None = None) -> None:
        """Select the program for the next start. Raises `Misuse` for a bank the firmware does not have."""
        await self._unit.write(self._unit.item("PROG_BANK_SEL"), program_bank)
        if position_bank is not None:
            await self._unit.write(self._unit.item("POS_BANK_SEL"), position_bank)

    async def start(self) -> None:
        """Start the selected program, or continue a paused one. Sent only once: after a lost answer it is unknown whether it
        runs. One that began after a suspension of this process is paused, and its axes are stopped."""
        unit = self._unit
        permission = unit.permission(*ALL_AXES)
        async with unit.stopping_if_late(*ALL_AXES, program=True):
            await unit.write(unit.item("PROGRAM_CTRL"), ProgramState.RUNNING, permission=permission)

    async def pause(self) -> None:
        """Pause the program; motions that have begun, and dead-man jogs, go on. It precedes all waiting requests. Raises
        `Unconfirmed`."""
        await self._unit.end_program(ProgramState.PAUSED, "paused")

    async def stop(self) -> None:
        """End the program, which switches drives and outputs off (MIC-31). It precedes all waiting requests. Raises
        `Unconfirmed`."""
        await self._unit.end_program(ProgramState.STOPPED, "stopped")
