"""One grammar of addresses."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, NoReturn, cast

import pytest

from steptwin.drivers import LineLost, tcp
from steptwin.drivers.lineaddress import SerialChannel, SerialEndpoint, parse_line_address
from steptwin.drivers.tcp import SocketChannel, TcpEndpoint, TimedSocketChannel
from steptwin.errors import Misuse
from steptwin.wire.line import SerialLine


def test_addresses() -> None:
    found = parse_line_address("tcp://127.0.0.1:5020", 38400)
    assert (found.endpoint, found.framed, found.serial) == (TcpEndpoint("tcp", "127.0.0.1", 5020), True, None)
    assert parse_line_address("tcp://host", 38400).endpoint == TcpEndpoint("tcp", "host", 502)
    found = parse_line_address("rtu-tcp://[::1]:5021", 38400)
    assert (str(found.endpoint), found.framed) == ("rtu-tcp://[::1]:5021", False)
    found = parse_line_address("/dev/ttyUSB0", 9600)
    assert (found.endpoint, found.framed, found.serial) == (SerialEndpoint("/dev/ttyUSB0", 9600), False, SerialLine(9600))
    found = parse_line_address("rfc2217://127.0.0.1:2217", 9600)
    assert (str(found.endpoint), found.framed, found.serial) == ("rfc2217://127.0.0.1:2217", False, SerialLine(9600))
    assert str(parse_line_address("COM3", 9600).endpoint) == "COM3"


@pytest.mark.parametrize(
    "text",
    [
        *("", "127.0.0.1:5020", "http://x:1", "rtu-tcp://host", "tcp://", "tcp://h:99999", "tcp://h:1/x"),
        *("tcp://h:1?key=k", "tls://h:1", "tls://h:1?certificate=c&key=k"),
        *("tls://h:1?certificate=c&key=k&trusted=t&x=", "tls://h:1?certificate=c&key=k&trusted="),
    ],
)
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(Misuse, match=r"address|names no port"):
        parse_line_address(text, 38400)


def test_what_is_no_baud_rate() -> None:
    with pytest.raises(Misuse, match="5 bit/s is outside 300 to 1000000"):
        parse_line_address("/dev/ttyUSB0", 5)


@pytest.fixture
def closed_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def test_nobody_listens(closed_port: int) -> None:
    found = parse_line_address(f"tcp://127.0.0.1:{closed_port}", 38400)
    with pytest.raises(LineLost, match=f"cannot connect to tcp://127.0.0.1:{closed_port}: connection refused"):
        found.endpoint.open()
    with pytest.raises(LineLost, match="connection refused"):
        asyncio.run(found.endpoint.connect(asyncio.Protocol))


def test_no_such_port() -> None:
    endpoint = parse_line_address("/dev/none", 38400).endpoint
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


@pytest.mark.parametrize("kind", [SocketChannel, TimedSocketChannel])
def test_a_socket_is_read_with_a_time_out(
    kind: type[SocketChannel], listener: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tcp, "CHANNEL", kind)
    go = threading.Event()

    def talk(client: socket.socket) -> None:
        assert client.recv(9) == b"ask"
        client.sendall(b"answer")
        assert client.recv(9) == b"again"
        client.sendall(b"another")
        go.wait(60)

    channel = parse_line_address(listener(talk), 38400).endpoint.open()
    assert channel.read(0.0) == b""
    assert channel.read(0.01) == b""
    channel.write(b"ask")
    assert channel.read(60.0) == b"answer"
    channel.write(b"again")
    assert channel.read(30.0) == b"another"
    assert channel.read(-1.0) == b""
    assert isinstance(channel, SocketChannel)
    assert channel._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    assert channel._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    with pytest.raises(LineLost, match="the other end takes nothing any more"):
        channel.write(bytes(100 << 20))
    go.set()
    with pytest.raises(LineLost, match=r"the other end closed the connection|connection reset by peer"):
        channel.read(60.0)
    channel.close()


@pytest.mark.parametrize("kind", [SocketChannel, TimedSocketChannel])
def test_a_socket_that_was_closed_is_not_written_to(
    kind: type[SocketChannel], listener: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tcp, "CHANNEL", kind)
    address = listener(lambda client: None)
    channel = parse_line_address(address, 38400).endpoint.open()
    with pytest.raises(LineLost, match="the other end closed the connection"):
        channel.read(60.0)
    with pytest.raises(LineLost, match=rf"{address}: (broken pipe|connection reset by peer)"):  # noqa: PT012
        for _ in range(100):
            channel.write(b"x")
            time.sleep(0.01)
    channel.close()


def test_a_port_is_read_with_a_time_out() -> None:
    master, slave = os.openpty()
    try:
        channel = parse_line_address(os.ttyname(slave), 38400).endpoint.open()
        assert channel.read(0.0) == b""
        channel.write(b"ask")
        assert os.read(master, 9) == b"ask"
        os.write(master, b"answer")
        assert channel.read(60.0) == b"answer"
        os.close(master)
        with pytest.raises(LineLost, match=r"serial port /dev/.* was lost"):  # noqa: PT012
            for _ in range(100):
                channel.write(b"x")
                channel.read(0.1)
        channel.close()
    finally:
        os.close(slave)


def test_a_port_that_fails_in_any_way_is_lost() -> None:
    """Platforms raise different errors. A time-out is never negative."""
    waited: list[float] = []

    class Port:
        def write(self, data: bytes, timeout: float) -> NoReturn:
            raise OSError(errno.EIO, "Input/output error")

        def readinto(self, buffer: bytearray, timeout: float) -> NoReturn:
            waited.append(timeout)
            raise ValueError("the device sends nonsense")

    channel: Any = SerialChannel(cast(Any, Port()), "COM3")
    with pytest.raises(LineLost, match=r"^serial port COM3 was lost: .*input/output error"):
        channel.write(b"x")
    for timeout_s in (0.5, -1.0):
        with pytest.raises(LineLost, match=r"^serial port COM3 was lost: the device sends nonsense"):
            channel.read(timeout_s)
    assert waited == [0.5, 0.0]


def test_a_socket_with_a_time_out_waits_only_to_read() -> None:
    """As on Windows: what is sent does not wait, and a time-out is never negative."""
    waits: list[float] = []

    class Socket:
        def setsockopt(self, *options: int) -> None: ...
        def setblocking(self, flag: bool) -> None: ...
        def settimeout(self, seconds: float) -> None:
            waits.append(seconds)

        def send(self, data: bytes) -> int:
            return len(data)

        def recv(self, most: int) -> bytes:
            return b"x" if waits[-1] else b""

    channel = TimedSocketChannel(cast(Any, Socket()), "tcp://h:1")
    channel.write(b"ask")
    assert channel.read(2.5) == b"x"
    for timeout_s in (0.0, -1.0):
        with pytest.raises(LineLost):
            channel.read(timeout_s)
    assert waits == [0.0, 2.5, 0.0, 0.0]


def test_a_port_is_used_by_tasks() -> None:
    master, slave = os.openpty()
    heard = bytearray()
    whole = asyncio.Event()

    class Hears(asyncio.Protocol):
        def data_received(self, data: bytes) -> None:
            heard.extend(data)
            if heard == b"answer":
                whole.set()

    async def main() -> None:
        transport = await parse_line_address(os.ttyname(slave), 38400).endpoint.connect(Hears)
        transport.write(b"ask")
        assert await asyncio.to_thread(os.read, master, 9) == b"ask"
        os.write(master, b"answer")
        await asyncio.wait_for(whole.wait(), 60)
        transport.close()

    try:
        asyncio.run(main())
    finally:
        os.close(master)
        os.close(slave)


def test_a_connection_is_used_by_tasks(listener: Callable[[Callable[[socket.socket], None]], str]) -> None:
    def talk(client: socket.socket) -> None:
        assert client.recv(9) == b"ask"
        client.sendall(b"answer")

    address = listener(talk)

    async def main() -> bytes:
        heard: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()

        class Hears(asyncio.Protocol):
            def data_received(self, data: bytes) -> None:
                heard.set_result(data)

        transport = await parse_line_address(address, 38400).endpoint.connect(Hears)
        transport.write(b"ask")
        answer = await asyncio.wait_for(heard, 60)
        transport.close()
        return answer

    assert asyncio.run(main()) == b"answer"


def test_an_end_that_does_not_answer_is_waited_for_three_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []

    def silent(address: object, timeout_s: float) -> socket.socket:
        waited.append(timeout_s)
        raise TimeoutError

    monkeypatch.setattr(socket, "create_connection", silent)
    with pytest.raises(LineLost, match=r"^cannot connect to tcp://127\.0\.0\.1:9: no answer within 3 s$"):
        TcpEndpoint("tcp", "127.0.0.1", 9).open()
    assert waited == [3.0]
