"""Chips on one serial line: all receive the host's characters, and all send on the same wire (manual chapter II, Serial
interface).

How a shell builds a line::

    chips = [M1486Chip(variant("B"), address=0, interface=STEP_DIRECTION, baud=4800), M1486Chip(variant("B"), address=7)]
    chain = SerialChain(chips)
    port = chain.port()  # one for each program that is connected
    port.exchange(b"x7\\rf12800\\rr\\r", now)
    port.to_send(later)  # [(moment, characters)], the same for every port

Chips are controllers of their own: a shell adds each to its `steptwin.simulation.scheduler.scheduler.Scheduler` and advances that
before it hands over characters. Its actions are reported by its hooks (`steptwin.m1486.chip.M1486Chip`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import ClassVar

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.uart import MOST_WAITING
from steptwin.messages import Message
from steptwin.state import Stateful

ADDRESS_TWICE = Message("m1486.address-twice", "two chips with address {address:X} on one line")
NO_CHIP = Message("m1486.no-chip", "a chain needs at least one chip")
DIFFERENT_BAUD_RATES = Message("m1486.different-baud-rates", "chips with different baud rates on one line: {rates} bit/s")
DIFFERENT_LINE_TIMING = Message("m1486.different-line-timing", "chips with and without line timing on one line")


class SerialChain(Stateful):
    """Up to sixteen chips with addresses of their own, in the order given. Its own state is that of the wire.

    M-33: outputs on one wire pull it low together. Characters that chips begin at the same moment come to the host as one,
    their bitwise AND; a character that begins while another chip's is on the wire is lost and counted in ``collisions``. While
    no program is connected, nothing is kept of what they send.
    Raises `Misuse` for two chips with the same address, or with different baud rates or line timing.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("_ports", "chips")
    __slots__ = (*FIXED, "_wire_free", "collisions")

    def __init__(self, chips: Iterable[M1486Chip]) -> None:
        self.chips: dict[int, M1486Chip] = {}
        """By the address each had when the line was made."""
        for chip in chips:
            if chip.address in self.chips:
                raise Misuse(ADDRESS_TWICE(address=chip.address))
            self.chips[chip.address] = chip
        if not self.chips:
            raise Misuse(NO_CHIP())
        rates = {chip.uart.baud for chip in self.chips.values()}
        if len(rates) > 1:
            raise Misuse(DIFFERENT_BAUD_RATES(rates=sorted(rates)))
        if len({chip.is_timed for chip in self.chips.values()}) > 1:
            raise Misuse(DIFFERENT_LINE_TIMING())
        self._ports: list[LinePort] = []
        self._wire_free: Nanos = 0
        self.collisions = 0
        for chip in self.chips.values():
            chip.on_sent = self._wake_ports

    def port(self) -> LinePort:
        """A port of the line for one more program. Every port receives all characters of the chips from now on."""
        if self._ports:  # the first one also receives the characters that chips sent when they were made
            self.collect(max(chip.now for chip in self.chips.values()))
        port = LinePort(self)
        self._ports.append(port)
        return port

    def leave(self, port: LinePort) -> None:
        if port in self._ports:
            self._ports.remove(port)

    def receive(self, data: bytes, now: Nanos) -> None:
        """Every chip receives what the host sends."""
        for chip in self.chips.values():
            chip.receive(data, now)

    def collect(self, now: Nanos) -> None:
        """Give the ports the characters that have left the chips by ``now``."""
        merged = self._merged(now)
        for port in self._ports:
            port.keep(merged)

    def departure(self) -> Nanos | None:
        """The end of the next character from a chip."""
        deadlines = (chip.uart.departure() for chip in self.chips.values())
        return min((due for due in deadlines if due is not None), default=None)

    def _merged(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        together: dict[tuple[Nanos, int], int] = {}
        for chip in self.chips.values():
            chip.advance(now)
            # Without line timing a chip sends several characters at one moment: the first of one chip meets the first of another.
            moment, rank = -1, 0
            for sent, byte in chip.uart.take_sent():
                moment, rank = sent, rank + 1 if sent == moment else 0
                together[moment, rank] = together.get((moment, rank), 0xFF) & byte
        merged: list[tuple[Nanos, bytes]] = []
        for (moment, _), byte in sorted(together.items()):
            if moment - self._character_ns() < self._wire_free:
                self.collisions += 1
                continue
            self._wire_free = moment
            merged.append((moment, bytes((byte,))))
        return merged

    def _character_ns(self) -> Nanos:
        return next(iter(self.chips.values())).uart.character_ns

    def _wake_ports(self) -> None:
        if not self._ports:
            for chip in self.chips.values():
                chip.uart.take_sent()
        for port in self._ports:
            port.wake()


class LinePort:
    """The port of one program; a `steptwin.controller.SendingPort`.

    ``on_output`` is called for unsolicited output.
    """

    broken = None
    """Always None: traffic cannot break a serial line."""

    def __init__(self, chain: SerialChain) -> None:
        self._chain = chain
        self.pending: list[tuple[Nanos, bytes]] = []
        """Characters not fetched yet; at most the last `MOST_WAITING`."""
        self.on_output: Callable[[], None] | None = None

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        """Send ``data`` to the chips; returns `to_send`."""
        self._chain.receive(data, now)
        return b"".join(data for _, data in self.to_send(now))

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        """Characters that the chips have sent by ``now`` and this port has not fetched, each with the moment of its end."""
        self._chain.collect(now)
        pending, self.pending = self.pending, []
        return pending

    def keep(self, sent: list[tuple[Nanos, bytes]]) -> None:
        """Keep characters until they are fetched."""
        self.pending += sent
        if len(self.pending) > MOST_WAITING:
            del self.pending[:-MOST_WAITING]

    def deadline(self) -> Nanos | None:
        """The end of the next character in transmission. For others ``on_output`` is called."""
        return self._chain.departure()

    def wake(self) -> None:
        if self.on_output is not None:
            self.on_output()

    def close(self) -> None:
        """The program at the other end has closed the connection."""
        self.on_output = None
        self._chain.leave(self)
