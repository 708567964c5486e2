"""Lines of toys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.simulation.faults import Faults
from steptwin.simulation.faults import LineProtocol as FaultLine
from steptwin.simulation.kinds.lines import Line, LineEndPoint
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.state import Stateful
from steptwin.wire.slave import FrameDirection
from toy.controller import Toy


class ToyPort(Stateful):
    """A connection with one toy; answers at once, when both bytes of a command are there."""

    broken = None

    FIXED: ClassVar[tuple[str, ...]] = ("_toy",)
    __slots__ = (*FIXED, "_held")

    def __init__(self, toy: Toy) -> None:
        self._toy = toy
        self._held = b""

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        data = self._held + data
        whole = len(data) // 2 * 2
        self._held = data[whole:]
        return b"".join(self._toy.execute(data[at : at + 2], now) for at in range(0, whole, 2))

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return []

    def deadline(self) -> Nanos | None:
        return None

    def close(self) -> None:
        self._held = b""


class ToyLine(Line):
    """One toy; every program has a connection of its own."""

    FIXED: ClassVar[tuple[str, ...]] = ("_toy",)
    __slots__ = (*FIXED,)

    kinds = ("raw",)
    fault_kinds: ClassVar[Mapping[str, FaultLine]] = {"raw": FaultLine.CHARACTERS}

    baud = 9600
    is_timed = False

    def __init__(
        self, scheduler: Scheduler, name: str, toy: Toy, faults: Faults | None = None, record: RecordSink | None = None
    ) -> None:
        super().__init__(scheduler, name, record, Faults() if faults is None else faults)
        self._toy = toy

    @property
    def units(self) -> tuple[int, ...]:
        return ()

    def _port(self, client: str, kind: str) -> ToyPort:
        return ToyPort(self._toy)

    def exchange(self, client: str, found: LineEndPoint, data: bytes, now: Nanos) -> bytes:
        self._report(client, now, FrameDirection.IN, data)
        answer = super().exchange(client, found, data, now)
        if answer:
            self._report(client, now, FrameDirection.OUT, answer)
        return answer
