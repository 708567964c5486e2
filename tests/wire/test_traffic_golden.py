"""What ports make of whole requests, pieces, noise, foreign traffic and pauses: golden/traffic.txt.

Rules have their own tests; here streams drawn by chance are compared, each byte and moment. A case is ``=== name``, the kind of
port, then ``> microseconds port bytes``, what was received, each followed by what happened until the next. Regenerate with
``make golden ARGS=tests/wire/test_traffic_golden.py`` and read the diff.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from register_bank import RegisterBank

from steptwin.controller import MICROSECOND
from steptwin.wire import rtu
from steptwin.wire.gateway import ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

GOLDEN = Path(__file__).parent / "golden" / "traffic.txt"
BAUD = 38400


class Ports:
    """The ports of a kind with units 1 and 7 behind them, and what happens to them."""

    def __init__(self, kind: str) -> None:
        self.now = 0
        self.happened: list[str] = []
        units = {1: RegisterBank(), 7: RegisterBank()}
        timed = TimedUnits(units, LineTiming(SerialLine(BAUD), strict="strict" in kind))
        gateway = ModbusGateway(timed)
        options: dict[str, Any] = {"on_pause": lambda unit, pause: self._told(f"pause {unit} {pause}")}
        make: dict[str, Callable[[], list[Any]]] = {
            "rtu": lambda: [RtuSlavePort(units, **options)],
            "rtu with line": lambda: [RtuSlavePort(units, line=SerialLine(BAUD), **options)],
            "timed": lambda: [TimedRtuSlavePort(timed, **options)],
            "timed strict": lambda: [TimedRtuSlavePort(timed, **options)],
            "tcp": lambda: [TcpSlavePort(units)],
            "tcp alone": lambda: [TcpSlavePort({7: units[7]})],
            "gateway": lambda: [TcpGatewayPort(gateway), TcpGatewayPort(gateway), ScriptPort(gateway)],
        }
        self.ports = make[kind]()
        for number, port in enumerate(self.ports):
            port.on_write = lambda now, unit, asked, told, n=number: self._told(
                f"{n} write {unit} {asked.hex()} {told.hex()} {now}"
            )

    def _told(self, text: str) -> None:
        self.happened.append(text)

    def run(self, until: int) -> None:
        """Everything that is due, at its moment."""
        while True:
            deadlines = [due for port in self.ports if (due := port.deadline()) is not None]
            if not deadlines or min(deadlines) > until:
                break
            self.now = max(self.now, min(deadlines))
            self._send()
        self.now = until

    def _send(self) -> None:
        for number, port in enumerate(self.ports):
            for moment, data in port.to_send(self.now):
                self._told(f"{number} {self.now} {moment} {data.hex()}")

    def receive(self, number: int, data: bytes) -> None:
        if answer := self.ports[number].exchange(data, self.now):
            self._told(f"{number} {self.now} = {answer.hex()}")
        if self.ports[number].broken:
            self._told(f"{number} broken: {self.ports[number].broken}")

    def counts(self) -> str:
        return "; ".join(
            f"{p.requests} requests, {p.exceptions} refused, {p.lost} lost, {p.unframed} unframed" for p in self.ports
        )


class Listener:
    """All frames of a line between others, and how many bytes were in none."""

    def __init__(self, kind: str) -> None:
        own = (1,) if "own" in kind else ()
        self.now = 0
        self.happened: list[str] = []
        self._framer = rtu.RtuFramer(own, pause_ns=100_000 * MICROSECOND)

    def run(self, until: int) -> None:
        while (due := self._framer.deadline()) is not None and due <= until:
            self.now = due
            self._take(self._framer.expire(due))
        self.now = until

    def receive(self, number: int, data: bytes) -> None:
        self._take(self._framer.feed(data, self.now, self.now + len(data) * 260 * MICROSECOND))

    def _take(self, frames: list[rtu.RtuFrame]) -> None:
        self.happened += [f"{self.now} {f.role.value} {f.raw.hex()} {f.end} {f.begin} {f.pause}" for f in frames]

    def counts(self) -> str:
        return f"{self._framer.fed} bytes, {self._framer.unframed} unframed, {len(self._framer.held)} held"


def told(kind: str, script: list[str]) -> Iterator[str]:
    ends = Listener(kind) if kind.startswith("listener") else Ports(kind)
    yield kind
    for line in script:
        moment, number, *data = line[2:].split()
        ends.run(int(moment) * MICROSECOND)
        yield from (f"  {text}" for text in ends.happened)
        del ends.happened[:]
        yield line
        ends.receive(int(number), bytes.fromhex("".join(data)))
    ends.run(ends.now + 5_000_000 * MICROSECOND)
    yield from (f"  {text}" for text in ends.happened)
    yield f"  {ends.counts()}"


def cases() -> list[tuple[str, list[str]]]:
    found = []
    for part in GOLDEN.read_text(encoding="utf-8").split("=== ")[1:]:
        name, *lines = part.strip().splitlines()
        found.append((name, lines))
    return found


@pytest.mark.parametrize(("name", "lines"), cases(), ids=[name for name, _ in cases()])
def test_traffic_is_answered_as_reviewed(name: str, lines: list[str]) -> None:
    assert list(told(lines[0], [line for line in lines if line.startswith(">")])) == lines


if __name__ == "__main__":
    new = [
        f"=== {name}\n" + "\n".join(told(lines[0], [line for line in lines if line.startswith(">")])) for name, lines in cases()
    ]
    GOLDEN.write_text("\n\n".join(new) + "\n", encoding="utf-8")
