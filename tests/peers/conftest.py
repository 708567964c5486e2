"""A Modbus master made of pymodbus. Addresses are those of firmware 1.70 as the manual lists them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any, NamedTuple

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.client.base import ModbusBaseSyncClient

FLOAT = ModbusTcpClient.DATATYPE.FLOAT32


class Sample(NamedTuple):
    """What the master saw: position and velocity between two moments of its own clock, the status just before."""

    before: float
    after: float
    position: float
    velocity: float
    status: int


class Master:
    """A pymodbus client that speaks of axes (from 1) and configured units."""

    def __init__(self, client: ModbusBaseSyncClient, unit: int = 1) -> None:
        self.client = client
        self.unit = unit

    # ------------------------------------------------------------------ requests

    def coil(self, address: int, on: bool) -> None:
        assert not self.client.write_coil(address, on, device_id=self.unit).isError()

    def word(self, address: int, value: int) -> None:
        assert not self.client.write_register(address, value, device_id=self.unit).isError()

    def reals(self, address: int, *values: float) -> None:
        """REAL values into successive registers, the low word first."""
        words = [word for v in values for word in self.client.convert_to_registers(v, FLOAT, word_order="little")]
        assert not self.client.write_registers(address, words, device_id=self.unit).isError()

    def words(self, address: int, count: int = 1) -> list[int]:
        response = self.client.read_holding_registers(address, count=count, device_id=self.unit)
        assert not response.isError()
        return list(response.registers)

    def inputs(self, address: int, count: int) -> list[bool]:
        response = self.client.read_discrete_inputs(address, count=count, device_id=self.unit)
        assert not response.isError()
        return list(response.bits[:count])

    def real(self, words: list[int]) -> float:
        value: Any = self.client.convert_from_registers(words, FLOAT, word_order="little")
        return value

    # ------------------------------------------------------------------ axes

    def enable(self, axis: int) -> None:
        self.coil(2000 + axis - 1, True)

    def stop(self, axis: int) -> None:
        self.coil(2004 + axis - 1, True)

    def jog(self, axis: int, direction: int, on: bool) -> None:
        self.coil(2008 + 2 * (axis - 1) + (direction < 0), on)

    def dynamics(self, axis: int, acc: float, dec: float, vmax: float) -> None:
        for address, value in ((10036, acc), (10044, dec), (10052, vmax)):
            self.reals(address + 2 * (axis - 1), value)

    def home(self, axis: int, velocity: float) -> None:
        self.reals(10060 + 2 * (axis - 1), velocity)

    def run(self, axis: int, velocity: float) -> None:
        self.reals(10068 + 2 * (axis - 1), velocity)

    def move(self, axis: int, position: float) -> None:
        self.reals(10084 + 2 * (axis - 1), position)

    def status(self, axis: int) -> int:
        return self.words(10010 + axis - 1)[0]

    def sample(self, axis: int) -> Sample:
        """Status of an axis, then position and velocity in one request."""
        status = self.status(axis)
        before = time.monotonic()
        words = self.words(10020, 16)
        after = time.monotonic()
        position, velocity = (self.real(words[at : at + 2]) for at in (2 * axis - 2, 2 * axis + 6))
        return Sample(before, after, position, velocity, status)

    def follow(self, axis: int, *statuses: int, seconds: float = 60.0) -> list[Sample]:
        """Samples of an axis while its status is one of these, and one more."""
        deadline = time.monotonic() + seconds
        samples = [self.sample(axis)]
        while samples[-1].status in statuses:
            assert time.monotonic() < deadline, samples[-1]
            samples.append(self.sample(axis))
        return samples


@pytest.fixture
def connect() -> Iterator[Callable[..., Master]]:
    """``connect(port)`` gives a master on a Modbus TCP port."""
    with ExitStack() as stack:

        def open_(port: int, unit: int = 1) -> Master:
            client = ModbusTcpClient("127.0.0.1", port=port, timeout=60, retries=0)
            assert client.connect()
            stack.callback(client.close)
            return Master(client, unit)

        yield open_


@pytest.fixture
def master(serve: Callable[..., Any], connect: Callable[..., Master]) -> Master:
    """A master on the demo: four spindles with 100 imp/mm, KL at −10 mm, KR at 250 mm, HOME1."""
    return connect(serve("--demo").tcp_port)
