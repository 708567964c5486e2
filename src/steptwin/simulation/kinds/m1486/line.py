"""Lines of M1486 chips."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from steptwin.controller import Nanos, Port
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.line import SerialChain
from steptwin.simulation.faults import Faults
from steptwin.simulation.faults import LineProtocol as FaultLine
from steptwin.simulation.kinds.lines import SCRIPTS, Line, LineEndPoint, LineTraffic
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.state import Plain
from steptwin.wire.slave import FrameDirection


class ChipLine(Line):
    """M1486 chips on one serial line. All chips receive all programs, and all programs receive all chips."""

    FIXED: ClassVar[tuple[str, ...]] = ("_commands",)
    __slots__ = (*FIXED, "chain")

    kinds = ("raw",)
    fault_kinds: ClassVar[Mapping[str, FaultLine]] = {"raw": FaultLine.CHARACTERS}
    is_shared = True

    def __init__(
        self, scheduler: Scheduler, name: str, record: RecordSink | None, faults: Faults, chips: list[M1486Chip]
    ) -> None:
        super().__init__(scheduler, name, record, faults)
        self.chain = SerialChain(chips)
        self._commands = 0
        """Number of lines that programs have sent."""
        self.connect(SCRIPTS)

    @property
    def units(self) -> tuple[int, ...]:
        return ()

    @property
    def baud(self) -> int:
        return next(iter(self.chain.chips.values())).uart.baud

    @property
    def is_timed(self) -> bool:
        return next(iter(self.chain.chips.values())).is_timed

    def _port(self, client: str, kind: str) -> Port:
        return self.chain.port()

    def exchange(self, client: str, found: LineEndPoint, data: bytes, now: Nanos) -> bytes:
        if data:
            self._report(client, now, FrameDirection.IN, data)
            self._commands += data.count(b"\r")
        return super().exchange(client, found, data, now)

    def recall(self, unit: int, now: Nanos) -> None:
        """Bytes that a fault holds up come to the chips at once, where a stop drops them."""
        self.clients[SCRIPTS].port.hasten(now)

    @property
    def traffic(self) -> LineTraffic:
        return LineTraffic(self._commands, self.chain.collisions)

    def _came(self, client: str, found: LineEndPoint, pieces: list[tuple[Nanos, bytes]]) -> None:
        if client == SCRIPTS:  # output is recorded here; scripts do not read it
            for moment, data in pieces:
                self._report("chips", moment, FrameDirection.OUT, data)
        else:
            super()._came(client, found, pieces)

    def _port_state(self, client: LineEndPoint) -> Plain:
        return tuple(client.inner.pending)

    def _set_port_state(self, client: LineEndPoint, state: Plain) -> None:
        client.inner.pending = list(state)
