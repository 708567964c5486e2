"""Encrypted lines against a server of Python's own: what is trusted, and what is told when something is wrong."""

from __future__ import annotations

import asyncio
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tls_files import Authority

from steptwin.drivers import LineLost
from steptwin.drivers.lineaddress import LineAddress, parse_line_address
from steptwin.drivers.tls import TlsEndpoint
from steptwin.errors import Misuse


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tls")
    authority = Authority(folder)
    authority.sign("server")
    authority.sign("client")
    (folder / "other").mkdir()
    Authority(folder / "other").sign("client")
    return folder


def address(folder: Path, port: int, *, host: str = "127.0.0.1", **files: str) -> LineAddress:
    names = {"certificate": "client.pem", "key": "client.key", "trusted": "ca.pem", **files}
    options = "&".join(f"{name}={folder / file}" for name, file in names.items())
    return parse_line_address(f"tls://{host}:{port}?{options}", 38400)


Serve = Callable[[Callable[[ssl.SSLSocket], object]], int]


@pytest.fixture
def serve(folder: Path) -> Iterator[Serve]:
    """``serve(play)``: the port of a server that asks for certificates and gives its first client to ``play``."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "server.pem", folder / "server.key")
    context.load_verify_locations(folder / "ca.pem")
    context.verify_mode = ssl.CERT_REQUIRED
    threads: list[threading.Thread] = []
    listening = socket.create_server(("127.0.0.1", 0))

    def begin(play: Callable[[ssl.SSLSocket], object]) -> int:
        def run() -> None:
            try:
                connected, _ = listening.accept()
                with connected, context.wrap_socket(connected, server_side=True) as secured:
                    play(secured)
            except OSError:
                pass  # the client has gone, or nobody came

        threads.append(threading.Thread(target=run))
        threads[0].start()
        return listening.getsockname()[1]

    yield begin
    listening.shutdown(socket.SHUT_RDWR)
    listening.close()
    for thread in threads:
        thread.join()


def echo(secured: ssl.SSLSocket) -> None:
    while data := secured.recv(1000):
        secured.sendall(data)


@pytest.mark.parametrize("trusted", ["ca.pem", "server.pem"])
def test_bytes_go_to_and_fro(serve: Serve, folder: Path, trusted: str) -> None:
    """A certificate of the other end that is trusted itself needs no authority."""
    found = address(folder, port := serve(echo), trusted=trusted)
    assert (found.framed, found.serial) == (True, None)
    channel = found.endpoint.open()
    assert channel.read(0.0) == b""
    assert channel.read(0.001) == b""
    channel.write(b"ab")
    assert channel.read(30.0) == b"ab"
    channel.close()
    assert found.endpoint == TlsEndpoint(
        "tls", "127.0.0.1", port, *(str(folder / name) for name in ("client.pem", "client.key", trusted))
    )


def test_a_task_speaks_to_it_too(serve: Serve, folder: Path) -> None:
    async def main() -> bytes:
        heard: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        closed = asyncio.Event()

        class Ear(asyncio.Protocol):
            def data_received(self, data: bytes) -> None:
                heard.set_result(data)

            def connection_lost(self, exc: Exception | None) -> None:
                closed.set()

        transport = await address(folder, port).endpoint.connect(Ear)
        transport.write(b"ab")
        try:
            return await heard
        finally:
            transport.close()
            await closed.wait()

    port = serve(echo)
    assert asyncio.run(main()) == b"ab"


def test_the_other_end_closes(serve: Serve, folder: Path) -> None:
    port = serve(lambda secured: secured.unwrap())
    channel = address(folder, port).endpoint.open()
    with pytest.raises(LineLost, match=rf"^tls://127\.0\.0\.1:{port}: the other end closed the connection$"):
        channel.read(30.0)
    channel.close()


def test_the_other_end_takes_nothing_any_more(serve: Serve, folder: Path) -> None:
    done = threading.Event()
    channel = address(folder, serve(lambda secured: done.wait())).endpoint.open()

    def fill() -> None:
        for _ in range(1000):
            channel.write(bytes(100_000))

    with pytest.raises(LineLost, match=r": the other end takes nothing any more$"):
        fill()
    done.set()
    channel.close()


@pytest.mark.parametrize("way", ["thread", "task"])
@pytest.mark.parametrize(
    ("files", "why"),
    [
        ({"trusted": "other/ca.pem"}, r"cannot connect to tls://127\.0\.0\.1:\d+: self-signed certificate in certificate chain"),
        ({"host": "localhost"}, r"cannot connect to tls://localhost:\d+: .*'localhost'"),
    ],
)
def test_a_stranger_is_refused(serve: Serve, folder: Path, way: str, files: dict[str, str], why: str) -> None:
    """The certificate of the server is for 127.0.0.1 only."""
    endpoint = address(folder, serve(echo), **files).endpoint
    with pytest.raises(LineLost, match=why):
        endpoint.open() if way == "thread" else asyncio.run(endpoint.connect(asyncio.Protocol))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("files", "why"),
    [
        ({"trusted": "none.pem"}, r"trusted=.*none\.pem: no such file or directory$"),
        ({"trusted": "client.key"}, r"trusted=.*client\.key: "),
        ({"certificate": "none.pem"}, r"certificate=.*none\.pem, key=.*client\.key: no such file or directory$"),
        ({"key": "server.key"}, r"certificate=.*client\.pem, key=.*server\.key: "),
    ],
)
def test_files_that_cannot_be_used_are_told_before_anybody_is_called(folder: Path, files: dict[str, str], why: str) -> None:
    endpoint = address(folder, 1, **files).endpoint
    with pytest.raises(Misuse, match=r"^tls://127\.0\.0\.1:1: " + why):
        endpoint.open()
    with pytest.raises(Misuse, match=why):
        asyncio.run(endpoint.connect(asyncio.Protocol))  # type: ignore[arg-type]
