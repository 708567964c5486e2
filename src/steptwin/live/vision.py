"""COM1 of a served MIC488 as links see it: records of a vision system, among Modbus frames or on a connection of their own."""

from __future__ import annotations

from steptwin.machine import Nanos
from steptwin.mic488.program import LoadedProgram
from steptwin.mic488.vision import Com1Port
from steptwin.wbc import steps as s
from steptwin.wbc.usage import sources

VISION = "VISION"
"""How the registers of the vision system begin."""


class Com1Link:
    """A port for a link."""

    broken = None

    def __init__(self, com1: Com1Port) -> None:
        self._com1 = com1

    @property
    def rubbish(self) -> int:
        """Bytes that belonged to no frame; those of records are among them."""
        modbus = self._com1.modbus
        return 0 if modbus is None else modbus.rubbish

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        self._com1.receive(data, now)
        return b"".join(piece for _, piece in self._com1.to_send(now))

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return self._com1.to_send(now)

    def deadline(self) -> Nanos | None:
        return self._com1.deadline()


def uses_vision(program: LoadedProgram) -> bool:
    """Whether a program reads or writes a register of the vision system."""
    used = [source for step in program.steps for source in sources(step)]
    used += [step.target for step in program.steps if isinstance(step, s.Set)]
    return any(isinstance(source, s.Register) and source.row.key.startswith(VISION) for source in used)
