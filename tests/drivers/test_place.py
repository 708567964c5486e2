"""One grammar of addresses."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
from collections.abc import Callable

import pytest

from steptwin.drivers import LineLost
from steptwin.drivers.place import SerialEndpoint, TcpEndpoint, parse_place
from steptwin.errors import Misuse
from steptwin.wire.line import SerialLine


def test_addresses() -> None:
    place = parse_place("tcp://127.0.0.1:5020", 38400)
    assert (place.endpoint, place.framed, place.serial) == (TcpEndpoint("tcp", "127.0.0.1", 5020), True, None)
    assert parse_place("tcp://host", 38400).endpoint == TcpEndpoint("tcp", "host", 502)
    place = parse_place("rtu-tcp://[::1]:5021", 38400)
    assert (str(place.endpoint), place.framed) == ("rtu-tcp://[::1]:5021", False)
    place = parse_place("/dev/ttyUSB0", 9600)
    assert (place.endpoint, place.framed, place.serial) == (SerialEndpoint("/dev/ttyUSB0", 9600), False, SerialLine(9600))
    assert str(parse_place("rfc2217://127.0.0.1:2217", 9600).endpoint) == "rfc2217://127.0.0.1:2217"
    assert str(parse_place("COM3", 9600).endpoint) == "COM3"


@pytest.mark.parametrize("text", ["", "127.0.0.1:5020", "http://x:1", "rtu-tcp://host", "tcp://", "tcp://h:99999", "tcp://h:1/x"])
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(Misuse, match=r"address|names no port"):
        parse_place(text, 38400)


def test_what_is_no_baud_rate() -> None:
    with pytest.raises(Misuse, match="5 bit/s is outside 300 to 1000000"):
        parse_place("/dev/ttyUSB0", 5)


@pytest.fixture
def closed_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def test_nobody_listens(closed_port: int) -> None:
    place = parse_place(f"tcp://127.0.0.1:{closed_port}", 38400)
    with pytest.raises(LineLost, match=f"cannot connect to tcp://127.0.0.1:{closed_port}: connection refused"):
        place.endpoint.open()
    with pytest.raises(LineLost, match="connection refused"):
        asyncio.run(place.endpoint.connect(asyncio.Protocol))


def test_no_such_port() -> None:
    endpoint = parse_place("/dev/none", 38400).endpoint
    with pytest.raises(LineLost, match="cannot open serial port /dev/none at 38400 bit/s: no such file or directory"):
        endpoint.open()
    with pytest.raises(LineLost, match="no such file or directory"):
        asyncio.run(endpoint.connect(asyncio.Protocol))


@pytest.fixture
def listener() -> Callable[[Callable[[socket.socket], None]], str]:
    def listen(talk: Callable[[socket.socket], None]) -> str:
        server = socket.create_server(("127.0.0.1", 0))

        def serve() -> None:
            with server, server.accept()[0] as client:
                talk(client)

        threading.Thread(target=serve, daemon=True).start()
        return f"tcp://127.0.0.1:{server.getsockname()[1]}"

    return listen


def test_a_socket_is_read_with_a_time_out(listener: Callable[..., str]) -> None:
    go = threading.Event()

    def talk(client: socket.socket) -> None:
        assert client.recv(9) == b"ask"
        client.sendall(b"answer")
        go.wait(60)

    channel = parse_place(listener(talk), 38400).endpoint.open()
    assert channel.read(0.0) == b""
    channel.write(b"ask")
    assert channel.read(60.0) == b"answer"
    go.set()
    with pytest.raises(LineLost, match="the other end closed the connection"):
        channel.read(60.0)
    channel.close()


def test_a_port_is_read_with_a_time_out() -> None:
    master, slave = os.openpty()
    try:
        channel = parse_place(os.ttyname(slave), 38400).endpoint.open()
        assert channel.read(0.0) == b""
        channel.write(b"ask")
        assert os.read(master, 9) == b"ask"
        os.write(master, b"answer")
        assert channel.read(60.0) == b"answer"
        os.close(master)
        with pytest.raises(LineLost, match=r"serial port /dev/.* is gone"):  # noqa: PT012
            for _ in range(100):
                channel.write(b"x")
                channel.read(0.1)
        channel.close()
    finally:
        os.close(slave)
