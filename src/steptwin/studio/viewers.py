"""Viewers over WebSockets: each request is answered, and messages of a session are sent as fast as its viewer reads.

Everything runs in the event loop of the world, so commands are done between the requests of its other clients, without locks.
Nothing that is sent waits or has a task of its own: all messages of a viewer that are there at a tick are one write.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any, Protocol, TypeAlias

from steptwin.errors import Misuse
from steptwin.machine import SECOND, Nanos
from steptwin.studio.hub import Hub
from steptwin.studio.session import ViewerSession
from steptwin.subject.dispatch import Message, failure

AsgiScope: TypeAlias = MutableMapping[str, Any]
AsgiReceive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
AsgiSend: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]

PATH = "/ws"
TICK_S = 1 / 30
PATIENCE_S = 10.0
"""Time-out for a viewer that does not read."""
MOST_UNREAD = 65_536
"""A viewer with more unread bytes than this is sent nothing more, and its requests wait."""
HELLO_S = 10.0
"""Time-out for the hello of a connection."""
REFUSED, SILENT = 4401, 4400
"""Close codes: wrong token, no hello."""


class MessageWriter(Protocol):
    """The sending half of a connection; ``scope["state"]["writer"]``."""

    @property
    def unread(self) -> int:
        """Number of bytes that the operating system has not accepted yet."""
        ...

    def write(self, texts: Iterable[str]) -> None:
        """Send messages, at once. Nothing on a connection that ends."""
        ...

    def abort(self) -> None:
        """End the connection; unread bytes are dropped."""
        ...


class Viewers:
    """All connections. ``clock`` is the wall clock in nanoseconds, which must never go back."""

    def __init__(self, hub: Hub, clock: Callable[[], Nanos]) -> None:
        self._hub = hub
        self._clock = clock
        self._connections: set[ViewerConnection] = set()
        self._ticking: asyncio.Task[None] | None = None

    async def serve(self, scope: AsgiScope, receive: AsgiReceive, send: AsgiSend) -> None:
        """One connection, from its beginning to its end."""
        await receive()  # that it wants to connect
        await send({"type": "websocket.accept"})
        session = ViewerSession(self._hub, _peer(scope))
        connection = ViewerConnection(session, scope["state"]["writer"], self._clock, self._hub.around.on_internal)
        self._connections.add(connection)
        if self._ticking is None:
            self._ticking = asyncio.create_task(self._tick())
        try:
            await connection.serve(receive, send)
        finally:
            self._connections.discard(connection)
            session.close()

    async def _tick(self) -> None:
        """Runs while there are connections. An error in one connection does not affect the others."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while self._connections:
            now = self._clock()
            self._hub.tick(now)
            for connection in self._connections:
                connection.look(now)
            due = max(due + TICK_S, loop.time() + TICK_S / 4)
            await asyncio.sleep(due - loop.time())
        self._ticking = None

    async def close(self) -> None:
        if self._ticking is not None:
            self._ticking.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._ticking


class ViewerConnection:
    """A connection. Answers are sent in order."""

    def __init__(
        self,
        session: ViewerSession,
        writer: MessageWriter,
        clock: Callable[[], Nanos],
        on_internal: Callable[[Exception], object],
    ) -> None:
        self._session = session
        self._writer = writer
        self._clock = clock
        self._on_internal = on_internal
        self._has_room = asyncio.Event()
        self._has_room.set()
        self._unread = 0
        """What there was when the viewer read something last, while there is too much."""
        self._read_at: Nanos = 0

    async def serve(self, receive: AsgiReceive, send: AsgiSend) -> None:
        silent = asyncio.get_running_loop().call_later(HELLO_S, self._writer.abort)
        try:
            while (message := await receive())["type"] == "websocket.receive":
                self._answer(message.get("text"))
                if self._session.is_refused:
                    await send({"type": "websocket.close", "code": REFUSED})
                    return
                if self._session.has_entered:
                    silent.cancel()
                self.look(self._clock())
                await self._has_room.wait()
        finally:
            silent.cancel()

    def _answer(self, text: str | None) -> None:
        """Send an answer when it is available; other requests are served meanwhile."""
        if text is None:
            self._write(failure(Misuse("a message is a text of JSON; this one is binary")))
        else:
            answer = self._session.receive(text, self._clock())
            answer.then(lambda: self._write(answer.result()))

    def _write(self, answer: Message) -> None:
        self._writer.write((json.dumps(answer, separators=(",", ":")),))

    def look(self, now: Nanos) -> None:
        """Send the available messages, if the viewer reads them; end the connection of one that has not for long."""
        unread = self._writer.unread
        if unread > MOST_UNREAD:
            if self._has_room.is_set() or unread < self._unread:
                self._has_room.clear()
                self._unread, self._read_at = unread, now
            elif now - self._read_at > PATIENCE_S * SECOND:
                self._writer.abort()
            return
        self._has_room.set()
        if self._session.is_refused:  # since there is a device, a token is needed
            self._writer.abort()
            return
        try:
            texts = self._session.take(now)
        except Exception as error:  # noqa: BLE001  it is reported here only
            self._on_internal(error)
            self._writer.abort()
            return
        if texts:
            self._writer.write(texts)


def _peer(scope: AsgiScope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else "local"
