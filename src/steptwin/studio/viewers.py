"""Viewers over WebSockets: each request is answered, and messages of a session are sent as fast as its viewer reads.

Everything runs in the event loop of the world, so commands are done between the requests of its other clients, without locks.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterable, MutableMapping
from typing import Any, TypeAlias

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.studio.hub import Hub
from steptwin.studio.viewersession import ViewerSession
from steptwin.subject.dispatch import JsonObject, failure

AsgiScope: TypeAlias = MutableMapping[str, Any]
AsgiReceive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
AsgiSend: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]

PATH = "/ws"
TICK_S = 1 / 30
PATIENCE_S = 10.0
"""Time-out for a viewer to read `MOST_UNSENT` characters."""
MOST_UNSENT = 65_536
"""A viewer for which more characters than this wait is sent nothing more, and its requests wait."""
HELLO_S = 10.0
"""Time-out for the hello of a connection."""
REFUSED, SILENT = 4401, 4400
"""Close codes: wrong token, no hello."""
BINARY_MESSAGE = Message("studio.binary-message", "a message is a text of JSON; this one is binary")


def patience_s(before: int) -> float:
    """Time-out for a message to be sent, which waits until that before it, of ``before`` characters, has been read.

    ASGI does not say how much of a message has been read, so a long one has more time. Besides it, as many bytes may wait as
    asyncio permits, which are `MOST_UNSENT`, too.
    """
    return PATIENCE_S * (1 + before / MOST_UNSENT)


async def until_first(*coroutines: Coroutine[Any, Any, Any]) -> None:
    """Run them until one of them ends, then cancel the others. Raises its error."""
    tasks = [asyncio.create_task(one) for one in coroutines]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        ended = [task for task in tasks if task.done()]
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    for task in ended:
        task.result()


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
        connection = ViewerConnection(session, self._clock, self._hub.around.on_internal)
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

    def __init__(self, session: ViewerSession, clock: Callable[[], Nanos], on_internal: Callable[[Exception], object]) -> None:
        self._session = session
        self._clock = clock
        self._on_internal = on_internal
        self._unsent: deque[str] = deque()
        self._size = 0
        """Characters in ``_unsent``."""
        self._before = 0
        """Characters of the message that was sent last."""
        self._is_wanted = asyncio.Event()
        """Something is to be sent."""
        self._has_room = asyncio.Event()
        self._has_room.set()
        self._ended = asyncio.Event()

    async def serve(self, receive: AsgiReceive, send: AsgiSend) -> None:
        with contextlib.suppress(TimeoutError, OSError):  # it does not read, or is gone
            await until_first(self._read(receive, send), self._send(send), self._ended.wait())

    async def _read(self, receive: AsgiReceive, send: AsgiSend) -> None:
        silent = asyncio.get_running_loop().call_later(HELLO_S, self._ended.set)
        try:
            while (message := await receive())["type"] == "websocket.receive":
                self._answer(message.get("text"))
                if self._session.is_refused:
                    await self._send_all(send)
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
            self._answered(failure(Misuse(BINARY_MESSAGE())))
        else:
            answer = self._session.receive(text, self._clock())
            answer.then(lambda: self._answered(answer.result()))

    def _answered(self, answer: JsonObject) -> None:
        self._put((json.dumps(answer, separators=(",", ":")),))

    def _put(self, texts: Iterable[str]) -> None:
        for text in texts:
            self._unsent.append(text)
            self._size += len(text)
        self._is_wanted.set()

    async def _send(self, send: AsgiSend) -> None:
        while True:
            await self._is_wanted.wait()
            self._is_wanted.clear()
            await self._send_all(send)

    async def _send_all(self, send: AsgiSend) -> None:
        """Raises `TimeoutError` for a viewer that does not read."""
        while self._unsent:
            text = self._unsent.popleft()
            async with asyncio.timeout(patience_s(self._before)):
                await send({"type": "websocket.send", "text": text})
            self._before = len(text)
            self._size -= self._before
        self._has_room.set()

    def look(self, now: Nanos) -> None:
        """Send the available messages, if the viewer reads them."""
        if self._size > MOST_UNSENT:
            self._has_room.clear()
            return
        if self._session.is_refused:  # since there is a device, a token is needed
            self._ended.set()
            return
        try:
            self._put(self._session.take(now))
        except Exception as error:  # noqa: BLE001  it is reported here only
            self._on_internal(error)
            self._ended.set()


def _peer(scope: AsgiScope) -> str:
    client = scope.get("client")
    return str(client[0]) if client else "local"
