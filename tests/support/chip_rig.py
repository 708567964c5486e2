"""M1486 chips at the other end of a line in virtual time, for tests of drivers (`line_rig`).

`ChipWire` carries characters, `Fault`s are put on it by direction and number; `chip_line` and `chip_task_line` are lines in its
time for threads and tasks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from line_rig import LATENCY, MemoryEndpoint, VirtualWire

from steptwin.drivers.m1486 import sync
from steptwin.drivers.m1486.lines import talking
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.tasks import TaskLine
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486 import chip as twin
from steptwin.m1486.events import M1486Event
from steptwin.m1486.line import SerialChain
from steptwin.m1486.variants import variant

Direction = Literal["to chip", "to host"]
Kind = Literal["drop", "flip 4", "flip 0", "invert", "double", "insert", "late", "semicolon"]
KINDS: tuple[Kind, ...] = ("drop", "flip 4", "flip 0", "invert", "double", "insert", "late")
LATE_NS = 700 * 1_000_000
"""Later than the time-out of an exchange."""
NOISE = 0x13
BAUD = 4800

KNOWN = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 4, "qualification": 1}
"""Settings of a chip."""


@dataclass
class Fault:
    """Once: what happens to character ``index`` of those that go in a direction from now on."""

    direction: Direction
    index: int
    kind: Kind
    met: bool = False

    def of(self, byte: int) -> bytes:
        match self.kind:
            case "drop":
                return b""
            case "double":
                return bytes((byte, byte))
            case "insert":
                return bytes((NOISE, byte))
            case "invert":
                return bytes((~byte & 0xFF,))
            case "semicolon":
                return b";"
            case "flip 4":
                return bytes((byte ^ 0x10,))
            case "flip 0":
                return bytes((byte ^ 0x01,))
            case _:
                return bytes((byte,))


class ChipWire(VirtualWire):
    """M1486 chips on a line."""

    there, back = "to chip", "to host"

    def __init__(self, kind: str = "B", addresses: tuple[int, ...] = (15,), *, is_timed: bool = True, **options: Any) -> None:
        super().__init__()
        self.chips = {
            address: twin.M1486Chip(variant(kind), address=address, is_timed=is_timed, baud=BAUD, **options)
            for address in addresses
        }
        self.chain = SerialChain(self.chips.values())
        self._port = self.chain.port()
        self.happened: list[tuple[int, M1486Event]] = []
        for address, chip in self.chips.items():
            chip.advance(self.now)
            chip.on_event = lambda event, address=address: self.happened.append((address, event))
        self.faults: list[Fault] = []

    @property
    def chip(self) -> twin.M1486Chip:
        return next(iter(self.chips.values()))

    @property
    def passed(self) -> dict[Direction, int]:
        """How many characters have gone in each direction since faults were put on the line."""
        return {"to chip": self._passed["to chip"], "to host": self._passed["to host"]}

    def open(self) -> None:
        """A new connection: nothing to be done, the line stays."""

    # ------------------------------------------------------------------ characters

    def put(self, *faults: Fault) -> None:
        """Put faults on the line; characters are counted from now on."""
        self._passed = {"to chip": 0, "to host": 0}
        self.faults = list(faults)

    def _carry(self, direction: str, data: bytes, now: int) -> None:
        for byte in data:
            number = self._passed[direction]
            self._passed[direction] += 1
            if self.severed:
                continue
            fault = next((f for f in self.faults if not f.met and (f.direction, f.index) == (direction, number)), None)
            piece, at = bytes((byte,)), now + LATENCY
            if fault is not None:
                fault.met = True
                piece = fault.of(byte)
                if fault.kind == "late":
                    at += LATE_NS
            at = self._latest[direction] = max(at, self._latest[direction])
            self._arrive(direction, piece, at)

    def _receive(self, data: bytes) -> bytes:
        self.chain.receive(data, self.now)
        return b""

    def _spoken(self) -> bytes:
        return b"".join(data for _, data in self._port.to_send(self.now))

    def _deadline(self) -> int | None:
        return min((due for chip in self.chips.values() if (due := chip.deadline()) is not None), default=None)

    def _advance(self, now: int) -> None:
        self.now = max(self.now, now)
        for chip in self.chips.values():
            chip.advance(self.now)

    # ------------------------------------------------------------------ what the chips do

    def true(self, address: int | None = None) -> int:
        """Where a motor stands, in minimum microsteps from its place at power-on."""
        return self._one(address).drive.true_u(self.now)

    def moving(self, address: int | None = None) -> bool:
        return self._one(address).drive.is_busy

    def _one(self, address: int | None) -> twin.M1486Chip:
        return self.chip if address is None else self.chips[address]

    def codes(self, address: int | None = None) -> list[str]:
        return [event.code for one, event in self.happened if address in (None, one)]


def typed(wire: ChipWire) -> str:
    """What was sent, CR as a blank."""
    return b"".join(data for _, data in wire.sent).decode().replace("\r", " ")


def chip_line(wire: ChipWire, log: Callable[[str], object] | None = None) -> ThreadLine[ChipRequest, bytes]:
    endpoint = MemoryEndpoint(wire)
    exchanger, shared = talking(endpoint, BAUD, log)
    return ThreadLine(endpoint, exchanger, shared, clock=wire.clock, sleeping=wire.sleep)


def chip_task_line(wire: ChipWire) -> TaskLine[ChipRequest, bytes]:
    endpoint = MemoryEndpoint(wire)
    return TaskLine(endpoint, *talking(endpoint, BAUD, None))


def chip_driver(wire: ChipWire, address: int | None = None, **options: Any) -> sync.M1486:
    """A blocking driver of a chip on the wire, opened."""
    driver = sync.M1486(chip_line(wire, options.pop("log", None)), address, **options)
    driver.open()
    return driver
