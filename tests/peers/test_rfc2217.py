"""A served twin as a network serial port, as pyserial, ser2net and our driver use it."""

from __future__ import annotations

import asyncio
import json
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import serial

from steptwin.drivers import AsyncMic488, Mic488
from steptwin.drivers.m1486 import M1486, M1486Line
from steptwin.errors import LineFailure

READ_POSITION = bytes.fromhex("01 03 27 24 00 02 8E B4")
AT_ZERO = bytes.fromhex("01 03 04 00 00 00 00 FA 33")


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def network_port(twin: Any) -> int:
    points = json.loads(twin.ready_file.read_text())["end_points"]
    return next(point["port"] for point in points if point["kind"] == "rfc2217")


@pytest.fixture
def ser2net(require_peer: Callable[[str], str], tmp_path: Path) -> Iterator[Callable[[str, str], None]]:
    """``ser2net(accepter, connector)`` joins the two."""
    program = require_peer("ser2net")
    with ExitStack() as stack:

        def start(accepter: str, connector: str) -> None:
            config = tmp_path / "ser2net.yaml"
            config.write_text(f"connection: &twin\n  accepter: {accepter}\n  connector: {connector}\n")
            process = stack.enter_context(subprocess.Popen([program, "-d", "-u", "-c", str(config)], stderr=subprocess.DEVNULL))
            stack.callback(process.kill)

        yield start


def connected(address: str) -> Mic488:
    """A driver, as soon as somebody listens and answers there."""
    deadline = time.monotonic() + 60.0
    while True:
        mic = Mic488(address, timeout_s=2.0)
        try:
            mic.open()
        except LineFailure:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
        else:
            return mic


@pytest.mark.peers
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
def test_pyserial_sees_a_port(serve: Callable[..., Any]) -> None:
    twin = serve("--demo", "--rfc2217", "127.0.0.1:0")
    with serial.serial_for_url(f"rfc2217://127.0.0.1:{network_port(twin)}", 9600, timeout=60) as port:
        port.write(READ_POSITION)
        assert port.read(len(AT_ZERO)) == AT_ZERO
        port.baudrate = 115200
        port.parity = serial.PARITY_EVEN
        port.dtr = False
        port.reset_input_buffer()
        assert (port.cts, port.dsr, port.cd, port.ri) == (True, True, True, False)
        port.write(READ_POSITION)
        assert port.read(len(AT_ZERO)) == AT_ZERO


def test_our_driver_sees_a_port(serve: Callable[..., Any]) -> None:
    twin = serve("--demo", "--rfc2217", "127.0.0.1:0")
    with connected(f"rfc2217://127.0.0.1:{network_port(twin)}") as mic:
        mic.enable(1)
        mic.axis(1).move_to(0.5)
        assert mic.axis(1).wait().ok
        # A byte 255 is doubled on its way in both directions.
        mic.user.words.write_many(0, [0xFFFF] * 20)
        assert mic.user.words.read_many(0, 20) == [0xFFFF] * 20


def test_ser2net_sees_a_port(serve: Callable[..., Any], ser2net: Callable[[str, str], None]) -> None:
    twin = serve("--demo", "--rfc2217", "127.0.0.1:0")
    port = free_port()
    ser2net(f"tcp,127.0.0.1,{port}", f"telnet(rfc2217),tcp,127.0.0.1,{network_port(twin)}")
    with connected(f"rtu-tcp://127.0.0.1:{port}") as mic:
        mic.user.words.write_many(0, [0xFFFF, 0x00FF] * 10)
        assert mic.user.words.read_many(0, 20) == [0xFFFF, 0x00FF] * 10


@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
def test_ser2net_passes_the_port_on(serve: Callable[..., Any], ser2net: Callable[[str, str], None]) -> None:
    """pyserial sets a port that ser2net offers, and ser2net sets ours."""
    twin = serve("--demo", "--rfc2217", "127.0.0.1:0")
    port = free_port()
    ser2net(f"telnet(rfc2217),tcp,127.0.0.1,{port}", f"telnet(rfc2217),tcp,127.0.0.1,{network_port(twin)}")
    with opened(f"rfc2217://127.0.0.1:{port}") as passed_on:
        passed_on.baudrate = 19200
        passed_on.write(READ_POSITION)
        assert passed_on.read(len(AT_ZERO)) == AT_ZERO


def test_our_drivers_use_a_port_of_ser2net(serve: Callable[..., Any], ser2net: Callable[[str, str], None]) -> None:
    """It does not confirm SET-MODEMSTATE-MASK."""
    twin = serve("--demo")
    port = free_port()
    ser2net(f"telnet(rfc2217),tcp,127.0.0.1,{port}", f"serialdev,{twin.pty.resolve()},9600n81,local")
    address = f"rfc2217://127.0.0.1:{port}"
    with connected(address) as mic:
        mic.user.words.write_many(0, [0xFFFF, 0x00FF] * 10)

    async def read() -> list[int]:
        async with AsyncMic488(address, timeout_s=2.0) as mic:
            return await mic.user.words.read_many(0, 4)

    assert asyncio.run(read()) == [0xFFFF, 0x00FF, 0xFFFF, 0x00FF]


@pytest.mark.peers
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
def test_chips_behind_a_port_are_talked_to_by_pyserial_and_by_our_driver(serve_m1486: Callable[..., Any]) -> None:
    """They speak unasked: what U uploads comes when a move has ended."""
    twin = serve_m1486("--variant", "B", "--chain", "0,7", "--rfc2217", "127.0.0.1:0")
    address = f"rfc2217://127.0.0.1:{network_port(twin)}"
    with serial.serial_for_url(address, 4800, timeout=60) as port:
        port.write(b"x7\rf16320\rr\ru1\r")
        assert port.read(1) == bytes([16320 & 0xFF])
    with M1486Line(address) as line:
        chip = M1486(line, 7)
        chip.open()
        assert chip.counter() == 16320
        chip.move_by(-255.0)
        assert chip.wait().ok
        assert chip.counter() == 0


def opened(address: str) -> serial.Serial:
    """The port, as soon as somebody listens there."""
    deadline = time.monotonic() + 60.0
    while True:
        try:
            return serial.serial_for_url(address, 9600, timeout=60)
        except serial.SerialException:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)
