"""TCP links: many clients, clients that vanish, flood, never read or make no sense."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import re
import socket
import struct
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from steptwin.controller import Nanos
from steptwin.errors import LineFailure
from steptwin.live.clients import RETRY_S, Clients
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.tcp import LISTENER, Listener, TcpLink
from steptwin.live.tcp_asyncio import AsyncioListener
from steptwin.live.tcp_epoll import EpollListener
from steptwin.mic488.device import Mic488Device
from steptwin.simulation.toml.addresses import Address
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort

Run = Callable[..., Any]
Make = Callable[[], tuple[RealTimeDriver, Mic488Device]]

# Read user register 0, and 125 of them.
READ_ONE = bytes.fromhex("000100000006010300000001")
ONE = bytes.fromhex("0001000000050103020000")
READ_MANY = bytes.fromhex("00020000000601030000007D")


# ---------------------------------------------------------------------- over real sockets

KINDS = {"epoll": EpollListener, "asyncio": AsyncioListener}


@pytest.fixture(params=KINDS, autouse=True)
def kind(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> type[Listener]:
    """Both ways of serving clients do the same."""
    monkeypatch.setattr(Scene, "kind", KINDS[request.param])
    return Scene.kind


Client = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Scene:
    """A Modbus TCP link on a free port and clients of it."""

    kind: type[Listener] = LISTENER

    def __init__(self, make_realtime: Make, most: int = 100) -> None:
        self.realtime, self.device = make_realtime()
        self.notices: list[str] = []
        self.clients = Clients(most, self.notices.append)
        self.executed = 0
        self.link = TcpLink(self.realtime, Address("127.0.0.1", 0), lambda: TcpSlavePort({1: self}), self.clients, self.kind)
        self._writers: list[asyncio.StreamWriter] = []

    async def __aenter__(self) -> Scene:
        self.address = await self.link.open()
        return self

    async def __aexit__(self, *exc: object) -> None:
        await self.link.close()
        self.realtime.close()
        for writer in self._writers:
            writer.close()

    def execute(self, pdu: bytes, now: Nanos) -> bytes:
        self.executed += 1
        return self.device.execute(pdu, now)

    async def fallen_to(self, count: int) -> int:
        """How many clients there are, as soon as it is ``count``."""
        for _ in range(1000):
            if len(self.clients.present) == count:
                break
            await asyncio.sleep(0)
        return len(self.clients.present)

    async def client(self) -> Client:
        reader, writer = await asyncio.open_connection(*self.address)
        self._writers.append(writer)
        return reader, writer


async def ask(client: Client) -> bytes:
    client[1].write(READ_ONE)
    return await client[0].readexactly(len(ONE))


def in_scene(run: Run, make_realtime: Make, play: Callable[[Scene], Awaitable[Any]], most: int = 100) -> Any:
    async def scene() -> Any:
        async with Scene(make_realtime, most) as made:
            return await play(made)

    return run(scene())


def test_many_clients_are_answered(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> list[bytes]:
        clients = [await scene.client() for _ in range(50)]
        return [await ask(client) for client in clients * 3]

    assert in_scene(run, make_realtime, play) == [ONE] * 150


def test_more_than_one_request_at_once(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> bytes:
        reader, writer = await scene.client()
        writer.write(READ_ONE * 3 + READ_ONE[:5])
        writer.write(READ_ONE[5:])
        return await reader.readexactly(4 * len(ONE))

    assert in_scene(run, make_realtime, play) == ONE * 4


def test_a_client_that_vanishes_within_a_frame_harms_nobody(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[bytes, int]:
        other = await scene.client()
        _, writer = await scene.client()
        await ask(other)
        writer.write(READ_ONE[:7])
        await writer.drain()
        writer.transport.abort()
        answer = await ask(other)
        return answer, await scene.fallen_to(1)

    assert in_scene(run, make_realtime, play) == (ONE, 1)


def test_a_wrong_header_ends_the_connection_and_is_told(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[bytes, list[str], bytes]:
        other = await scene.client()
        reader, writer = await scene.client()
        writer.write(READ_ONE + b"\0\0\0\7\0\6" + READ_ONE[6:])
        answered = await reader.read(100)
        assert await reader.read() == b""
        return answered, scene.notices, await ask(other)

    answered, (notice,), other = in_scene(run, make_realtime, play)
    assert answered == ONE
    assert re.fullmatch(r"client 127\.0\.0\.1:\d+: MBAP protocol 7 is not 0; its connection is closed", notice)
    assert other == ONE


def test_clients_beyond_the_limit_are_turned_away_and_places_become_free(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[list[bytes], list[str]]:
        first = [await scene.client() for _ in range(2)]
        answers = [await ask(client) for client in first]
        with pytest.raises((asyncio.IncompleteReadError, ConnectionError)):
            await ask(await scene.client())
        first[0][1].transport.abort()
        await scene.fallen_to(1)
        return [*answers, await ask(await scene.client()), await ask(first[1])], scene.notices

    assert in_scene(run, make_realtime, play, most=2) == ([ONE] * 4, ["more than 2 clients at once are turned away"])


def deafen(scene: Scene) -> socket.socket:
    """A client that reads only when it is told to, and little room for what it does not read."""
    assert isinstance(scene.link._listener, EpollListener | AsyncioListener)
    scene.link._listener._listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.connect(scene.address)
    deaf.setblocking(False)
    return deaf


def pour(client: socket.socket, requests: bytes) -> None:
    with contextlib.suppress(BlockingIOError):
        while True:
            client.send(requests)


def test_a_client_that_never_reads_costs_bounded_memory_and_hinders_nobody(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[list[bytes], int]:
        other = await scene.client()
        deaf = deafen(scene)
        answers, waiting = [], 0
        for _ in range(300):
            pour(deaf, READ_MANY * 1000)
            answers.append(await ask(other))
            waiting = max(waiting, *(connection.waiting for connection in scene.clients.present))
        deaf.close()
        return answers, waiting

    answers, waiting = in_scene(run, make_realtime, play)
    assert answers == [ONE] * 300
    assert 0 < waiting < 200_000


def test_while_answers_wait_nothing_is_executed_and_all_are_sent_then(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[int, int, int]:
        deaf = deafen(scene)
        sent = 0
        while not any(connection.waiting for connection in scene.clients.present):
            with contextlib.suppress(BlockingIOError):
                sent += deaf.send(READ_MANY * 10)
            await asyncio.sleep(0)
        executed = scene.executed
        for _ in range(100):
            await asyncio.sleep(0)
        still = scene.executed
        received = 0
        expected = sent // len(READ_MANY) * (9 + 250)
        while received < expected:
            await asyncio.sleep(0)
            with contextlib.suppress(BlockingIOError):
                received += len(deaf.recv(1 << 20))
        deaf.close()
        return still - executed, received - expected, scene.executed - sent // len(READ_MANY)

    assert in_scene(run, make_realtime, play) == (0, 0, 0)


def test_what_was_answered_before_a_wrong_header_is_sent_though_it_has_to_wait(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[int, int, list[str]]:
        deaf = deafen(scene)
        while not any(connection.waiting for connection in scene.clients.present):
            with contextlib.suppress(BlockingIOError):
                assert deaf.send(READ_MANY) == len(READ_MANY)
            await asyncio.sleep(0)
        deaf.send(b"\xff" * 12)
        received = 0
        while True:
            await asyncio.sleep(0)
            with contextlib.suppress(BlockingIOError):
                data = deaf.recv(1 << 20)
                if not data:
                    break
                received += len(data)
        deaf.close()
        return received // (9 + 250), scene.executed, scene.notices

    answers, executed, notices = in_scene(run, make_realtime, play)
    assert answers == executed
    assert len(notices) == 1


def test_a_connection_that_is_to_end_ends_when_its_last_answers_have_found_room(run: Run, make_realtime: Make) -> None:
    """Requests and noise come together, and their answers find no room."""

    async def play(scene: Scene) -> tuple[int, int, int]:
        deaf = deafen(scene)
        deaf.send(READ_MANY * 150 + b"\xff" * 12)
        for _ in range(1000):
            await asyncio.sleep(0)
            if scene.notices:
                break
        waiting = sum(connection.waiting for connection in scene.clients.present)
        received = 0
        while True:
            await asyncio.sleep(0)
            with contextlib.suppress(BlockingIOError):
                data = deaf.recv(1 << 20)
                if not data:
                    break
                received += len(data)
        deaf.close()
        return waiting, received, await scene.fallen_to(0)

    waiting, received, left = in_scene(run, make_realtime, play)
    assert waiting > 0
    assert (received, left) == (150 * (9 + 250), 0)


def test_after_a_wrong_header_the_rest_of_a_flood_is_not_executed(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[int, int]:
        _, writer = await scene.client()
        writer.write(READ_ONE + b"\xff" * 12 + READ_ONE * 1000)
        await asyncio.sleep(0.1)
        return scene.executed, await scene.fallen_to(0)

    assert in_scene(run, make_realtime, play) == (1, 0)


@pytest.mark.parametrize("kind", ["epoll"], indirect=True)
def test_a_system_without_room_for_clients_is_asked_again(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[list[str], bytes, str]:
        """asyncio waits and asks again by itself."""
        assert isinstance(scene.link._listener, EpollListener)
        full = Full(scene.link._listener._listening)
        scene.link._listener._listening = full  # type: ignore[assignment]
        client = await scene.client()
        for _ in range(100):
            await asyncio.sleep(0)
        full.full = False
        return scene.notices, await ask(client), str(scene.address)

    notices, answer, address = in_scene(run, make_realtime, play)
    assert notices == [f"no client is accepted on {address} for {RETRY_S:g} s: too many open files"]
    assert answer == ONE


class Full:
    """A listening socket of a system that has no room."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self.full = True

    def accept(self) -> Any:
        if self.full:
            raise OSError(errno.EMFILE, "Too many open files")
        return self._listener.accept()

    def fileno(self) -> int:
        return self._listener.fileno()

    def close(self) -> None:
        self._listener.close()


def test_a_flood_is_served_in_slices_between_the_requests_of_others(run: Run, make_realtime: Make) -> None:
    """65 536 bytes at once are some 5000 requests; another client's single one is answered among the first of them."""

    async def play(scene: Scene) -> list[str]:
        order: list[str] = []
        flood, other = await scene.client(), await scene.client()
        await ask(flood)
        await ask(other)

        async def flooding() -> None:
            for _ in range(5000):
                await flood[0].readexactly(len(ONE))
                order.append("flood")

        async def asking() -> None:
            await ask(other)
            order.append("other")

        flood[1].write(READ_ONE * 5000)
        await asyncio.gather(flooding(), asking())
        return order

    order = in_scene(run, make_realtime, play)
    assert len(order) == 5001
    assert order.index("other") < 2000


def test_a_client_that_resets_after_a_wrong_header_is_told_by_its_address(run: Run, make_realtime: Make) -> None:
    async def play(scene: Scene) -> tuple[list[str], str]:
        with socket.create_connection(scene.address) as client:
            await scene.fallen_to(1)
            address = Address(*client.getsockname())
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.send(b"GET / HTTP/1.1")
        await scene.fallen_to(0)
        return scene.notices, str(address)

    notices, address = in_scene(run, make_realtime, play)
    assert notices == [f"client {address}: MBAP protocol 21536 is not 0; its connection is closed"]


def test_what_is_no_name_of_a_host(run: Run, make_realtime: Make) -> None:
    async def scene() -> None:
        realtime, _ = make_realtime()
        with pytest.raises(LineFailure, match=r"cannot listen on a\.\.b:0: no name of a host"):
            await TcpLink(realtime, Address("a..b", 0), lambda: TcpSlavePort({}), Clients()).open()

    run(scene())


def test_closing_the_link_ends_its_connections_and_no_others(run: Run, make_realtime: Make) -> None:
    async def scene() -> tuple[bytes, bytes]:
        async with Scene(make_realtime) as one:
            line = TcpLink(one.realtime, Address("127.0.0.1", 0), lambda: RtuSlavePort({1: one.device}), one.clients, one.kind)
            rtu_reader, rtu_writer = await asyncio.open_connection(*await line.open())
            client = await one.client()
            await ask(client)
            await line.close()
            try:
                ended = await rtu_reader.read()
            except ConnectionResetError:
                ended = b""
            rtu_writer.close()
            return ended, await ask(client)

    assert run(scene()) == (b"", ONE)


def test_a_port_that_is_taken(run: Run, make_realtime: Make) -> None:
    async def scene() -> None:
        async with Scene(make_realtime) as one:
            second = TcpLink(one.realtime, one.address, lambda: TcpSlavePort({1: one.device}), one.clients)
            with pytest.raises(
                LineFailure,
                match=rf"cannot listen on 127\.0\.0\.1:{one.address.port}: address already in use; port 0 takes a free one$",
            ):
                await second.open()

    run(scene())
