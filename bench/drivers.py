"""What a driver adds to an exchange, against pymodbus' clients: the same read, in turns, in one run.

The answer lies in the client's socket before it asks, so that nothing is waited for and nobody else's processor counts. What
sending and receiving the same bytes takes with nothing around it ("bare") is no overhead and taken off. Medians of many reads.
The pause that drivers leave between two frames to a device is switched off.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Awaitable, Callable, Generator
from statistics import median

from pymodbus.client import AsyncModbusTcpClient, ModbusTcpClient

from steptwin.drivers import AsyncMic488, AsyncModbusLine, Mic488, ModbusLine

READS = 4000
WARM_UP = 500
ADDRESS, COUNT = 10020, 10
GOAL = 0.7


class Peer:
    """The other end of a client's connection."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._number = 0
        self._socket: socket.socket | None = None

    def answer(self) -> None:
        """Send the answer to the next read."""
        if self._socket is None:
            self._socket = self._listener.accept()[0]
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._number = self._number % 0xFFFF + 1
        size = 2 * COUNT
        self._socket.sendall(self._number.to_bytes(2, "big") + bytes((0, 0, 0, size + 3, 1, 3, size)) + bytes(size))

    def check(self) -> None:
        """The read has come as expected."""
        expected = self._number.to_bytes(2, "big") + bytes((0, 0, 0, 6, 1, 3)) + ADDRESS.to_bytes(2, "big") + bytes((0, COUNT))
        if self._socket is None or self._socket.recv(64) != expected:
            raise RuntimeError("a client does not number its requests from 1, or asks for something else")

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._listener.close()


@contextlib.contextmanager
def peer() -> Generator[tuple[int, Peer]]:
    listener = socket.create_server(("127.0.0.1", 0))
    end = Peer(listener)
    try:
        yield listener.getsockname()[1], end
    finally:
        end.close()


def bare(port: int) -> Callable[[], object]:
    connected = socket.create_connection(("127.0.0.1", port))
    connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    number = 0

    def read() -> bytes:
        nonlocal number
        number += 1
        connected.sendall(number.to_bytes(2, "big") + bytes.fromhex("0000 0006 01 03 2724 000A"))
        return connected.recv(256)

    return read


def threads(samples: dict[str, list[float]]) -> None:
    with contextlib.ExitStack() as stack:
        ports, peers = zip(*(stack.enter_context(peer()) for _ in samples), strict=True)
        line = stack.enter_context(ModbusLine(f"tcp://127.0.0.1:{ports[1]}", frames_per_second=None))
        mic = Mic488(line, firmware="1.70")
        client = ModbusTcpClient("127.0.0.1", port=ports[2])
        client.connect()
        reads: list[Callable[[], object]] = [
            bare(ports[0]),
            lambda: mic.registers(ADDRESS, COUNT),
            lambda: client.read_holding_registers(ADDRESS, count=COUNT, device_id=1),
        ]
        for _ in range(READS):
            for end, read, seconds in zip(peers, reads, samples.values(), strict=True):
                end.answer()
                begin = time.perf_counter()
                read()
                seconds.append(time.perf_counter() - begin)
                end.check()
        client.close()


async def tasks(samples: dict[str, list[float]]) -> None:
    with contextlib.ExitStack() as stack:
        ports, peers = zip(*(stack.enter_context(peer()) for _ in samples), strict=True)
        client = AsyncModbusTcpClient("127.0.0.1", port=ports[2])
        await client.connect()
        async with AsyncModbusLine(f"tcp://127.0.0.1:{ports[1]}", frames_per_second=None) as line:
            mic = AsyncMic488(line, firmware="1.70")
            send = bare(ports[0])

            async def no_driver() -> object:
                return send()

            reads: list[Callable[[], Awaitable[object]]] = [
                no_driver,
                lambda: mic.registers(ADDRESS, COUNT),
                lambda: client.read_holding_registers(ADDRESS, count=COUNT, device_id=1),
            ]
            for _ in range(READS):
                for end, read, seconds in zip(peers, reads, samples.values(), strict=True):
                    end.answer()
                    begin = time.perf_counter()
                    await read()
                    seconds.append(time.perf_counter() - begin)
                    end.check()
        client.close()


def main() -> None:
    print(f"{'µs per exchange':<16}{'bare':>8}{'steptwin':>10}{'pymodbus':>10}   overhead, of pymodbus'")
    for name in ("threads", "tasks"):
        samples: dict[str, list[float]] = {"bare": [], "steptwin": [], "pymodbus": []}
        if name == "threads":
            threads(samples)
        else:
            asyncio.run(tasks(samples))
        nothing, ours, theirs = (1e6 * median(seconds[WARM_UP:]) for seconds in samples.values())
        ratio = (ours - nothing) / (theirs - nothing)
        print(f"{name:<16}{nothing:>8.1f}{ours:>10.1f}{theirs:>10.1f}   {ratio:.2f} (goal: at most {GOAL})")


if __name__ == "__main__":
    main()
