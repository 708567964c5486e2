"""Network serial ports at servers that do not confirm the masks, as ser2net 4.3.11. Bytes are those of RFC 854 and RFC 2217."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import threading
from collections.abc import Callable, Iterator

import pytest

from steptwin.drivers import LineLost
from steptwin.drivers.lineaddress import SerialEndpoint

SE, SB, WILL, DO, IAC = 240, 250, 251, 253, 255
COM_PORT = 44
SET_BAUDRATE, SET_LINESTATE_MASK, SET_MODEMSTATE_MASK, OF_SERVER = 1, 10, 11, 100
NOTIFY_MODEMSTATE = bytes((IAC, SB, COM_PORT, 107, 0, IAC, SE))
SENT = re.compile(rb"\xff([\xfb-\xfe])(.)|\xff\xfa(.)(.)((?:[^\xff]|\xff\xff)*)\xff\xf0|([^\xff]+)", re.DOTALL)


class Server:
    """A port whose line gives back what it is given. It confirms all but the masks, and hangs up at the request ``leaves_at``."""

    def __init__(self, leaves_at: int | None = None) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"rfc2217://127.0.0.1:{self._listener.getsockname()[1]}"
        self._leaves_at = leaves_at
        self.asked: dict[int, bytes] = {}
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        client, _ = self._listener.accept()
        with client, contextlib.suppress(ConnectionError):  # what a client has not read when it closes is a reset
            client.settimeout(60)
            held = b""
            while data := client.recv(4096):
                held += data
                while found := SENT.match(held):
                    held = held[found.end() :]
                    verb, option, _, command, value, line = found.groups()
                    if line:
                        client.sendall(line)
                    elif verb:
                        client.sendall(bytes((IAC, DO if verb[0] == WILL else WILL)) + option)
                    elif command[0] == self._leaves_at:
                        return
                    else:
                        self.asked[command[0]] = value
                        client.sendall(self._answer(command[0], value))

    def _answer(self, command: int, value: bytes) -> bytes:
        if command == SET_MODEMSTATE_MASK:
            return NOTIFY_MODEMSTATE
        if command == SET_LINESTATE_MASK:
            return b""
        return bytes((IAC, SB, COM_PORT, command + OF_SERVER)) + value + bytes((IAC, SE))

    def end(self) -> None:
        self._listener.close()
        self._thread.join(60)
        assert not self._thread.is_alive()


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    servers: list[Server] = []

    def start(leaves_at: int | None = None) -> Server:
        servers.append(Server(leaves_at))
        return servers[-1]

    yield start
    for server in servers:
        server.end()


class Listener(asyncio.Protocol):
    def __init__(self) -> None:
        self.heard = bytearray()
        self.has_heard = asyncio.Event()
        self.has_ended = asyncio.Event()

    def data_received(self, data: bytes) -> None:
        self.heard += data
        self.has_heard.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self.has_ended.set()


def by_thread(url: str) -> bytes:
    channel = SerialEndpoint(url, 9600).open()
    try:
        channel.write(b"u20\r")
        heard = b""
        while len(heard) < 4:
            heard += channel.read(60.0)
        return heard
    finally:
        channel.close()


def by_task(url: str) -> bytes:
    async def talk() -> bytes:
        listener = Listener()
        transport = await SerialEndpoint(url, 9600).connect(lambda: listener)
        transport.write(b"u20\r")
        while len(listener.heard) < 4:
            listener.has_heard.clear()
            await asyncio.wait_for(listener.has_heard.wait(), 60)
        transport.close()
        await asyncio.wait_for(listener.has_ended.wait(), 60)
        return bytes(listener.heard)

    return asyncio.run(talk())


WAYS = pytest.mark.parametrize("talk", [by_thread, by_task])


@WAYS
def test_a_port_whose_server_confirms_no_masks_is_used(serve: Callable[..., Server], talk: Callable[[str], bytes]) -> None:
    server = serve()
    assert talk(server.url) == b"u20\r"
    assert server.asked[SET_BAUDRATE] == (9600).to_bytes(4, "big")
    assert {SET_LINESTATE_MASK, SET_MODEMSTATE_MASK} <= set(server.asked)


@WAYS
def test_the_rate_has_to_be_confirmed(serve: Callable[..., Server], talk: Callable[[str], bytes]) -> None:
    server = serve(leaves_at=SET_BAUDRATE)
    with pytest.raises(LineLost, match=f"^cannot open serial port {server.url} at 9600 bit/s: "):
        talk(server.url)
